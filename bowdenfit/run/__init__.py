"""From a data set to a finished fit: stages, helpers beside them, and what is written."""
