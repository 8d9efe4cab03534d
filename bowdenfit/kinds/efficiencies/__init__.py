"""Transmission efficiencies."""
