"""What `bowdenfit compare` prints."""

from collections import Counter
from collections.abc import Sequence

import numpy as np

from bowdenfit.display import text_of
from bowdenfit.inference.comparison import FEW_READINGS
from bowdenfit.inference.interval import Interval
from bowdenfit.questions.compare.answer import Comparison
from bowdenfit.questions.summary.verdict import NOT_CONVERGED
from bowdenfit.words import counted, filled, give_or_take, legend, listed, narrow_table

_DOMINATES = 0.5  # share of a difference from which one reading is named
_FEW = 20  # readings treated one by one that are named
_LONGEST_HEAD = 30  # characters of the name of a fit over a column
Cells = tuple[tuple[str, ...], list[tuple[str, ...]]]  # heads and rows
HOW_WELL, WHAT_CHANGES = "How well each predicts a reading left out", "What changes, mean ± sd"
_SHORT = {"importance sampling": "-", "moment matching": "moved", "refit": "fitted again", "rough": "rough"}


@text_of.register(Comparison)
def comparison_text(found: Comparison) -> str:
    """A comparison for people: which fit predicts best, what changes between them, and what speed does."""
    blocks = [
        "\n".join(filled(line) for line in verdict_sentences(found)),
        f"{HOW_WELL}\n" + narrow_table(*scores(found), left=("model",)),
        "\n".join(filled(line) for line in basis_sentences(found)),
        treated_text(found),
        f"{WHAT_CHANGES}\n" + narrow_table(*parameter_cells(found)),
        legend({name: row.meaning for name, row in found.parameters.items()}),
        "\n".join(filled(line) for line in speed_sentences(found)),
    ]
    return "\n\n".join(block for block in blocks if block) + "\n"


def scores(found: Comparison) -> Cells:
    """How well each fit predicts."""
    heads = ("fit", "model", "score less by", "±", "weight")
    rows: list[tuple[str, ...]] = [
        (
            name,
            found.described[name],
            _elpd(d.elpd),
            "" if name == found.best or np.isnan(d.standard_error) else f"{d.standard_error:.1f}",
            f"{found.weights[name]:.2f}",
        )
        for name, d in found.differences.items()
    ]
    return heads, rows


def verdict_sentences(found: Comparison) -> list[str]:
    """What the data prefer, and whether they can tell."""
    best, *others = found.differences
    lines = [_preferred(found, name) for name in others if found.verdict(name) == "clear"]
    lines += [_leaning(found, name) for name in others if found.verdict(name) == "leaning"]
    alike = [name for name in others if found.verdict(name) == "open"]
    if alike:
        size = _difference(found, alike[0]) if len(alike) == 1 else "smaller than 4 or than twice their standard errors"
        noun = "the difference is" if len(alike) == 1 else "the differences are"
        lines.append(
            f"The data cannot tell {best} from {listed(alike)}: {noun} within what chance gives ({size}). Prefer the "
            "simpler one."
        )
    return lines + [_not_trusted(found, name) for name in found.differences if name in found.troubles]


def _not_trusted(found: Comparison, name: str) -> str:
    """That a fit is not to be trusted, and what this makes of the comparison."""
    said = f"{name} is not to be trusted: it is {listed(found.troubles[name])}."
    if NOT_CONVERGED in found.troubles[name]:
        return f"{said} Scores rest on its draws; fit it again with --resume before you compare."
    return f"{said} To predict best of these is not to be right." if name == found.best else said


def _preferred(found: Comparison, name: str) -> str:
    return f"The data prefer {found.best} over {name} ({_difference(found, name)}).{_dominated(found, name)}"


def _leaning(found: Comparison, name: str) -> str:
    n = len(found.readings)
    return (
        f"The data lean towards {found.best} over {name} ({_difference(found, name)}), but with {n} readings the "
        f"standard error is itself uncertain and tends to be too small: not proof.{_dominated(found, name)}"
    )


def _difference(found: Comparison, name: str) -> str:
    d = found.differences[name]
    error = ", its standard error unknown, with one reading" if np.isnan(d.standard_error) else f" ± {d.standard_error:.1f}"
    return f"score less by {_elpd(d.elpd)}{error}"


def _elpd(value: float) -> str:
    """A difference of log densities; one that no number holds in words."""
    return f"{value:.1f}" if np.isfinite(value) else "beyond numbers"


def _dominated(found: Comparison, name: str) -> str:
    """The reading that alone makes most of a difference, if one does."""
    each = found.pointwise(name)
    most = int(np.argmax(each))
    if len(each) < 2 or each[most] < _DOMINATES * each.sum():
        return ""
    return f" Most of it comes from one reading, {_named(found.readings[most])} ({each[most]:+.1f})."


