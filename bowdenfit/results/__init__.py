"""What a fit found: an immutable object, its summary, and the folder it is kept in."""
