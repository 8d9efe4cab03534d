"""The cable itself, which knows no table: contacts and their laws, curves, friction, elasticity, load cells, noise."""
