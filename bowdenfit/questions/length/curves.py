"""Efficiency and wrap angles along the route with their uncertainty."""

import jax
import numpy as np

from bowdenfit.inference.compilation import compile_program
from bowdenfit.inference.draws import curve_function
from bowdenfit.plots.curves import BAND_QUANTILES, Band
from bowdenfit.results.along_route import route_grid
from bowdenfit.results.record import Record, cached_per_fit

_DRAWS = 5000  # enough for a line's width of accuracy


@cached_per_fit
def along_route(fit: Record) -> dict[str, Band]:
    """The efficiency [1] and every curved wrap angle [deg], by name; empty without a route."""
    if fit.dataset.description.route is None:
        return {}
    if fit.sampled is not None:
        grid, draws = fit.along_route.grid, fit.along_route.curves
        every = max(1, len(fit.posterior.flat_z) // _DRAWS)
        return {name: Band(grid, np.quantile(d[::every], BAND_QUANTILES, axis=0)) for name, d in draws.items()}
    grid = route_grid(fit.model)
    with jax.enable_x64(True):
        z = np.asarray(fit.least_squares.z)
        lines = compile_program(curve_function(fit.model, grid), z, run_once=True)(z)
    return {name: Band(grid, np.asarray(line)[None]) for name, line in lines.items()}
