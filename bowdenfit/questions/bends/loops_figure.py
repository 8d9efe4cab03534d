"""Output against input force of a preloaded loop, moving forward and back, a panel for each wrap angle."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from bowdenfit.plots.bands import draw_quantiles, evenly, middle, name_band, say_of_how_many
from bowdenfit.plots.captions import curve_words, shown_words, strip_words
from bowdenfit.plots.layout import legend_above
from bowdenfit.plots.panels import enlarge_marks, label_outer, panels_with_limits, span
from bowdenfit.plots.style import BLACK, BLUE, GRAY, LEAST_SQUARES, MEDIAN, PURPLE, VERMILLION, in_paper_style
from bowdenfit.words import counted

if TYPE_CHECKING:
    from bowdenfit.plots.layout import Axes, Figure
    from bowdenfit.results.record import Record

HEADING = "Forces of the loop"
MOST, MOST_COLUMNS = 6, 3
WORD_ROOM = 0.075  # share of a panel's width that a word along the line takes
# stroke, name, marker, size [pt], color
STROKES = (
    (1, "Read moving forward", "o", 3.4, BLUE),
    (-1, "Read moving back", "s", 3.2, VERMILLION),
    (0, "Recorded", "o", 1.2, GRAY),
)


@dataclass(frozen=True)
class LoopCurve:
    """Output against input force of a loop at one wrap angle.

    Args:
        label: Wrap angle in words, such as "180 deg".
        input_force: Of the curves [N].
        forward, back: Quantiles of the output force while moving forward and back [N].
        capstan: Median output force of a rope without preload, moving forward [N].
        slack_load: Quantiles of the input force at which the return side goes slack [N].
        points_input, points_output: Readings [N].
        points_stroke: +1 forward, -1 back, 0 of a recording.
    """

    label: str
    input_force: np.ndarray
    forward: np.ndarray
    back: np.ndarray
    capstan: np.ndarray
    slack_load: np.ndarray
    points_input: np.ndarray
    points_output: np.ndarray
    points_stroke: np.ndarray


def data(fit: Record) -> tuple[LoopCurve, ...] | None:
    """A curve for each wrap angle that a loop with preload was moved at; None of anything else."""
    import jax.numpy as jnp

    from bowdenfit.physics.loop import loop_band, slack_load
    from bowdenfit.questions.bends.answer import elastic_answers, some_of
    from bowdenfit.questions.bends.curves import POINTS, Values, loop_bends, of_draws, quantiles

    bends = loop_bends(fit)
    if bends is None:
        return None
    elastic, (angle, force_in, force_out, stroke) = elastic_answers(fit), _points(fit, bends)
    angles = some_of(np.unique(np.round(angle, 9)) if len(angle) else bends, MOST)
    ends = np.append(force_in, 0.0) if len(angle) else np.array([0.0, 2 * elastic.reference_force])
    forces = np.linspace(1.05 * ends.min(), 1.05 * ends.max(), POINTS)
    bent = elastic.bent(angles)

    def curves(values: Values) -> dict[str, Any]:
        exponent, preload = bent.exponent(values), bent.preload(values)[0]
        force = jnp.broadcast_to(jnp.asarray(forces), (len(angles), POINTS))
        forward, back = loop_band(force, preload[:, None], exponent[:, None])
        capstan = loop_band(force, jnp.zeros_like(exponent)[:, None], exponent[:, None])[0]
        return {"forward": forward, "back": back, "capstan": capstan, "slack": slack_load(preload, exponent)}

    draws, found = of_draws(fit, curves), []
    for i, bend in enumerate(angles):
        forward, back, slack = (quantiles(draws[name][:, i]) for name in ("forward", "back", "slack"))
        here = np.isclose(angle, bend)
        points = force_in[here], force_out[here], stroke[here]
        capstan = np.median(draws["capstan"][:, i], axis=0)
        found.append(LoopCurve(f"{np.rad2deg(bend):.4g} deg", forces, forward, back, capstan, slack, *points))
    return tuple(found)


def _points(fit: Record, bends: np.ndarray) -> np.ndarray:
    """Wrap angle [rad], input force, output force [N] and stroke (0 of a recording) of every recorded block and reading."""
    from bowdenfit.kinds.loop.table import LoopTable
    from bowdenfit.questions.bends.answer import elastic_answers
    from bowdenfit.questions.recorded.loop_traces import loop_points

    contact, table = elastic_answers(fit).contact, fit.dataset.measurements.table(LoopTable)
    recorded = loop_points(fit, contact)
    parts = [np.concatenate([recorded, np.zeros((1, recorded.shape[1]))])]
    if table is not None:
        column = fit.dataset.description.contact[contact].wrap_angle.column
        angle = np.full(len(table.stroke), bends[0]) if column is None else np.nan_to_num(table.own.column(column)[0])
        parts.append(np.stack([angle, table.input_force, table.output_force, table.stroke]))
    return np.concatenate(parts, axis=1)


def caption(loops: tuple[LoopCurve, ...]) -> str:
    """What is drawn, in plain words."""
    n, shown = sum(len(loop.points_input) for loop in loops), min(len(loops), MOST)
    return (
        f"Output against input force of the loop, moving forward and back, at {shown_words(shown, len(loops), 'wrap angle')}. "
        f"{curve_words(len(loops[0].forward) > 1)} Dashed: a rope without preload. Purple: the input force beyond which the "
        f"return side is slack. {strip_words('in N')} n = {counted(n, 'reading')}."
    )


@in_paper_style
def draw(loops: tuple[LoopCurve, ...], width: float | None = None) -> Figure:
    """Output against input force [N], a panel for each of at most six wrap angles."""
    shown = evenly(loops, MOST)
    across = [span([loop.input_force, loop.points_input], room=0.03) for loop in shown]
    up = [span([loop.forward, loop.back, loop.points_output]) for loop in shown]
    figure, flat, columns = panels_with_limits([loop.label for loop in shown], across, up, MOST_COLUMNS, width=width)
    for axes, loop in zip(flat, shown, strict=True):
        axes.locator_params(nbins=6, steps=[1, 2, 2.5, 5, 10])
        _curves(axes, loop)
        _readings(axes, loop)
        _slack(axes, loop)
    label_outer(flat, columns, "Input force (N)", "Output force (N)")
    say_of_how_many(flat[-1], len(shown), len(loops), "wrap angles")
    legend_above(figure, flat, columns={1: 2, 2: 3}.get(columns, 4))
    enlarge_marks(figure)
    return figure


def _curves(axes: Axes, loop: LoopCurve) -> None:
    """Both ways, and the way forward of a rope without preload."""
    name = (MEDIAN if len(loop.forward) > 1 else LEAST_SQUARES).lower()
    draw_quantiles(axes, loop.input_force, loop.forward, BLUE, label=f"Forward, {name}")
    draw_quantiles(axes, loop.input_force, loop.back, VERMILLION, label=f"Back, {name}")
    name_band(axes, loop.forward)
    axes.plot(
        loop.input_force, loop.capstan, color=BLACK, linestyle=(0, (4, 1.6)), linewidth=1.0, zorder=2.5,
        label="Forward, no preload",
    )  # fmt: skip


def _readings(axes: Axes, loop: LoopCurve) -> None:
    """Forces by stroke; those of recordings are many and small."""
    for stroke, name, marker, size, color in STROKES:
        here = loop.points_stroke == stroke
        if here.any():
            edge = {"markeredgewidth": 0.0} if stroke == 0 else {"markeredgewidth": 0.5, "markeredgecolor": "white"}
            axes.plot(
                loop.points_input[here], loop.points_output[here], marker, color=color, markersize=size, **edge,
                zorder=2.2 if stroke == 0 else 3, label=name, rasterized=stroke == 0,
            )  # fmt: skip


def _slack(axes: Axes, loop: LoopCurve) -> None:
    """The input force at which the return side goes slack, where it is shown, and what the rope is on either side."""
    low, high = axes.get_xlim()
    load = float(middle(loop.slack_load))
    if not low < load < high:
        return
    if len(loop.slack_load) > 1:
        axes.axvspan(
            max(loop.slack_load[0], low), min(loop.slack_load[-1], high), facecolor=PURPLE, alpha=0.25, linewidth=0,
            zorder=0.5,
        )  # fmt: skip
    axes.axvline(load, color=PURPLE, linewidth=1.0, zorder=1.5, label="Return side goes slack")
    axes.set_xlim(low, high)
    _branches(axes, loop, (load - low) / (high - low))


def _branches(axes: Axes, loop: LoopCurve, place: float) -> None:
    """Both branches named along the line, at the end of it that is farther from the loop."""
    bottom, top = axes.get_ylim()
    height = float(np.interp(middle(loop.slack_load), loop.input_force, middle(loop.forward + loop.back) / 2))
    y, side = (0.02, "bottom") if height > (bottom + top) / 2 else (0.98, "top")
    for words, align, room, shift in (
        ("return side taut", "right", place, -0.015),
        ("slack", "left", 1 - place, 0.015),
    ):
        if room > WORD_ROOM:
            axes.text(
                place + shift, y, words, transform=axes.transAxes, rotation=90, ha=align, va=side, fontsize=6,
                color="#8A3A68", zorder=4,
            )  # fmt: skip
