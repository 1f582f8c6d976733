"""Physical tests, one file each."""
