"""Pictures drawn of heaps."""
