"""The choice of the next tests: what each candidate would buy, at what cost."""
