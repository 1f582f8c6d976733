"""Other codes on the same scene, one file each."""
