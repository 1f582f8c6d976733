"""Contacts in other codes: the same two bodies there and here, step by step."""
