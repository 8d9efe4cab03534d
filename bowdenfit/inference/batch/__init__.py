"""Many data sets of one shape fitted in one program."""
