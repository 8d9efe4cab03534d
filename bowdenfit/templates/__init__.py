"""Files that `bowdenfit init` writes."""
