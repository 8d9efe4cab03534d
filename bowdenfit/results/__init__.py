"""A finished fit as data: its record, its results folder, and the best length that follows from its draws."""
