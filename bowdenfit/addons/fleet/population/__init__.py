"""Populations of cables: what cables have in common, how much they differ, and how they wear, from draws of single fits."""
