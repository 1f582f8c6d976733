"""Models fitted to measured means, and corrected by fresh runs around their optimum."""
