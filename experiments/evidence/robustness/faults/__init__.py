"""Faults by doing them: runs that are killed, disks that are full, two runs in one folder."""
