"""Methods: each is one file and one entry in `library`."""
