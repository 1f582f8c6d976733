"""The statistics of a table that somebody else measured or simulated: its design, its analysis, its page."""
