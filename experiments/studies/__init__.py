"""Studies that come with the project."""
