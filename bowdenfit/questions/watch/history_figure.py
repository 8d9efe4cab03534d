"""How an answer became known: its interval against the number of mountings."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bowdenfit.pages.section import Chart, Series, SeriesGroup
from bowdenfit.plots.layout import TITLE, legend_above, panels
from bowdenfit.plots.panels import show_plain_numbers
from bowdenfit.plots.style import BLACK, MEDIAN, SERIES_COLORS, WIDE_INTERVAL, axis_label, in_paper_style
from bowdenfit.words import begin_sentence, counted

if TYPE_CHECKING:
    from bowdenfit.plots.layout import Figure
    from bowdenfit.questions.watch.answer import History

HEADING = "How the answer narrowed"
WIDTH = 5.6  # in
_WHOLE_STEPS = 15  # mountings up to which each has its own mark on the axis


def caption(history: History) -> str:
    """Say what is drawn, in plain words."""
    return f"{_describe_marks(history)} Ring: from here on enough is known. {_count_fits(history)}"


def describe_history_charts(history: History) -> str:
    """Describe the chart, in which nothing has a ring."""
    return f"{_describe_marks(history)} {_count_fits(history)}"


def _describe_marks(history: History) -> str:
    """Return the sentences that explain lines and points."""
    last = history.answers[-1]
    noun = "mounting" if last.mountings else "reading"
    return (
        f"The answer ({last.words}) after each {noun}: median and 90 % interval of all that was measured by then. Filled: a "
        "fit that may be trusted; open: one that must not be, or was not checked since more was measured."
    )


def _count_fits(history: History) -> str:
    return f"n = {counted(len(history.answers), 'fit')}."


@in_paper_style
def draw(history: History) -> Figure:
    """Draw the median with its interval against the number of mountings."""
    answers = history.answers
    by_mounting = answers[-1].mountings > 0
    count = np.array([one.mountings if by_mounting else one.readings for one in answers])
    median, low, high = (np.array([getattr(one.interval, name) for one in answers]) for name in ("median", "q05", "q95"))
    trusted = np.array([one.trusted is True for one in answers])
    figure, (axes,) = panels([2.4], 1, TITLE, (0, 0), WIDTH)
    axes.errorbar(
        count, median, (median - low, high - median), linestyle="none", color=SERIES_COLORS[0], capsize=2, linewidth=1.1,
        label="90 % interval",
    )  # fmt: skip
    marks = (("Trusted", trusted, SERIES_COLORS[0]), ("Not trusted, or not checked", ~trusted, "white"))
    for label, which, face in marks:
        if which.any():
            axes.plot(
                count[which], median[which], "o", markersize=4.5, color=SERIES_COLORS[0], markerfacecolor=face, label=label
            )
    if answers[-1].may_stop:
        first = next(i for i in range(len(answers)) if all(one.may_stop for one in answers[i:]))
        axes.plot(
            count[first], median[first], "o", markersize=11, color=BLACK, markerfacecolor="none", label="Enough is known"
        )
    axes.set_xlabel("Mountings" if by_mounting else "Readings")
    words = answers[-1].words.removeprefix("the ")
    axes.set_ylabel(axis_label(begin_sentence(words), _unit(answers[-1].unit)))
    axes.set_xlim(count.min() - 0.7, count.max() + 0.7)
    if np.ptp(count) <= _WHOLE_STEPS:
        axes.set_xticks(np.arange(count.min(), count.max() + 1))
    show_plain_numbers(axes, "y")
    legend_above(figure, [axes], columns=4)
    return figure


def make_history_charts(history: History) -> tuple[Chart, ...]:
    """Return the chart of the median with its interval against the number of mountings, or of readings; none of nothing.

    Args:
        history: With an answer for each number of mountings.
    """
    if not history.answers:
        return ()
    last = history.answers[-1]
    count = np.array([one.mountings if last.mountings else one.readings for one in history.answers], dtype=float)
    intervals = [one.interval for one in history.answers]
    median, low, high = (np.array([getattr(interval, name) for interval in intervals]) for name in ("median", "q05", "q95"))
    trusted = np.array([one.trusted is True for one in history.answers])
    series = (
        Series(WIDE_INTERVAL, "low", "blue", low),
        Series(WIDE_INTERVAL, "high", "blue", high),
        Series(MEDIAN, "line", "blue", median),
        Series("Trusted", "points", "blue", np.where(trusted, median, np.nan)),
        Series("Not trusted, or not checked", "hollow", "blue", np.where(trusted, np.nan, median)),
    )
    unit = f" ({_unit(last.unit)})" if last.unit else ""
    noun = "Mountings" if last.mountings else "Readings"
    return (Chart("History", noun, f"{begin_sentence(last.words)}{unit}", (SeriesGroup(count, series),)),)


def _unit(unit: str) -> str:
    return "%" if unit == "points" else unit
