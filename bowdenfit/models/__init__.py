"""Physics, parameters and measurements together: what a cable predicts for each table, and how likely the table is."""
