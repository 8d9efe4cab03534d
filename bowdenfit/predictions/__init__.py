"""What the posterior says of quantities nobody measured: every draw gives its own answer, nothing is plugged in."""
