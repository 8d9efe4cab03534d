"""Forces read at both ends of a cable."""
