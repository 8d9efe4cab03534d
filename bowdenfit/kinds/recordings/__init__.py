"""Force recordings."""
