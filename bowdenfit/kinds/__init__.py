"""One folder a kind of measurement: its table (NumPy) and its term in the likelihood (JAX)."""
