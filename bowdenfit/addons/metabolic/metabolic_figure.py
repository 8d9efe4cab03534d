"""Figure of a study of metabolic cost: mean of each condition and difference of each pair, as the on-body paper's figure 18."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bowdenfit.plots.layout import TITLE, legend_above, panel_size, panels, wrap_words
from bowdenfit.plots.style import BLUE, GRAY, LEAST, VERMILLION, in_paper_style
from bowdenfit.words import counted

if TYPE_CHECKING:
    from bowdenfit.addons.metabolic.answer import Metabolic
    from bowdenfit.plots.layout import Axes, Figure

HEADING = "Net metabolic cost of walking"
_HEIGHT, _ROW = 2.2, 0.36  # in, of the panels, and at least of each pair
_GAP = 1.45  # in, for the names of pairs
_PAIR_ROOM = 1.2  # in, for the name of a pair
_STEP = 0.14  # of the highest bar, from one bracket to the next
_MOST = 4  # conditions that are called by name and have brackets; more are numbered


def caption(answer: Metabolic) -> str:
    """Say what is drawn, in plain words."""
    persons = max(comparison.persons for comparison in answer.comparisons)
    numbered = "; ".join(f"{number} {cost.name}" for number, cost in enumerate(answer.costs, start=1))
    conditions = f"Conditions: {numbered}. " if len(answer.costs) > _MOST else ""
    return (
        "Left: mean net cost of each condition; whiskers: standard error of the mean, where it is known; brackets, of up to "
        "four conditions: p of the paired difference, adjusted for all pairs, with a star where it is significant. "
        f"Right: paired difference with its 95 % interval, before that adjustment. {conditions}"
        f"n = {counted(persons, 'person')} and {counted(len(answer.costs), 'condition')}."
    )


@in_paper_style
def draw(answer: Metabolic) -> Figure:
    """Draw costs of conditions with brackets over pairs, and paired differences."""
    row = _ROW if len(answer.costs) <= _MOST else _ROW / 2
    figure, (costs, differences) = panels([max(_HEIGHT, row * len(answer.comparisons))], 2, TITLE, (_GAP, 0))
    _draw_costs(costs, answer)
    _draw_differences(differences, answer)
    legend_above(figure, [costs, differences], columns=3)
    return figure


def _draw_costs(axes: Axes, answer: Metabolic) -> None:
    names = [cost.name for cost in answer.costs]
    means = [cost.mean for cost in answer.costs]
    errors = [cost.error or 0.0 for cost in answer.costs]
    axes.bar(range(len(names)), means, width=0.6, color=BLUE, alpha=0.45, label="Mean")
    if any(errors):
        axes.errorbar(
            range(len(names)), means, yerr=errors, fmt="none", ecolor=GRAY, capsize=3, label="Standard error of the mean"
        )
    top = max(mean + error for mean, error in zip(means, errors, strict=True))
    brackets = _draw_brackets(axes, answer, names, top)
    axes.set_ylim(min(0.0, *means) * 1.1, top * (1 + _STEP * (brackets + 0.5)))
    room, shown = 0.9 * panel_size(axes)[0] / len(names), _shown_names(answer)
    axes.set_xticks(range(len(names)), [wrap_words(shown[name], room) for name in names])
    axes.set(ylabel="Net cost (W/kg)")
    axes.grid(visible=False)
    axes.set_title("Cost of each condition", loc="left")


def _shown_names(answer: Metabolic) -> dict[str, str]:
    """Return what each condition is called in the figure: its number where there are many."""
    many = len(answer.costs) > _MOST
    return {cost.name: str(number) if many else cost.name for number, cost in enumerate(answer.costs, start=1)}


def _draw_brackets(axes: Axes, answer: Metabolic, names: list[str], top: float) -> int:
    """Draw a bracket over each pair, the near ones lowest, and return how many."""
    if len(names) > _MOST:
        return 0
    ends = [(sorted((names.index(pair.condition), names.index(pair.less))), pair) for pair in answer.comparisons]
    ends.sort(key=lambda entry: (entry[0][1] - entry[0][0], entry[0]))
    for level, ((left, right), pair) in enumerate(ends):
        height, tick = top * (1 + _STEP * (level + 0.5)), top * _STEP / 5
        axes.plot([left, left, right, right], [height - tick, height, height, height - tick], color=GRAY, linewidth=0.8)
        star = " *" if pair.is_significant else ""
        words = f"p = {pair.p_holm:.2g}{star}"
        axes.text((left + right) / 2, height + tick / 2, words, ha="center", va="bottom", fontsize=LEAST)
    return len(ends)


def _draw_differences(axes: Axes, answer: Metabolic) -> None:
    rows, shown = answer.comparisons[::-1], _shown_names(answer)
    for row, pair in enumerate(rows):
        half = [[pair.difference - pair.low], [pair.high - pair.difference]]
        axes.errorbar(
            [pair.difference], [row], xerr=half, fmt="o", color=VERMILLION, capsize=3,
            label="Paired difference, 95 % interval" if row == 0 else None,
        )  # fmt: skip
    axes.axvline(0, color=GRAY, linewidth=0.8)
    labels = [wrap_words(f"{shown[pair.condition]} minus {shown[pair.less]}", _PAIR_ROOM) for pair in rows]
    axes.set_yticks(range(len(rows)), labels)
    axes.set_ylim(-0.6, len(rows) - 0.4)
    axes.set(xlabel="Difference (W/kg)")
    axes.grid(axis="y", visible=False)
    axes.set_title("Difference of each pair", loc="left")
