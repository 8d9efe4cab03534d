"""Estimation: least squares, samplers and their diagnostics, model checks, and whether to trust the result."""
