"""Pages of the record of the buckwheat study."""
