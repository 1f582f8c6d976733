"""A made-up study to try the search for missing effects on, and the truth behind its shipped data."""
