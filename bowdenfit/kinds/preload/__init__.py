"""Preload between fixed ends."""
