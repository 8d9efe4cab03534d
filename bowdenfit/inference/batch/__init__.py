"""Fits of many data sets of one shape with programs compiled once."""
