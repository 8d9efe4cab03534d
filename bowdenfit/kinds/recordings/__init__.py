"""Force recordings: two load cells sampled while a motor pulls, stops, reverses and returns."""
