"""Output against input force of a preloaded loop, moving forward and back, a panel for each wrap angle."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from bowdenfit.plots.captions import count_shown, describe_curve, describe_left_out, describe_strip
from bowdenfit.plots.curves import choose_evenly, draw_quantiles, middle, name_band, note_shown_count
from bowdenfit.plots.layout import legend_above, panel_size
from bowdenfit.plots.panels import draw_left_out, enlarge_marks, span
from bowdenfit.plots.strips import panels_with_strips
from bowdenfit.plots.style import BLACK, BLUE, GRAY, LEAST_SQUARES, MEDIAN, PURPLE, VERMILLION, in_paper_style
from bowdenfit.questions import bends as room
from bowdenfit.words import counted

if TYPE_CHECKING:
    from bowdenfit.plots.layout import Axes, Figure
    from bowdenfit.results.record import Record

HEADING = "Forces of the loop"
MOST, MOST_COLUMNS = 6, 3  # wrap angles that are shown, and panels in a row
LEAST_NAMED = 1.5  # in, width of a panel with names of the branches
WORD_ROOM = 0.075  # share of a panel's width that a word along the line takes
RECORDED = 2  # times the stroke of a block of a recording, which are many
# stroke, name, marker, size [pt], color
STROKES = (
    (1, "Read moving forward", "o", 3.4, BLUE),
    (-1, "Read moving back", "s", 3.2, VERMILLION),
    (RECORDED, "Recorded moving forward", "o", 1.2, BLUE),
    (-RECORDED, "Recorded moving back", "s", 1.2, VERMILLION),
    (0, "Recorded", "o", 1.2, GRAY),
)


@dataclass(frozen=True)
class LoopCurve:
    """Output against input force of a loop at one wrap angle.

    Args:
        label: Wrap angle in words, such as "180 deg".
        input_force: Input force of the curves [N].
        forward, back: Quantiles of the output force while moving forward and back [N].
        capstan: Median output force of a rope without preload, moving forward [N].
        slack_load: Quantiles of the input force at which the return side goes slack [N].
        points_input, points_output: Readings [N].
        points_stroke: +1 forward, -1 back; twice that of a recording, and 0 where it is neither.
        left_out: Input and output force of the readings that the user leaves out [N].
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
    left_out: np.ndarray = field(default_factory=lambda: np.zeros((2, 0)))


def data(fit: Record) -> tuple[LoopCurve, ...] | None:
    """Return a curve for each wrap angle that forces of a loop with preload were read at; None of anything else."""
    return room.collect_loops(fit)


def caption(loops: tuple[LoopCurve, ...]) -> str:
    """Describe what is drawn, in plain words."""
    n, shown = sum(len(loop.points_input) for loop in loops), min(len(loops), MOST)
    return (
        f"Output against input force of the loop, moving forward and back, at {count_shown(shown, len(loops), 'wrap angle')}. "
        f"{describe_curve(len(loops[0].forward) > 1)} Dashed: a rope without preload. Purple: the input force beyond which the "
        f"return side is slack. {describe_strip('in N')} n = {counted(n, 'reading')}. "
        f"{describe_left_out(np.concatenate([loop.left_out for loop in loops], axis=1))}"
    ).rstrip()


@in_paper_style
def draw(loops: tuple[LoopCurve, ...], width: float | None = None) -> Figure:
    """Draw output against input force [N], a panel for each of at most six wrap angles."""
    shown = choose_evenly(loops, MOST)
    across = [span([loop.input_force, loop.points_input], room=0.03) for loop in shown]
    up = [span([loop.forward, loop.back, loop.points_output]) for loop in shown]
    made = panels_with_strips([loop.label for loop in shown], across, up, MOST_COLUMNS, width=width)
    for axes, strip, loop in zip(made.mains, made.strips, shown, strict=True):
        axes.locator_params(nbins=6, steps=[1, 2, 2.5, 5, 10])
        _draw_curves(axes, loop)
        _draw_readings(axes, loop)
        _draw_slack(axes, loop)
        _draw_residuals(strip, loop)
        draw_left_out(axes, loop.left_out)
    made.finish_strips()
    made.label("Input force (N)", "Output force (N)", "N")
    note_shown_count(made.mains[-1], len(shown), len(loops), "wrap angles")
    legend_above(made.figure, made.mains, columns={1: 2, 2: 3}.get(made.columns, 4))
    enlarge_marks(made.figure)
    return made.figure


