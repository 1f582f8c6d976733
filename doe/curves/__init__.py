"""Responses that are curves: emulators, fits and profiles."""
