"""Wrap angles of curved contacts along the route."""
