"""The rules that end an analysis, and the record of all that it found."""
