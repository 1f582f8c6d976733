"""Errors, files, tables, TOML and units."""
