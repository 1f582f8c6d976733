"""Campaigns and searches in a folder: what is simulated is kept as it comes, reports end it."""
