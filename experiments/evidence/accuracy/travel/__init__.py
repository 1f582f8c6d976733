"""Proof that a card travels: the same heaps here and in the codes that it is exported to."""
