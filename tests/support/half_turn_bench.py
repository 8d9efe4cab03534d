"""A bench of one sheath bent by half a turn: its description, and a table of four readings in two mountings."""

_DESCRIPTION = """schema = 1
name = "bench"
[[contact]]
name = "cable"
friction = "mu"
wrap_angle = { value = 180, unit = "deg" }
[tables]
forces = { SOURCE }
"""
TABLE = "F_in (N),F_out (N),run\n20,15.2,1\n40,30.1,1\n20,15.0,2\n40,30.9,2\n"


def describe_half_turn(source: str = 'file = "forces.csv"', name: str = "bench") -> str:
    """The contents of cable.toml, with where its forces are, as that says it."""
    return _DESCRIPTION.replace("SOURCE", source).replace('"bench"', f'"{name}"')
