"""The page to start from: what its buttons ask for, by the functions that the commands call."""
