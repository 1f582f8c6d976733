"""Records of studies."""
