"""Storage of cases."""
