"""Striking what runs for long, and judging what comes of it."""
