"""What cables of a fleet have in common: coefficients, wear, life, which is unlike the rest, and what to inspect next."""
