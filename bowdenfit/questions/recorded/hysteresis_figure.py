"""Output against input force: the loop that friction opens, between the two lines of the capstan equation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bowdenfit.plots.captions import count_shown
from bowdenfit.plots.curves import choose_evenly, note_shown_count
from bowdenfit.plots.layout import legend_above
from bowdenfit.plots.panels import MOST, enlarge_marks, label_outer, recording_panels, set_limits, share_limits, span
from bowdenfit.plots.style import (
    BLACK,
    BLUE,
    GRAY,
    LEAST_SQUARES,
    MEDIAN,
    VERMILLION,
    WIDE_INTERVAL,
    in_paper_style,
    rounded_texts,
)
from bowdenfit.questions import recorded as room

if TYPE_CHECKING:
    from bowdenfit.plots.layout import Axes, Figure
    from bowdenfit.results.record import Record

HEADING = "Hysteresis loops of the recordings"
MOST_COLUMNS = 4  # panels in a row
WITHOUT_INTERVAL = 0.05  # uncertainty that sets the digits of an exponent without interval
# stroke, name, marker, size [pt] and color
STROKES = (
    (1, "Pulling", "o", 2.6, BLUE),
    (-1, "Returning", "s", 2.4, VERMILLION),
    (0, "Switching or held", "D", 1.4, GRAY),
)


@dataclass(frozen=True)
class LoopPanel:
    """The forces of one recording of a single rope, and its friction.

    Args:
        name: Name of the recording.
        input_force, output_force: Mean forces of each block [N].
        stroke: +1 pulling, -1 returning, 0 switching or held.
        exponent: Friction exponent of the cable here, 5 %, 50 % and 95 % quantiles; one number without draws.
        own_exponent: Friction exponent of this recording by itself [1].
    """

    name: str
    input_force: np.ndarray
    output_force: np.ndarray
    stroke: np.ndarray
    exponent: np.ndarray
    own_exponent: float


def data(fit: Record) -> tuple[LoopPanel, ...] | None:
    """Return every recording of a single rope; None without any: those of a loop are in the figure of loops."""
    panels = []
    for trace in room.trace_recordings(fit):
        forces, strokes = (trace.input_force, trace.output_force), trace.recording.strokes
        if not trace.is_loop and np.any(np.isfinite(sum(forces))):
            panels.append(LoopPanel(trace.recording.name, *forces, trace.stroke, trace.exponent, strokes.exponent))
    return tuple(panels) or None


def caption(recordings: tuple[LoopPanel, ...]) -> str:
    """Describe what is drawn, in plain words."""
    shown = min(len(recordings), MOST)
    return (
        f"The loop that friction opens, {count_shown(shown, len(recordings), 'recording')}: output against input force, "
        "dot by dot, between the two lines of the capstan equation. The words in each panel give the friction exponent "
        "of this recording by itself and the one expected of the cable, with its 90 % interval. "
        f"n = {sum(int(np.isfinite(r.input_force).sum()) for r in recordings)} blocks of samples."
    )


@in_paper_style
def draw(recordings: tuple[LoopPanel, ...], width: float | None = None) -> Figure:
    """Draw output against input force [N] on equal axes, a panel a recording."""
    shown = choose_evenly(recordings, MOST)
    limits = [span([r.input_force, r.output_force]) for r in shown]
    shared = share_limits(limits)
    figure, flat, columns = recording_panels([r.name for r in shown], MOST_COLUMNS, None, shared, shared, width=width)
    set_limits(flat, limits, "x", shared)
    set_limits(flat, limits, "y", shared)
    for axes, recording in zip(flat, shown, strict=True):
        axes.locator_params(nbins=5, steps=[1, 2, 5, 10])
        _draw_blocks(axes, recording)
        _draw_capstan_lines(axes, recording)
        axes.text(
            0.98, 0.02, _describe_exponent(recording), transform=axes.transAxes, ha="right", va="bottom", fontsize=6,
            linespacing=1.1, zorder=5,
        )  # fmt: skip
    label_outer(flat, columns, "Input force (N)", "Output force (N)")
    note_shown_count(flat[0], len(shown), len(recordings), "recordings")
    legend_above(figure, flat, columns=4 if columns > 1 else 2)
    enlarge_marks(figure)
    return figure


def _draw_blocks(axes: Axes, recording: LoopPanel) -> None:
    """Draw the blocks by stroke."""
    for stroke, name, marker, size, color in STROKES:
        mask = recording.stroke == stroke
        if mask.any():
            axes.plot(
                recording.input_force[mask], recording.output_force[mask], marker, color=color, markersize=size,
                markeredgewidth=0, label=name, rasterized=True,
            )  # fmt: skip


def _draw_capstan_lines(axes: Axes, recording: LoopPanel) -> None:
    """Draw F_out = F_in exp(-Lambda) when pulling, F_in exp(Lambda) when returning, and the diagonal between."""
    force = np.array(axes.get_xlim())
    low, middle, high = _exponent_interval(recording)
    has_draws = len(recording.exponent) > 1
    for sign in (-1.0, 1.0):
        if has_draws:
            axes.fill_between(
                force, force * np.exp(sign * low), force * np.exp(sign * high), color=BLACK, alpha=0.18, linewidth=0,
                label=f"Capstan equation, {WIDE_INTERVAL}",
            )  # fmt: skip
        label = f"Capstan equation, {(MEDIAN if has_draws else LEAST_SQUARES).lower()}"
        axes.plot(force, force * np.exp(sign * middle), color=BLACK, linewidth=0.6, label=label)
    axes.plot(force, force, color=GRAY, linewidth=0.6, linestyle=(0, (4, 2)), label="No friction")


def _describe_exponent(recording: LoopPanel) -> str:
    """Describe the exponent of this recording by itself and that of the cable, in short lines that fit below the loop."""
    low, middle, high = _exponent_interval(recording)
    own, width = recording.own_exponent, high - low
    low_text, middle_text, high_text, own_text = rounded_texts((low, middle, high, own), width or WITHOUT_INTERVAL)
    lines = [f"exponent {own_text}"] if np.isfinite(own) else []
    lines += [f"expected {middle_text}"] + ([f"({low_text} to {high_text})"] if width else [])
    return "\n".join(lines)


def _exponent_interval(recording: LoopPanel) -> tuple[float, float, float]:
    """Return ends and middle of the interval of the cable's exponent, all the same without draws."""
    exponent = recording.exponent.tolist()
    return exponent[0], exponent[len(exponent) // 2], exponent[-1]
