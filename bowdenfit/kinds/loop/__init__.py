"""Forces at both ends of a pull-pull loop while it moves."""
