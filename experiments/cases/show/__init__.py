"""Pictures, films and meshes of a case."""
