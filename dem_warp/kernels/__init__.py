"""Launchable device code, built for one precision and cached."""
