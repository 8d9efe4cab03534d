"""Ring-down: the joint is released against the rope, and swings until damping and friction have stopped it."""
