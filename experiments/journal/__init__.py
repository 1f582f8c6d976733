"""The journal that a run keeps in its folder while it works: whoever can read it can watch the run."""
