"""Everything that was found, on one page to hand on."""
