"""What the figure of a table of forces shows: readings at each bend beside the law that was fitted."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from bowdenfit.inference.interval import NORMAL_90
from bowdenfit.plots.curves import choose_evenly

if TYPE_CHECKING:
    from bowdenfit.kinds.forces.table import ForceTable
    from bowdenfit.results.record import Record

MOST_PLACES, MOST_READINGS = 6, 1000
POINTS = 61  # of a line
STROKES = (1, -1)
_BEND = 5.0  # deg within which wrap angles that were read are one bend
_LEAST_ANGLE = np.deg2rad(1.0)  # below which there is no apparent coefficient to speak of
_WIDE = 20.0  # ratio of the largest to the smallest load from which axes are logarithmic
_ONE_LOAD = 1.1  # ratio of the largest to the smallest load up to which they are one


@dataclass(frozen=True)
class ForcesHere:
    """Forces read at one bend, of one group.

    Args:
        label: Where, in words.
        input_force, output_force: Readings [N].
        stroke: +1 pulling, -1 return, 0 held.
        off: Output over that of the law, less 1 [%]; NaN of held readings.
        apparent: Apparent friction coefficient s log(F_in/F_out) / theta; NaN of held readings.
        load: Of the lines [N].
        law: Quantiles of the output force, pulling and returning: (quantile, stroke, load) [N].
        apparent_law: The same of the apparent coefficient.
        capstan: The apparent coefficient that describes its readings best, were it the same at all loads.
        shown: Whether it has a line and a color of its own.
        bend: Wrap angle of each reading [deg]; empty where it is of no interest.
    """

    label: str
    input_force: np.ndarray
    output_force: np.ndarray
    stroke: np.ndarray
    off: np.ndarray
    apparent: np.ndarray
    load: np.ndarray
    law: np.ndarray
    apparent_law: np.ndarray
    capstan: float
    shown: bool
    bend: np.ndarray = field(default_factory=lambda: np.zeros(0))


@dataclass(frozen=True)
class Forces:
    """A table of forces with its law.

    Args:
        places: Bends and groups, from the least bend on.
        spread_load: Loads at which it is known how readings scatter [N].
        spread: How far nine of ten single readings lie from the law, to either side [%]; empty without draws.
        model: The friction model.
        trusted: Whether the verdict is good.
        verdict: In words.
        logarithmic: Whether loads are so different that axes are logarithmic.
        count: How many readings there are, where not all are shown; else 0.
    """

    places: tuple[ForcesHere, ...]
    spread_load: np.ndarray
    spread: np.ndarray
    model: str
    trusted: bool
    verdict: str
    logarithmic: bool
    count: int = 0

    @property
    def by_bend(self) -> bool:
        """Whether all readings are about one load, so that the wrap angle is what tells them apart."""
        load = np.concatenate([here.input_force for here in self.places])
        bends = [float(here.bend.mean()) for here in self.places if len(here.bend)]
        one = bool(load.max() < _ONE_LOAD * load.min())
        return one and len(bends) == len(self.places) and np.ptp(bends) > _BEND


def forces_shown(fit: "Record") -> Forces | None:
    """Readings and law; None without a table of forces."""
    from bowdenfit.kinds.forces.table import ForceTable
    from bowdenfit.questions.summary.verdict import verdict

    table = fit.dataset.measurements.table(ForceTable)
    if table is None:
        return None
    rows = np.array(choose_evenly(range(len(table.run)), MOST_READINGS))
    place, first, labels, shown = _places(fit, table, rows)
    low, high = table.input_force[rows].min(), table.input_force[rows].max()
    logarithmic = bool(high > _WIDE * low)
    load = np.geomspace(0.9 * low, 1.1 * high, POINTS) if logarithmic else np.linspace(0.02 * high, 1.05 * high, POINTS)
    found = _of_draws(fit, table, rows, rows[first], load)
    places = [_here(table, rows, place == i, label, load, found, i, i in shown) for i, label in enumerate(labels)]
    judged = verdict(fit)
    spread = _spread(fit, load, found) if fit.sampled is not None else np.zeros(0)
    count = len(table.run) if len(rows) < len(table.run) else 0
    said = next(iter(judged.reasons), "")
    model = fit.dataset.description.friction_model
    return Forces(tuple(places), load, spread, model, judged.trusted, said, logarithmic, count)


def _places(fit: "Record", table: "ForceTable", rows: np.ndarray) -> tuple[np.ndarray, np.ndarray, list[str], set[int]]:
    """Place of each row, first row of each place, places in words, and which are shown in color."""
    route = fit.dataset.description.route
    angle = np.rad2deg(np.nansum(table.own.angle[rows], axis=1))
    bend = _BEND * np.round(angle / _BEND) if len(np.unique(angle.round(1))) > MOST_PLACES else angle.round(1)
    names = list(dict.fromkeys(table.group))
    group = np.array([names.index(table.group[row]) for row in rows]) if names else np.zeros(len(rows))
    keys = np.column_stack([np.nan_to_num(table.route[rows]), bend, group])
    distinct, first, place = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    place, labels = place.ravel(), []
    for i, (at, _, number) in enumerate(distinct):
        length = f"{at:.4g} {route.unit}" if route is not None else ""
        own = f"{np.mean(angle[place == i]):.3g} deg" if np.isfinite(table.own.angle).any() else ""
        labels.append(", ".join(part for part in (names[int(number)] if names else "", length, own) if part))
    return place, first, labels, set(choose_evenly(range(len(distinct)), MOST_PLACES))


def _of_draws(
    fit: "Record", table: "ForceTable", rows: np.ndarray, first: np.ndarray, load: np.ndarray
) -> dict[str, np.ndarray]:
    """Law at each place, expected output of each row, and wrap angles, of some draws or of least squares alone."""
    import jax.numpy as jnp

    from bowdenfit.cable.load_cells import LoadCells
    from bowdenfit.kinds.forces.mountings import group_numbers
    from bowdenfit.kinds.row_angles import resolve_angles, row_angles
    from bowdenfit.kinds.tables import AngleTable
    from bowdenfit.questions.bends.curves import evaluate_curves

    cable, friction = fit.model.cable, fit.model.cable.friction
    arrays = row_angles(cable.description, table, fit.dataset.measurements.table(AngleTable)).data
    arrays |= {"group": group_numbers(friction.groups, table.group, len(table.run))}
    least, velocity = friction.conditions.least_force, table.velocity

    def output(values: Mapping[str, Any], which: np.ndarray, force: Any, stroke: Any) -> tuple[Any, Any]:
        data = {name: jnp.asarray(array[which]) for name, array in arrays.items()}
        angles, _ = resolve_angles(cable, values, data)
        exponent = cable.friction_exponent(values, angles, data["group"]) * friction.rate(
            values, jnp.asarray(velocity[which])
        )
        cells, more = LoadCells.of(values), (...,) + (None,) * (jnp.ndim(force) - 1)
        read = friction.output_force(values, cells.true_input(force, least), exponent[more], stroke)
        return cells.shown_output(read, least), jnp.sum(angles, axis=-1)

    strokes = np.array(STROKES, dtype=float)[None, :, None]
    grid = np.broadcast_to(load, (len(first), len(STROKES), len(load)))

    def curves(values: Mapping[str, Any]) -> dict[str, Any]:
        law, angle = output(values, first, jnp.asarray(grid), jnp.asarray(strokes))
        at_rows, bend = output(values, rows, jnp.asarray(table.input_force[rows]), jnp.asarray(table.stroke[rows]))
        apparent = strokes * jnp.log(grid / law) / jnp.maximum(angle, _LEAST_ANGLE)[:, None, None]
        return {"law": law, "apparent": apparent, "rows": at_rows, "bend": bend}

    return evaluate_curves(fit, curves)


def _here(
    table: "ForceTable", rows: np.ndarray, mine: np.ndarray, label: str, load: np.ndarray, found: Mapping[str, np.ndarray],
    number: int, shown: bool,
) -> ForcesHere:  # fmt: skip
    """Readings at one place, and the law there."""
    from bowdenfit.questions.bends.curves import quantiles_of_draws

    force_in, force_out = table.input_force[rows[mine]], table.output_force[rows[mine]]
    stroke = table.stroke[rows[mine]]
    expected, bend = (np.median(found[name][:, mine], axis=0) for name in ("rows", "bend"))
    slides = stroke != 0
    off = np.where(slides, 100 * (force_out / expected - 1), np.nan)
    bent = np.where(slides & (bend > _LEAST_ANGLE), bend, np.nan)
    apparent = stroke * np.log(force_in / force_out) / bent
    weight = np.where(np.isfinite(apparent), 1 / (force_in**-2 + force_out**-2), 0.0)
    capstan = float(weight @ np.nan_to_num(apparent) / weight.sum()) if weight.sum() else float("nan")
    law, apparent_law = (quantiles_of_draws(found[name][:, number]) for name in ("law", "apparent"))
    lines = load, law, apparent_law, capstan, shown
    return ForcesHere(label, force_in, force_out, stroke, off, apparent, *lines, np.rad2deg(bend))


def _spread(fit: "Record", load: np.ndarray, found: Mapping[str, np.ndarray]) -> np.ndarray:
    """How far single readings scatter from the law, by their mountings and by the noise of the load cells."""
    from bowdenfit.cable.load_cells import FORCE_NOISE, RUN_SCATTER

    values = {name: float(np.median(draws)) for name, draws in fit.draws().values.items()}
    fixed = {p.name: float(p.fixed or 0.0) for p in fit.model.space.fixed}
    tau, noise = ((values | fixed)[name] for name in (RUN_SCATTER, FORCE_NOISE))
    ratio, output = fit.dataset.description.sensors.noise_ratio, np.median(found["law"][:, :, 0], axis=(0, 1))
    return np.asarray(100 * NORMAL_90 * np.sqrt(tau**2 + noise**2 * (ratio**2 / load**2 + 1 / output**2)))
