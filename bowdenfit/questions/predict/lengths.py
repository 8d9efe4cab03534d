"""Predictions as rows of a table, for the command line and for other programs."""

from collections.abc import Mapping, Sequence
from typing import Any

import jax
import numpy as np

from bowdenfit.arguments import NumberWithUnit
from bowdenfit.description import Route
from bowdenfit.errors import DatasetError, UsageError
from bowdenfit.inference.interval import Interval
from bowdenfit.questions.predict.measured_range import clip_to_tension, find_measured_range
from bowdenfit.results.prediction_angles import (
    NO_ANGLES,
    PredictionAngles,
    choose_angles,
    predict_forces,
    split_lengths,
)
from bowdenfit.results.record import Record
from bowdenfit.units import conversion_factor, route_conversion_factor

_STROKES = {"pull": 1, "return": -1}


def predict_at_lengths(
    fit: Record,
    lengths: np.ndarray,
    input_force: tuple[float, str] | None = None,
    stroke: str = "pull",
    output_force: tuple[float, str] | None = None,
    stated: Mapping[int, float] = NO_ANGLES,
) -> list[dict[str, Any]]:
    """Predict efficiency or a force at route values; a note says what lies outside the measurements or where a rope is slack.

    Args:
        fit: The fit.
        lengths: Route values.
        input_force: Force and unit, of which the output force is predicted; efficiencies are predicted without.
        stroke: "pull" or "return".
        output_force: Force and unit that is wanted, of which the input force is predicted.
        stated: Stated wrap angles [rad], by number of the contact; the others keep their own.

    Raises:
        UsageError: A force is not a positive force, or there is no posterior, or no wrap angle is known outside the curves, or
            there are too many route values.
    """
    return [
        row
        for part in split_lengths(lengths)
        for row in _predict_part(fit, part, input_force, stroke, output_force, stated)
    ]


def _predict_part(
    fit: Record,
    lengths: np.ndarray,
    input_force: tuple[float, str] | None,
    stroke: str,
    output_force: tuple[float, str] | None,
    stated: Mapping[int, float],
) -> list[dict[str, Any]]:
    """Return the predictions at a part of the route values; see `predict_at_lengths`."""
    route, sign, limits = fit.dataset.description.route, _STROKES[stroke], find_measured_range(fit)
    name, force, divisor, stated_force = "efficiency", fit.model.cable.friction.conditions.reference_force, 1.0, None
    if input_force is not None:
        name, force = "output_force_N", (stated_force := to_newtons(input_force, "--input-force"))
    elif output_force is not None:
        name, force = "input_force_N", (stated_force := to_newtons(output_force, "--output-force"))
    else:
        divisor = force
    inverse = output_force is not None
    slack_word = "held by friction alone" if inverse else "slack"
    angles = choose_angles(fit.dataset, lengths, stated, fit.provenance.seed)
    force_draws = _output_forces(fit, angles, force, sign, inverse)
    (mean, words), (mounted, _) = (clip_to_tension(forces, force, slack_word) for forces in force_draws)
    mean, mounted = mean / divisor, mounted / divisor
    of_load = {"at_input_force_N": force} if fit.model.cable.friction.depends_on_load and stated_force is None else {}
    rows = []
    for i, length in enumerate(lengths):
        row: dict[str, Any] = {} if route is None else {f"{route.variable}_{route.unit}": float(length)}
        row |= summarize_draws(name, mean[:, i], mounted[:, i]) | of_load
        load = row[name] if inverse else stated_force
        notes = [words[i], angles.notes[i], *limits.notes(None if route is None else float(length), load)]
        if route is not None:
            notes.append(angles.outside[i])
            row["in_range"] = not angles.outside[i]
        row["note"] = "; ".join(note for note in notes if note)
        rows.append(row)
    return rows


def summarize_draws(name: str, mean: np.ndarray, mounted: np.ndarray) -> dict[str, Any]:
    """Return median, moments and quantiles of a quantity at one place, and its quantiles in any one mounting.

    Args:
        name: The quantity.
        mean: Its draws, without the effect of a mounting.
        mounted: Its draws in new mountings.
    """
    interval, mounting = Interval.of(mean), np.quantile(mounted, (0.05, 0.95))
    row = {name: interval.median, "mean": interval.mean, "sd": interval.sd, "q05": interval.q05, "q95": interval.q95}
    return row | {"mounting_q05": float(mounting[0]), "mounting_q95": float(mounting[1])}


def choose_route_values(fit: Record, lengths: Sequence[float | NumberWithUnit] | None) -> np.ndarray:
    """Return route values to predict at, by default those of the description; any one number without a route.

    Raises:
        UsageError: There are none, or one is no number.
    """
    route = fit.dataset.description.route
    numbers = [length[0] if isinstance(length, tuple) else length for length in lengths or ()]
    if invalid := [number for number in numbers if not np.isfinite(number)]:
        raise UsageError(f"{invalid[0]} is not a length; name the lengths to predict at as numbers.")
    if not lengths and route is not None and not route.choices:
        raise UsageError("the description has no choices; name the lengths to predict at.")
    return np.asarray(to_route_unit(route, lengths) or (route.choices if route else [0.0]), dtype=float)


def to_route_unit(route: Route | None, lengths: Sequence[float | NumberWithUnit] | None) -> list[float]:
    """Convert route values to the unit of the route.

    Args:
        route: The route; None without one.
        lengths: Numbers, or numbers with their units.

    Raises:
        UsageError: A unit is unknown, or measures something else, or there is no route, or a length is negative.
    """
    values = []
    for length in lengths or ():
        value, unit = length if isinstance(length, tuple) else (float(length), "")
        try:
            values.append(value * route_conversion_factor(unit, route.unit) if unit and route else value)
        except DatasetError as error:
            raise UsageError(f"LENGTHS, {value:g} {unit}: {error}.") from None
        if route is not None and values[-1] < 0 <= route.range[0]:
            named, ends = route.variable.replace("_", " "), f"from {route.range[0]:g} to {route.range[1]:g} {route.unit}"
            raise UsageError(
                f"LENGTHS, {value:g} {unit or route.unit}: no {named} is negative where the route goes {ends}; leave out the "
                "minus."
            )
        if unit and route is None:
            raise UsageError(f"LENGTHS, {value:g} {unit}: this cable has no route, so there are no lengths to predict at.")
    return values


def _output_forces(
    fit: Record, angles: PredictionAngles, force: float, sign: int, inverse: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Return forces at the other end [N] of every draw (rows) at route values (columns), and the same in a new mounting."""
    route, reference = fit.dataset.description.route, fit.model.cable.friction.conditions.reference_force
    is_usual = not inverse and route is not None and not angles.rows.is_own.any()
    if route is not None and is_usual and (force, sign, tuple(angles.rows.route)) == (reference, 1, tuple(route.choices)):
        return fit.along_route.mean, fit.along_route.mounted
    z = fit.draws().flat_z
    with jax.enable_x64(True):
        mountings = np.zeros(len(z)), fit.mounting()
        mean, mounted = predict_forces(fit.model, z, angles, force, sign, mountings, inverse=inverse)
    return mean, mounted


def to_newtons(force: tuple[float, str], option: str) -> float:
    """Convert a positive force to N.

    Raises:
        UsageError: It is none.
    """
    try:
        value = force[0] * conversion_factor(force[1], "force")
    except DatasetError as error:
        raise UsageError(f"{option}: {error}.") from None
    if not value > 0:
        raise UsageError(
            f"{option} {force[0]:g}{force[1]} is not positive; write the tension as a positive force."
        )
    return value
