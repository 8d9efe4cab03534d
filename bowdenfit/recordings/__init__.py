"""From the channels of a recording to forces, prepared and cut into strokes."""
