"""Forecast of wall time."""