def _named(reading: tuple[str, str]) -> str:
    return f"{reading[0].replace('_', ' ')} {reading[1]}"


def basis_sentences(found: Comparison) -> list[str]:
    """What is compared, and what is not."""
    counts = Counter(name for name, _ in found.readings)
    parts = "" if found.left_out == "run" else "parts "
    what = listed([f"{n} {parts}of {name.replace('_', ' ')}" for name, n in counts.items()])
    n, verdicts = len(found.readings), {found.verdict(name) for name in list(found.differences)[1:]}
    lines = [
        f"Compared on {counted(n, 'reading')}, each left out and predicted by the others: {what}. The score says how "
        "probable the readings were: 2.3 less is ten times less probable. The "
        "weights make the mixture of the models that predicts best"
        + ("; where the data cannot tell, they follow chance, and even 0 rules no model out." if "open" in verdicts else ".")
    ]
    if found.left_out != "run":
        what = "the readings at one load" if found.left_out == "load" else "one reading"
        runs = "is one run" if found.few_runs == 1 else f"are only {found.few_runs} runs"
        why = f", because there {runs}" if found.few_runs else ""
        lines.append(
            f"Left out at a time: {what} of a run{why}; what its mounting did is known from the rest of the run. This compares "
            "how the models describe these mountings, not how they foretell another one (--leave-out run does)."
        )
    if found.counts_runs:
        lines.append(
            "A run of forces counts as one reading, because its samples share one mounting: it is left out as a whole."
        )
    lines += [part.sentence() for part in found.omitted]
    if n < FEW_READINGS and verdicts - {"open"} and "leaning" not in verdicts:  # of which it is said already
        lines.append(f"With {n} readings the standard errors tend to be too small.")
    return lines


def treated_text(found: Comparison) -> str:
    """Which readings importance sampling could not leave out, and what was done instead."""
    names = list(found.differences)
    ways = {name: found.predictions[name].how for name in names}
    which = [i for i in range(len(found.readings)) if any(ways[name][i] != "importance sampling" for name in names)]
    if not which:
        return ""
    rough = sum(how.count("rough") for how in ways.values())
    lines = [
        "Readings on which a fit leans were left out by moving the fit to where it would be without them or, where that was "
        "not enough, by fitting again."
    ]
    if rough:
        lines.append(
            f"For {counted(rough, 'reading')} the fit without it did not converge: take the differences as "
            "rough."
        )
    if len(which) > _FEW:
        lines.append(f"That concerns {len(which)} of {len(found.readings)} readings.")
        return "\n".join(filled(line) for line in lines)
    rows = [(_named(found.readings[i]), *(_SHORT[ways[name][i]] for name in names)) for i in which]
    return "\n".join([*(filled(line) for line in lines), narrow_table(("reading", *short_names(names)), rows)])


def parameter_cells(found: Comparison) -> Cells:
    """Parameters and the best length in each fit."""
    names = list(found.differences)
    rows = [
        (_head(p, row.unit), *(_shown(row.by_fit.get(name)) for name in names)) for p, row in found.parameters.items()
    ]
    rows += (
        [("optimal length", *(_shown(found.optimal_length[n][0], found.optimal_length[n][1]) for n in names))]
        if len(found.optimal_length) == len(names)
        else []
    )
    return ("parameter", *short_names(names)), rows


def short_names(names: Sequence[str]) -> list[str]:
    """Names of fits that find room as headings: of long ones the end, or their number where that is not theirs alone."""
    short = [name if len(name) <= _LONGEST_HEAD else f"...{name[3 - _LONGEST_HEAD :]}" for name in names]
    if len(set(short)) == len(names):
        return short
    return [name if len(name) <= _LONGEST_HEAD else f"fit {i + 1} above" for i, name in enumerate(names)]


def _head(name: str, unit: str) -> str:
    return name if unit == "1" else f"{name} ({unit})"


def _shown(interval: Interval | None, unit: str = "") -> str:
    if interval is None:
        return "-"
    return give_or_take(interval.mean, interval.sd) + (f" {unit}" if unit else "")


def speed_sentences(found: Comparison) -> list[str]:
    """The answer on speed, from every fit that allows it."""
    lines = [f"{name}: {effect.sentence()}" for name, effect in found.rate_effects.items()]
    without = [name for name in found.differences if name not in found.rate_effects]
    for name in found.rate_effects:
        for plain in without:
            better = found.differences[plain].elpd - found.differences[name].elpd
            if better <= 0 or not found.differences[plain].is_distinguishable:
                lines.append(f"Letting friction depend on speed ({name}) predicts no better than not ({plain}).")
            else:
                lines.append(f"Letting friction depend on speed ({name}) predicts better than not ({plain}).")
    return lines
