"""Forces read at both ends, run by run."""
