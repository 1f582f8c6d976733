"""Pages of the kept records, written from the files beside them."""