def _draw_curves(axes: Axes, loop: LoopCurve) -> None:
    """Draw both ways, and the way forward of a rope without preload."""
    name = (MEDIAN if len(loop.forward) > 1 else LEAST_SQUARES).lower()
    still = not np.any(loop.points_stroke)
    for way, line, color, words in ((1, loop.forward, BLUE, "Forward"), (-1, loop.back, VERMILLION, "Back")):
        if still or np.any(np.sign(loop.points_stroke) == way):
            draw_quantiles(axes, loop.input_force, line, color, label=f"{words}, {name}")
    name_band(axes, loop.forward)
    axes.plot(
        loop.input_force, loop.capstan, color=BLACK, linestyle=(0, (4, 1.6)), linewidth=1.0, zorder=2.5,
        label="Forward, no preload",
    )  # fmt: skip


def _draw_readings(axes: Axes, loop: LoopCurve) -> None:
    """Draw forces by stroke; those of recordings are many and small."""
    for stroke, name, marker, size, color in STROKES:
        mask = loop.points_stroke == stroke
        if mask.any():
            many = abs(stroke) != 1
            edge = {"markeredgewidth": 0.0} if many else {"markeredgewidth": 0.5, "markeredgecolor": "white"}
            axes.plot(
                loop.points_input[mask], loop.points_output[mask], marker, color=color, markersize=size, **edge,
                zorder=2.2 if many else 3, label=name, rasterized=many,
            )  # fmt: skip


def _draw_residuals(strip: Axes, loop: LoopCurve) -> None:
    """Draw the output less that of the branch on which it was read; less the nearer branch where that is not known."""
    for stroke, _, marker, size, color in STROKES:
        mask = loop.points_stroke == stroke
        if mask.any():
            x, output = loop.points_input[mask], loop.points_output[mask]
            forward, back = (np.interp(x, loop.input_force, middle(line)) for line in (loop.forward, loop.back))
            between = np.clip(output, np.minimum(forward, back), np.maximum(forward, back))
            off = output - (forward if stroke > 0 else back if stroke < 0 else between)
            strip.plot(
                x, off, marker, color=color, markersize=0.8 * size, markeredgewidth=0,
                rasterized=abs(stroke) != 1,
            )  # fmt: skip


def _draw_slack(axes: Axes, loop: LoopCurve) -> None:
    """Draw the input force at which the return side goes slack, where it is shown, and what the rope is on either side."""
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
    _name_branches(axes, loop, (load - low) / (high - low))


def _name_branches(axes: Axes, loop: LoopCurve, place: float) -> None:
    """Name both branches along the line, at its end that is farther from the loop; not in a small panel."""
    if panel_size(axes)[0] < LEAST_NAMED:
        return
    bottom, top = axes.get_ylim()
    height = float(np.interp(middle(loop.slack_load), loop.input_force, middle(loop.forward + loop.back) / 2))
    y, side = (0.02, "bottom") if height > (bottom + top) / 2 else (0.98, "top")
    for words, align, width, shift in (
        ("return side taut", "right", place, -0.015),
        ("slack", "left", 1 - place, 0.015),
    ):
        if width > WORD_ROOM:
            axes.text(
                place + shift, y, words, transform=axes.transAxes, rotation=90, ha=align, va=side, fontsize=6,
                color="#8A3A68", zorder=4,
            )  # fmt: skip
