"""Forces at both ends of a pull-pull loop."""
