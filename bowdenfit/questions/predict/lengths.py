"""Predictions as rows of a table, for the command line and for other programs."""

from collections.abc import Sequence
from typing import Any

import jax
import numpy as np

from bowdenfit.description import Route
from bowdenfit.errors import DatasetError, UsageError
from bowdenfit.inference.draws import output_force_at
from bowdenfit.inference.interval import Interval
from bowdenfit.questions.predict.outside import measured, pulled
from bowdenfit.results.record import Record
from bowdenfit.units import conversion_factor, route_conversion_factor
from bowdenfit.verb import Length

_STROKES = {"pull": 1, "return": -1}


def predict_at_lengths(
    fit: Record, lengths: np.ndarray, input_force: tuple[float, str] | None, stroke: str
) -> list[dict[str, Any]]:
    """Efficiency, or output force, at route values; a note says what lies outside the measurements, and where a rope is slack.

    Args:
        fit: The fit.
        lengths: Route values.
        input_force: Force and unit; efficiencies are predicted without.
        stroke: "pull" or "return".

    Raises:
        UsageError: The input force is not a positive force, or there is no posterior.
    """
    route, sign, asked = fit.dataset.description.route, _STROKES[stroke], None
    name, force, per = "efficiency", fit.model.cable.friction.conditions.reference_force, 1.0
    if input_force is not None:
        name, force = "output_force_N", (asked := _newtons(input_force))
    else:
        per = force
    (mean, words), (mounted, _) = (pulled(found, force) for found in _forces(fit, lengths, force, sign))
    mean, mounted, limits = mean / per, mounted / per, measured(fit)
    of_load = {"at_input_force_N": force} if fit.model.cable.friction.depends_on_load and asked is None else {}
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
        row |= of_load
        notes = [words[i], *limits.notes(None if route is None else float(length), asked)]
        if route is not None:
            row["in_range"] = bool(route.range[0] <= length <= route.range[1])
            notes += (
                []
                if row["in_range"]
                else [f"outside the curves, {route.range[0]:g} to {route.range[1]:g} {route.unit}"]
            )
        row["note"] = "; ".join(note for note in notes if note)
        rows.append(row)
    return rows


def in_unit_of(route: Route | None, lengths: Sequence[Length] | None) -> list[float]:
    """Route values in the unit of the route.

    Args:
        route: The route; None without one.
        lengths: Numbers, or numbers with their units.

    Raises:
        UsageError: A unit is unknown, or measures something else, or there is no route.
    """
    found = []
    for length in lengths or ():
        value, unit = length if isinstance(length, tuple) else (float(length), "")
        try:
            found.append(value * route_conversion_factor(unit, route.unit) if unit and route else value)
        except DatasetError as error:
            raise UsageError(f"LENGTHS, {value:g} {unit}: {error}.") from None
        if unit and route is None:
            raise UsageError(f"LENGTHS, {value:g} {unit}: this cable has no route, so there are no lengths to predict at.")
    return found


def _forces(fit: Record, lengths: np.ndarray, force: float, sign: int) -> tuple[np.ndarray, np.ndarray]:
    """Output force [N] of every draw (rows) at route values (columns), and the same in a new mounting."""
    route, reference = fit.dataset.description.route, fit.model.cable.friction.conditions.reference_force
    if route is not None and (force, sign, tuple(lengths)) == (reference, 1, tuple(route.choices)):
        return fit.along_route.mean, fit.along_route.mounted
    z = fit.draws().flat_z
    with jax.enable_x64(True):
        mean, mounted = output_force_at(fit.model, z, lengths, force, sign, (np.zeros(len(z)), fit.mounting()))
    return mean, mounted


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
