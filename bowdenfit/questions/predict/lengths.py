"""Predictions as rows of a table, for the command line and for other programs."""

from typing import Any

import jax
import numpy as np

from bowdenfit.cable.load_cells import RUN_SCATTER
from bowdenfit.cable.noise import noise_law
from bowdenfit.errors import DatasetError, UsageError
from bowdenfit.inference.draws import output_force_at
from bowdenfit.inference.interval import Interval
from bowdenfit.results.record import Record
from bowdenfit.units import conversion_factor

_STROKES = {"pull": 1, "return": -1}


def predict_at_lengths(
    fit: Record, lengths: np.ndarray, input_force: tuple[float, str] | None, stroke: str
) -> list[dict[str, Any]]:
    """Efficiency, or output force, at route values.

    Args:
        fit: The fit.
        lengths: Route values.
        input_force: Force and unit; efficiencies are predicted without.
        stroke: "pull" or "return".

    Raises:
        UsageError: The input force is not a positive force, or there is no posterior.
    """
    route, sign = fit.dataset.description.route, _STROKES[stroke]
    name, force, per = "efficiency", fit.model.cable.friction.conditions.reference_force, 1.0
    if input_force is not None:
        name, force = "output_force_N", _newtons(input_force)
    else:
        per = force
    z = fit.draws().flat_z
    with jax.enable_x64(True):
        mean, mounted = (
            output_force_at(fit.model, z, lengths, force, sign, mounting) / per
            for mounting in (np.zeros(len(z)), _mounting(fit, len(z)))
        )
    rows = []
    for i, length in enumerate(lengths):
        row: dict[str, Any] = {} if route is None else {f"{route.variable}_{route.unit}": float(length)}
        interval = Interval.of(mean[:, i])
        mounting = np.quantile(mounted[:, i], (0.05, 0.95))
        row |= {
            name: interval.median,
            "mean": interval.mean,
            "sd": interval.sd,
            "q05": interval.q05,
            "q95": interval.q95,
        }
        row |= {"mounting_q05": float(mounting[0]), "mounting_q95": float(mounting[1])}
        if route is not None:
            row["in_range"] = bool(route.range[0] <= length <= route.range[1])
        rows.append(row)
    return rows


def _newtons(force: tuple[float, str]) -> float:
    try:
        newtons = force[0] * conversion_factor(force[1], "force")
    except DatasetError as error:
        raise UsageError(f"--input-force: {error}.") from None
    if not newtons > 0:
        raise UsageError(
            f"--input-force {force[0]:g}{force[1]} is not positive; write the tension as a positive force."
        )
    return newtons


def _mounting(fit: Record, n: int) -> np.ndarray:
    """Effect of one new mounting on the friction exponent, for every draw."""
    posterior = fit.posterior
    scatter = 0.0 if posterior is None else posterior.values.get(RUN_SCATTER, np.zeros(1)).ravel()
    return scatter * noise_law(fit.dataset.description).draw_with(np.random.default_rng([fit.provenance.seed, 3]), n)
