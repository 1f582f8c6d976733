"""Contact terms of other codes: what a case is called there, with formula, unit and source."""
