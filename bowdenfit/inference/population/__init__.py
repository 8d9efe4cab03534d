"""Populations of cables: from the draws of single fits to what all have in common, how much they differ, and how they wear."""
