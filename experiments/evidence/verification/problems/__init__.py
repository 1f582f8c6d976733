"""Verification problems: what must come out, by closed form or published reference, and what does."""
