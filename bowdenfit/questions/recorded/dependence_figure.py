"""How efficiency depends on the load and on the speed, against the capstan equation, for which it does not."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bowdenfit.plots.layout import TITLE, legend_above, panels
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
    VERMILLION,
    WIDE,
    WIDE_INTERVAL,
    in_paper_style,
)

if TYPE_CHECKING:
    import jax

    from bowdenfit.plots.layout import Axes, Figure
    from bowdenfit.recordings.recording import Recording, Recordings
    from bowdenfit.results.record import Record

GRID, BINS = 60, 12  # places of a curve, and points a run that are shown against the load
CURVES = 4000  # draws of a curve
MOST_COLUMNS = 2
MOST_NAMES, LONGEST = 8, 34  # runs that have a mark each, and characters of their names
WIDE_RANGE = 30.0  # highest over lowest x, beyond which the axis is logarithmic
POINT_COLORS = (BLACK, *SERIES_COLORS[2:4], *SERIES_COLORS[5:8], BLACK, BLACK)  # not those of the curves


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


def data(fit: Record) -> tuple[Dependence, ...] | None:
    """On load, and on speed, as far as the friction model lets efficiency depend on them; None where it does not at all."""
    from bowdenfit.recordings.recording import Recordings

    friction, recordings = fit.model.cable.friction, fit.dataset.measurements.table(Recordings)
    if recordings is None:
        return None
    wanted = ((friction.depends_on_load, _on_load), (friction.depends_on_rate, _on_speed))
    return tuple(on(fit, recordings) for depends, on in wanted if depends) or None


def _place(fit: Record, recordings: Recordings) -> tuple[float, list[Recording], str]:
    """The route value with most recordings, those recordings, and the place in words."""
    from bowdenfit.questions.recorded.rate import place_of

    at, place = place_of(fit)
    return at, [r for r in recordings.each if not place or r.route == at], place


def _on_load(fit: Record, recordings: Recordings) -> Dependence:
    from bowdenfit.recordings.recording import PULL

    at, here, place = _place(fit, recordings)
    used = [(r, r.strokes.used_sliding & (r.strokes.stroke == PULL)) for r in here]
    forces = np.concatenate([r.blocks.input_force[u] for r, u in used] or [np.array([10.0, 100.0])])
    grid = np.linspace(max(forces.min(), 1e-3), forces.max(), GRID)
    points = [_binned(r, u) for r, u in used if u.any()]
    quantiles, constant = _curves(fit, at, grid, None)
    x, y, label = _joined(points, [r.run for r, u in used if u.any()])
    return Dependence("load", "Input force (N)", grid, quantiles, constant, x, y, label, place)


def _on_speed(fit: Record, recordings: Recordings) -> Dependence:
    from bowdenfit.questions.recorded.rate import SHOWN_SPEED
    from bowdenfit.recordings.recording import PULL

    at, here, place = _place(fit, recordings)
    unit, scale = SHOWN_SPEED[recordings.velocity_unit]
    low, high = fit.model.cable.friction.conditions.speeds
    grid = np.linspace(low * 0.5, high * 1.05, GRID)
    points = []
    for r in here:
        used = r.strokes.used_sliding & (r.strokes.stroke == PULL) & np.isfinite(r.blocks.velocity)
        ratio = np.log(r.blocks.output_force[used] / r.blocks.input_force[used])
        points.append((np.array([np.abs(r.blocks.velocity[used]).mean() * scale]), np.exp([ratio.mean()])))
    quantiles, constant = _curves(fit, at, None, grid)
    x, y, label = _joined(points, [r.run for r in here])
    return Dependence("speed", f"Speed ({unit})", grid * scale, quantiles, constant, x, y, label, place)


def _joined(
    points: list[tuple[np.ndarray, np.ndarray]], runs: list[str]
) -> tuple[np.ndarray, np.ndarray, tuple[str, ...]]:
    labels = tuple(run for (x, _), run in zip(points, runs, strict=True) for _ in x)
    nothing = [np.zeros(0)]
    return np.concatenate([x for x, _ in points] or nothing), np.concatenate([y for _, y in points] or nothing), labels


def _binned(recording: Recording, used: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Mean input force and mean efficiency of blocks of similar load."""
    force = recording.blocks.input_force[used]
    efficiency = recording.blocks.output_force[used] / force
    order = np.array_split(np.argsort(force), min(BINS, len(force)))
    return np.array([force[part].mean() for part in order]), np.array([efficiency[part].mean() for part in order])


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
    if fit.posterior is None:
        return np.asarray(curves)[:1], constant
    return np.quantile(np.asarray(curves), QUANTILES, axis=0), constant


@in_paper_style
def draw(dependences: tuple[Dependence, ...]) -> Figure:
    """Efficiency [%] against load and speed, a panel each on one efficiency axis."""
    columns = min(MOST_COLUMNS, len(dependences))
    rows = -(-len(dependences) // columns)
    page = WIDE if columns > 1 else MEDIUM
    figure, flat = panels([2.1] * rows, columns, TITLE, (0.2, TITLE + 0.45), page, sharey=True)
    for axes in flat[len(dependences) :]:
        axes.remove()
    flat = flat[: len(dependences)]
    runs = list(dict.fromkeys(label for d in dependences for label in d.points_label))
    for i, (axes, one) in enumerate(zip(flat, dependences, strict=True)):
        _curve(axes, one)
        _points(axes, one, runs)
        axes.set_xlabel(one.label)
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
