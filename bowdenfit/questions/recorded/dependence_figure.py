"""How efficiency depends on the load and on the speed, against the capstan equation, for which it does not."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bowdenfit.plots.captions import curve_words
from bowdenfit.plots.layout import TITLE, columns_within, drop_unused, legend_above, panels
from bowdenfit.plots.panels import short, span
from bowdenfit.plots.style import (
    BLACK,
    BLUE,
    EFFICIENCY,
    LEAST_SQUARES,
    MEDIAN,
    MEDIUM,
    SERIES_COLORS,
    SERIES_MARKERS,
    SMALL,
    VERMILLION,
    WIDE,
    WIDE_INTERVAL,
    in_paper_style,
)
from bowdenfit.words import counted

if TYPE_CHECKING:
    import jax

    from bowdenfit.plots.layout import Axes, Figure
    from bowdenfit.recordings.recording import Recording
    from bowdenfit.results.record import Record

HEADING = "Efficiency by load and speed"
GRID, BINS = 60, 12  # places of a curve, and points a run that are shown against the load
CURVES = 4000  # draws of a curve
MOST_COLUMNS, LEAST_WIDTH = 2, 2.2  # panels in a row, and width of one [in]
MOST_NAMES, LONGEST = 8, 34  # runs that have a mark each, and characters of their names
WIDE_RANGE = 30.0  # highest over lowest x, beyond which the axis is logarithmic
POINT_COLORS = (BLACK, *SERIES_COLORS[2:4], *SERIES_COLORS[5:8], BLACK, BLACK)  # not those of the curves

Points = tuple[np.ndarray, np.ndarray, list[str]]  # x, efficiencies, and the run of each


@dataclass(frozen=True)
class Dependence:
    """How efficiency depends on the load or the speed, where the fit allows it to.

    Args:
        what: "load" or "speed".
        label: Axis label with unit.
        x: Loads [N] or speeds (shown unit).
        quantiles: Efficiency there, 5 %, 50 % and 95 % quantiles (first axis); one row without draws.
        constant: Efficiency by the capstan equation alone at the reference, for comparison [1].
        points_x, points_efficiency: Measured, load by load or speed by speed.
        points_label: Run of each point.
        place: Where on the route, in words, such as "at 470 mm"; empty without a route.
        note: What else is to be said; empty if nothing is.
    """

    what: str
    label: str
    x: np.ndarray
    quantiles: np.ndarray
    constant: float
    points_x: np.ndarray
    points_efficiency: np.ndarray
    points_label: tuple[str, ...]
    place: str
    note: str = ""


def data(fit: Record) -> tuple[Dependence, ...] | None:
    """On load, and on speed, as far as the friction model lets efficiency depend on them; None where it does not at all."""
    from bowdenfit.questions.recorded.lost_force import lost_force
    from bowdenfit.questions.recorded.rate import SHOWN_SPEED, place_of
    from bowdenfit.recordings.recording import Recordings

    friction, recordings = fit.model.cable.friction, fit.dataset.measurements.table(Recordings)
    if recordings is None or not friction.options:
        return None
    (at, place), found = place_of(fit), []
    here = [r for r in recordings.each if not place or r.route == at]
    if friction.depends_on_load:
        points = [_by_load(r) for r in here if _pulling(r).any()]
        forces = np.concatenate([r.blocks.input_force[_pulling(r)] for r in here])
        low, high = (forces.min(), forces.max()) if len(forces) else (10.0, 100.0)
        grid = np.linspace(max(low, 1e-3), high, GRID)
        quantiles, constant = _curves(fit, at, grid, None)
        lost = lost_force(fit)
        note = lost.short() if lost is not None else ""
        found.append(Dependence("load", "Input force (N)", grid, quantiles, constant, *_joined(points), place, note))
    if friction.depends_on_rate:
        (unit, scale), (low, high) = SHOWN_SPEED[recordings.velocity_unit], friction.conditions.speeds
        grid = np.linspace(low * 0.5, high * 1.05, GRID)
        points = [_at_speed(r, scale) for r in here]
        quantiles, constant = _curves(fit, at, None, grid)
        found.append(Dependence("speed", f"Speed ({unit})", grid * scale, quantiles, constant, *_joined(points), place))
    return tuple(found) or None


def _pulling(recording: Recording) -> np.ndarray:
    """The blocks that are used and in which the motor pulls."""
    return recording.strokes.used_sliding & (recording.strokes.stroke > 0)


def _by_load(recording: Recording) -> Points:
    """Mean input force and mean efficiency of blocks of similar load."""
    used = _pulling(recording)
    force = recording.blocks.input_force[used]
    efficiency = recording.blocks.output_force[used] / force
    order = np.array_split(np.argsort(force), min(BINS, len(force)))
    means = [np.array([values[part].mean() for part in order]) for values in (force, efficiency)]
    return means[0], means[1], [recording.run] * len(order)


def _at_speed(recording: Recording, scale: float) -> Points:
    """Mean speed in the unit that is shown, and mean efficiency."""
    blocks = recording.blocks
    used = _pulling(recording) & np.isfinite(blocks.velocity)
    ratio = np.log(blocks.output_force[used] / blocks.input_force[used])
    speed = np.abs(blocks.velocity[used]).mean() * scale
    return np.array([speed]), np.exp([ratio.mean()]), [recording.run]


def _joined(points: list[Points]) -> tuple[np.ndarray, np.ndarray, tuple[str, ...]]:
    x, y, runs = zip((np.zeros(0), np.zeros(0), []), *points, strict=True)
    return np.concatenate(x), np.concatenate(y), tuple(run for each in runs for run in each)


def _curves(fit: Record, at: float, forces: np.ndarray | None, speeds: np.ndarray | None) -> tuple[np.ndarray, float]:
    """Quantiles of the efficiency while pulling against load or speed, and the efficiency at the reference."""
    import jax
    import jax.numpy as jnp

    from bowdenfit.questions.recorded.traces import QUANTILES, some_draws

    model, friction = fit.model, fit.model.cable.friction
    where = jnp.asarray([at])

    def efficiency(z: jax.Array) -> tuple[jax.Array, jax.Array]:
        values = model.space.constrain(z)
        exponent = model.cable.exponent_at(values, where)[0]
        reference = friction.efficiency(values, exponent)
        if forces is not None:
            x = jnp.asarray(forces)
            return friction.output_force(values, x, exponent, jnp.ones(())) / x, reference
        x = jnp.asarray(friction.conditions.reference_force)
        shift = exponent * friction.rate(values, jnp.asarray(speeds))
        return friction.output_force(values, x, shift, jnp.ones(())) / x, reference

    with jax.enable_x64(True):
        curves, reference = jax.jit(jax.vmap(efficiency))(jnp.asarray(some_draws(fit, CURVES)))
    constant = float(np.median(np.asarray(reference)))
    if fit.sampled is None:
        return np.asarray(curves)[:1], constant
    return np.quantile(np.asarray(curves), QUANTILES, axis=0), constant


def caption(dependences: tuple[Dependence, ...]) -> str:
    """What is drawn, in plain words."""
    words, n = " and ".join(one.what for one in dependences), max(len(set(one.points_label)) for one in dependences)
    return (
        f"Efficiency against {words}. {curve_words(len(dependences[0].quantiles) > 1)} Dashed: the capstan equation, by "
        f"which it is the same everywhere. Marks: measured. n = {counted(n, 'run')}."
    )


@in_paper_style
def draw(dependences: tuple[Dependence, ...], width: float | None = None) -> Figure:
    """Efficiency [%] against load and speed, a panel each on one efficiency axis."""
    columns = columns_within(width or WIDE, min(MOST_COLUMNS, len(dependences)), LEAST_WIDTH, 0.2)
    rows = -(-len(dependences) // columns)
    page = width or (WIDE if columns > 1 else MEDIUM)
    figure, flat = panels([2.1] * rows, columns, TITLE, (0.2, TITLE + 0.45), page, sharey=True)
    flat = drop_unused(flat, len(dependences))
    runs = list(dict.fromkeys(label for d in dependences for label in d.points_label))
    for i, (axes, one) in enumerate(zip(flat, dependences, strict=True)):
        _curve(axes, one)
        _points(axes, one, runs)
        axes.set_xlabel(one.label)
        if one.note:
            axes.text(0.97, 0.05, one.note, transform=axes.transAxes, ha="right", va="bottom", fontsize=SMALL)
        axes.set_title(" ".join(filter(None, (one.what.capitalize(), one.place))))
        if i % columns == 0:
            axes.set_ylabel(EFFICIENCY)
    low, high = span([v for d in dependences for v in (d.quantiles, d.points_efficiency, np.array(d.constant))])
    flat[0].set_ylim(100 * low, 100 * high)
    legend_above(figure, flat, columns=3 if columns > 1 else 2)
    return figure


def _curve(axes: Axes, one: Dependence) -> None:
    """Median with 90 % interval, or the least-squares line; and the constant efficiency for comparison."""
    quantiles, drawn = 100 * one.quantiles, len(one.quantiles) > 1
    middle = quantiles[len(quantiles) // 2]
    axes.plot(one.x, middle, color=BLUE, label=MEDIAN if drawn else LEAST_SQUARES)
    if drawn:
        low, high = quantiles[0], quantiles[-1]
        axes.fill_between(one.x, low, high, color=BLUE, alpha=0.18, linewidth=0, label=WIDE_INTERVAL)
    constant, words = 100 * one.constant, "Capstan equation alone"
    axes.axhline(constant, color=VERMILLION, linestyle="--", linewidth=1.1, label=words)
    everywhere = np.concatenate([one.x, one.points_x])
    everywhere = everywhere[np.isfinite(everywhere)]
    if everywhere.min() > 0 and everywhere.max() > WIDE_RANGE * everywhere.min():
        axes.set_xscale("log")
        axes.xaxis.set_major_formatter("{x:g}")


def _points(axes: Axes, one: Dependence, runs: list[str]) -> None:
    """What was measured, with a mark a run unless these are too many."""
    labels = np.array(one.points_label, dtype=str)
    if len(runs) > MOST_NAMES:
        _measured(axes, one, np.ones(len(labels), dtype=bool), 0, f"Measured in {len(runs)} runs")
        return
    for i, run in enumerate(runs):
        _measured(axes, one, labels == run, i, short(run, LONGEST))


def _measured(axes: Axes, one: Dependence, here: np.ndarray, number: int, label: str) -> None:
    if here.any():
        axes.plot(
            one.points_x[here], 100 * one.points_efficiency[here], SERIES_MARKERS[number], color=POINT_COLORS[number],
            markersize=3.6, markerfacecolor="white" if number > 5 else POINT_COLORS[number], zorder=3, label=label,
        )  # fmt: skip
