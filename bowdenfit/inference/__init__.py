"""From a model and its data to estimates: least squares, ensembles of walkers, and whether to trust them."""
