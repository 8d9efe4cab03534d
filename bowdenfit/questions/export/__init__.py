"""What a fitted cable does, as other programs read it: C, MuJoCo, FMI, MATLAB, YAML, CSV."""
