"""A kind of table: the force lost while pulling, at an input force."""
