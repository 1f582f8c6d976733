"""Measured heaps as files: read, checked, looked over, and a file to start from."""
