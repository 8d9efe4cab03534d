"""From a data set to a finished fit: prepare the results folder, fit, sample, write."""
