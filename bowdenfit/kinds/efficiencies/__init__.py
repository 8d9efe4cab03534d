"""Measured transmission efficiencies."""
