"""Designs, one a file: functions from factors to a ``doe.Design``, and what changes or judges a design."""
