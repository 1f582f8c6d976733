"""The trail that a run leaves in its folder while it works: whoever can read it can watch the run."""
