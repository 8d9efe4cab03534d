"""Where a cable loses its force: the share of each contact."""
