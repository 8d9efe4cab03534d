"""JSON schemas of the files that people and programs write and read."""
