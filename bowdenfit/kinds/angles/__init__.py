"""Wrap angles read along the route."""
