"""Robustness: kills, full disks, mutated files and clusters."""
