"""Pure functions of arrays: the equations, in N, mm and rad, without parameters, files or globals."""
