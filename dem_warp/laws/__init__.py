"""Contact mechanics, one file a mechanism: formula, units and source in each docstring."""
