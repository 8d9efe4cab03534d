"""Stretch of the rope under load."""
