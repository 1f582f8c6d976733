"""Campaigns on a real batch system: one node of SLURM on this machine."""
