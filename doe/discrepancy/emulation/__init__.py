"""A bank of runs, and the emulator that is fitted to it."""
