"""What a run leaves in its folder while it works, so that anyone who can read the folder can watch it."""
