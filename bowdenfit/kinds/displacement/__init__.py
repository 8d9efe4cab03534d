"""Force at the motor against its displacement: one load cell and one position, with a spring or a stop at the far end."""
