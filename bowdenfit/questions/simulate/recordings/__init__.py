"""Recordings made from known truth: the plan (`bench.toml` with [recordings]), and the folder that comes of it."""
