"""Predictions at stated wrap angles of contacts, and while one bends, as over a gait: the mean, the least and the most."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from bowdenfit.errors import DatasetError, UsageError, suggest_name
from bowdenfit.files.columns import Quantity, find_columns
from bowdenfit.files.headings import split_brackets
from bowdenfit.files.tables import RawTable, read_table
from bowdenfit.inference.draws import for_each_draw
from bowdenfit.inference.interval import Interval
from bowdenfit.kinds.rows import read_angle
from bowdenfit.questions.bends.bent_cable import find_bent_contact
from bowdenfit.questions.predict.lengths import to_newtons
from bowdenfit.questions.predict.measured_range import clip_to_tension, find_measured_range
from bowdenfit.results.prediction_angles import NO_ANGLES, PredictionAngles, choose_angles, split_lengths
from bowdenfit.results.record import Record
from bowdenfit.units import ColumnSource, conversion_factor
from bowdenfit.words import counted, quoted

_MOST_ANGLES = 512  # angles of a gait; of more, 512 quantiles stand for them
_ANGLE_UNITS = ("deg", "rad", "mrad")  # as a heading ends: theta_deg
_TORQUE = "torque_N_m"
_STROKES = {"pull": 1.0, "return": -1.0}


@dataclass(frozen=True)
class Gait:
    """Wrap angles that one contact goes through while the others keep theirs.

    Args:
        contact: Its number.
        name: Its name.
        angles: Wrap angles [rad], each for as long as the others.
        stated: How many were stated.
        arms: Moment arm of the rope at the joint at each angle [mm]; None where none is stated.
    """

    contact: int
    name: str
    angles: np.ndarray
    stated: int
    arms: np.ndarray | None = None

    @property
    def description(self) -> str:
        """'mean over 101 wrap angles of 'bracket edge', 0 to 45 deg'"""
        low, high = np.rad2deg([self.angles.min(), self.angles.max()])
        if self.stated == 1:
            return f"{self.name!r} bent by {low:.4g} deg"
        return f"mean over {counted(self.stated, 'wrap angle')} of {self.name!r}, {low:.4g} to {high:.4g} deg"


def make_gait(
    fit: Record, contact: str | None, angles: Sequence[tuple[float, str]], file: str | Path | None, column: str | None
) -> Gait:
    """Return the gait that is asked for.

    Args:
        fit: The fit.
        contact: Name of the contact; the only one that can be meant if omitted.
        angles: Its wrap angles with their units; or they stand in
        file: a table,
        column: under this heading, where it is not one that means a wrap angle.

    Raises:
        UsageError: There is no such contact, or no wrap angle.
        DatasetError: The table cannot be read.
    """
    contacts = [c.name for c in fit.dataset.description.contact]
    number = find_bent_contact(fit.model) if contact is None else _find_contact(fit, contact, f"--contact {contact!r}")
    if bool(angles) == (file is not None):
        raise UsageError(
            "--contact needs the wrap angles that it goes through: as --wrap-angle 45deg, which may be repeated, or a table of "
            "them as --gait FILE; name one of the two."
        )
    if column is not None and file is None:
        raise UsageError(f"--gait-column {column!r} names a column of --gait FILE, and none is given; leave it out.")
    angles_rad, arms = (_convert_angles(angles), None) if file is None else _read_gait(Path(file), column)
    if len(angles_rad) <= _MOST_ANGLES:
        return Gait(number, contacts[number], angles_rad, len(angles_rad), arms)
    middles = (np.arange(_MOST_ANGLES) + 0.5) / _MOST_ANGLES * len(angles_rad) - 0.5
    order, ranks = np.argsort(angles_rad, kind="stable"), np.arange(len(angles_rad))
    kept_angles, kept_arms = (None if of is None else np.interp(middles, ranks, of[order]) for of in (angles_rad, arms))
    assert kept_angles is not None
    return Gait(number, contacts[number], kept_angles, len(angles_rad), kept_arms)


def read_stated_angles(fit: Record, named: Sequence[tuple[str, tuple[float, str]]], gait: Gait | None) -> dict[int, float]:
    """Return stated wrap angles [rad] by number of the contact.

    Args:
        fit: The fit.
        named: Names of contacts, and their wrap angles with units.
        gait: Wrap angles that another contact goes through; None without.

    Raises:
        UsageError: There is no such contact, one is named twice, or an angle is none.
    """
    stated: dict[int, float] = {}
    for name, angle in named:
        number = _find_contact(fit, name, f"--wrap-angle '{name}={angle[0]:g}{angle[1]}'")
        if gait is not None and number == gait.contact:
            raise UsageError(
                f"--wrap-angle '{name}={angle[0]:g}{angle[1]}' and --contact or --gait both state the wrap angles of {name!r}; "
                "leave one of them out."
            )
        if number in stated:
            raise UsageError(
                f"--wrap-angle states {name!r} twice; state it once, or ask for the mean over several wrap angles by "
                f"--contact {name!r} with each as --wrap-angle {angle[0]:g}{angle[1]}."
            )
        (stated[number],) = _convert_angles([angle])
    return stated


def _find_contact(fit: Record, name: str, option: str) -> int:
    """Return the number of a contact."""
    contacts = [contact.name for contact in fit.dataset.description.contact]
    if name not in contacts:
        raise UsageError(f"{option}: there is no such contact{suggest_name(name, contacts)}")
    return contacts.index(name)


def _convert_angles(angles: Sequence[tuple[float, str]]) -> np.ndarray:
    """Return stated wrap angles in rad."""
    try:
        angles_rad = np.array([value * conversion_factor(unit, "angle") for value, unit in angles])
    except DatasetError as error:
        raise UsageError(f"--wrap-angle: {error}.") from None
    if np.any(angles_rad < 0) or not np.all(np.isfinite(angles_rad)):
        raise UsageError("--wrap-angle: a wrap angle is negative; it is the sum of all bends, so write it without a sign.")
    return angles_rad


def _read_gait(path: Path, column: str | None) -> tuple[np.ndarray, np.ndarray | None]:
    """Read wrap angles of a table [rad], and moment arms where it has some [mm]."""
    table = read_table(path)
    named = {} if column is None else {"wrap_angle": _name_gait_column(table, column)}
    columns = find_columns(table, (Quantity("wrap_angle", "angle"), Quantity("moment_arm", "length")), named)
    if "wrap_angle" not in columns:
        raise DatasetError(
            f"{path.name} has no column wrap_angle; it has {quoted(table.header)}. Name the column wrap_angle_deg, or say "
            "which it is, with its unit: --gait-column 'NAME:deg'."
        )
    source = columns["wrap_angle"]
    angles = np.array(source.read_cells(lambda cell: read_angle(cell, source), np.nan))
    arms = np.array(columns["moment_arm"].numbers()) if "moment_arm" in columns else None
    table.faults.refuse()
    if not len(angles):
        raise DatasetError(f"{path.name} has a heading and no rows; a gait needs a row for each wrap angle.")
    return angles, arms


def _name_gait_column(table: RawTable, column: str) -> ColumnSource:
    """Return the column that --gait-column names, with its unit: behind a colon, in brackets, or behind the last underscore.

    Raises:
        DatasetError: There is no such column, or its unit is not said.
    """
    heading, _, unit = (column, "", "") if column in table.header else column.rpartition(":")
    if heading not in table.header:
        raise DatasetError(
            f"--gait-column {column!r}: {table.file} has no such column{suggest_name(heading or column, table.header)}"
        )
    if unit:
        return ColumnSource(name=heading, unit=unit)
    ending = heading.rpartition("_")[2]
    if ending in _ANGLE_UNITS:
        return ColumnSource(name=heading, unit=ending)
    if not split_brackets(heading)[1] and not table.units[table.header.index(heading)]:
        raise DatasetError(
            f"--gait-column {column!r}: the column does not state its unit; write it behind the heading, as --gait-column "
            f"{f'{heading}:deg'!r}."
        )
    return ColumnSource(name=heading)


def predict_over_gait(
    fit: Record,
    lengths: np.ndarray,
    gait: Gait,
    input_force: tuple[float, str] | None = None,
    stroke: str = "pull",
    output_force: tuple[float, str] | None = None,
    stated: Mapping[int, float] = NO_ANGLES,
) -> list[dict[str, Any]]:
    r"""Predict efficiency, output force or input force at route values: the mean over a gait, and its extremes.

    With an input force and moment arms the torque at the joint too,
    :math:`\tau(\varphi) = r(\varphi) F_\text{in} e^{-\Lambda(\theta(\varphi))}`.

    Args:
        fit: The fit.
        lengths: Route values.
        gait: Wrap angles of one contact.
        input_force: Force and unit, of which the output force is predicted; efficiencies are predicted without.
        stroke: "pull" or "return".
        output_force: Force and unit that is wanted, of which the input force is predicted.
        stated: Wrap angles of other contacts [rad], by number; without one a contact keeps its own.
    """
    return [
        row
        for part in split_lengths(lengths)
        for row in _predict_part(fit, part, gait, input_force, stroke, output_force, stated)
    ]


def _predict_part(
    fit: Record,
    lengths: np.ndarray,
    gait: Gait,
    input_force: tuple[float, str] | None,
    stroke: str,
    output_force: tuple[float, str] | None,
    stated: Mapping[int, float],
) -> list[dict[str, Any]]:
    """Return the predictions at a part of the route values; see `predict_over_gait`."""
    route, limits = fit.dataset.description.route, find_measured_range(fit)
    friction = fit.model.cable.friction
    force, divisor, name, slack_word = friction.conditions.reference_force, 1.0, "efficiency", "slack"
    if output_force is not None:
        name, force = "input_force_N", to_newtons(output_force, "--output-force")
        slack_word = "held by friction alone"
    elif input_force is not None:
        name, force = "output_force_N", to_newtons(input_force, "--input-force")
    else:
        divisor = force
    angles = choose_angles(fit.dataset, lengths, stated, fit.provenance.seed, gait.contact)
    forces = _forces_over_gait(fit, angles, gait, force, _STROKES[stroke], inverse=output_force is not None)
    words = clip_to_tension(forces["mean"], force, slack_word)[1]
    of_load = {"at_input_force_N": force} if friction.depends_on_load and name == "efficiency" else {}
    rows = []
    for i, length in enumerate(lengths):
        row: dict[str, Any] = {} if route is None else {f"{route.variable}_{route.unit}": float(length)}
        row |= _format_interval(name, forces["mean"][:, i] / divisor)
        mounting = np.quantile(forces["mounted"][:, i] / divisor, (0.05, 0.95))
        row |= {"mounting_q05": float(mounting[0]), "mounting_q95": float(mounting[1])} | of_load
        if len(gait.angles) > 1:
            for which in ("least", "most"):
                row |= _format_interval(f"{which}_{name}", forces[which][:, i] / divisor, f"{which}_{name}_")
        if name == "output_force_N" and gait.arms is not None:
            for which in ("", "most_"):
                row |= _format_interval(f"{which}{_TORQUE}", forces[f"{which}torque"][:, i] / 1000, f"{which}{_TORQUE}_")
        load = None if name == "efficiency" else float(np.median(forces["mean"][:, i])) if output_force else force
        notes = [words[i], gait.description, angles.notes[i], *limits.notes(None if route is None else float(length), load)]
        if route is not None:
            notes.append(angles.outside[i])
            row["in_range"] = not angles.outside[i]
        rows.append(row | {"note": "; ".join(note for note in notes if note)})
    return rows


def _format_interval(name: str, draws: np.ndarray, prefix: str = "") -> dict[str, float]:
    """Return the interval of draws as cells of a row."""
    interval = Interval.of(np.maximum(draws, 0.0))
    return {name: interval.median} | {f"{prefix}{key}": getattr(interval, key) for key in ("mean", "sd", "q05", "q95")}


def _forces_over_gait(
    fit: Record, chosen: PredictionAngles, gait: Gait, force: float, sign: float, *, inverse: bool
) -> dict[str, np.ndarray]:
    """Return forces at the other end [N], draws by route values: the mean, in a new mounting, and the extremes."""
    model, cable = fit.model, fit.model.cable
    function: Callable[..., Array] = cable.input_force_at_angles if inverse else cable.output_force_at_angles

    def average_over_gait(values: Mapping[str, Array], bends: Array, mounting: Array, errors: Array) -> dict[str, Array]:
        angles, route = chosen.resolve(cable, values, errors), jnp.asarray(chosen.rows.route)

        def step(carry: dict[str, Array], bend: Array) -> tuple[dict[str, Array], None]:
            bent = angles.at[:, gait.contact].set(bend[0])
            forces_by_draw = jnp.maximum(function(values, bent, jnp.asarray(force), jnp.asarray(sign), mounting, route), 0.0)
            torque = bend[1] * forces_by_draw
            return {
                "mean": carry["mean"] + forces_by_draw / len(bends), "least": jnp.minimum(carry["least"], forces_by_draw),
                "most": jnp.maximum(carry["most"], forces_by_draw), "torque": carry["torque"] + torque / len(bends),
                "most_torque": jnp.maximum(carry["most_torque"], torque),
            }, None  # fmt: skip

        none = jnp.zeros(len(chosen.rows.route))
        start = {"mean": none, "least": none + jnp.inf, "most": none, "torque": none, "most_torque": none - jnp.inf}
        return jax.lax.scan(step, start, bends)[0]

    def forces_of_draw(draw: Array, bends: Array) -> dict[str, Array]:
        z, mounting, errors_of_draw = jnp.split(draw, [model.space.size, model.space.size + 1])
        values = model.space.constrain(z)
        mounted = average_over_gait(values, bends, mounting[0], errors_of_draw)["mean"]
        return average_over_gait(values, bends, jnp.zeros(()), errors_of_draw) | {"mounted": mounted}

    with jax.enable_x64(True):
        arms = np.zeros(len(gait.angles)) if gait.arms is None else gait.arms
        bends, z = jnp.asarray(np.column_stack([gait.angles, arms])), fit.draws().flat_z
        errors = chosen.draw_errors(len(z))
        program = for_each_draw(forces_of_draw, model.space.size + 1 + errors.shape[1], bends, run_once=True)
        forces_by_draw: dict[str, np.ndarray] = program(np.column_stack([z, fit.mounting(), errors]))
    return forces_by_draw
