"""Records of the buckwheat study."""
