"""From files to validated arrays in N, mm, rad and s."""
