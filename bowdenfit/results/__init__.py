"""The record of a fit, the folder it is kept in, and the best length that follows from its draws."""
