"""A comparison for people: as text, and as a page."""

from collections import Counter
from collections.abc import Sequence

import numpy as np

from bowdenfit.display import Block, Legend, ResultTable, render_text, separate
from bowdenfit.inference.comparison import FEW_READINGS
from bowdenfit.inference.interval import Interval
from bowdenfit.pages.section import HtmlPage, PageTable, Picture, make_meanings_table, prose_section
from bowdenfit.questions.compare.answer import Comparison
from bowdenfit.questions.compare.comparison_figure import HEADING, caption
from bowdenfit.questions.summary.verdict import NOT_CONVERGED
from bowdenfit.words import counted, give_or_take, listed

_DOMINANT_SHARE = 0.5  # share of a difference from which one reading is named; a judgement
_MAX_LISTED = 20  # readings treated one by one that are named; a judgement
_MAX_HEAD_LENGTH = 30  # characters of the name of a fit over a column; a judgement
Cells = tuple[tuple[str, ...], list[tuple[str, ...]]]  # heads and rows
HOW_WELL, WHAT_CHANGES = "How well each predicts a reading left out", "What changes, mean ± sd"
_SHORT_METHODS = {"importance sampling": "-", "moment matching": "moved", "refit": "fitted again", "rough": "rough"}


def comparison_blocks(comparison: Comparison) -> list[Block]:
    """Return a comparison for people: which fit predicts best, what changes between them, and what speed does."""
    return separate(
        verdict_sentences(comparison),
        [HOW_WELL, ResultTable(*score_table(comparison), left=("model",), narrow=True)],
        basis_sentences(comparison),
        influential_blocks(comparison),
        [WHAT_CHANGES, ResultTable(*parameter_table(comparison), narrow=True)],
        [Legend({name: row.meaning for name, row in comparison.parameters.items()})],
        speed_sentences(comparison),
    )


def comparison_page(comparison: Comparison) -> HtmlPage:
    """Return a comparison as a page: which fit predicts best, how well each does, and what changes between them.

    Args:
        comparison: The comparison.
    """
    heads, rows = score_table(comparison)
    first, *others = verdict_sentences(comparison)
    names, values = parameter_table(comparison)
    meanings = {name: parameter.meaning for name, parameter in comparison.parameters.items()}
    sections = (
        prose_section("The answer", others, headline=first),
        prose_section(
            "How well each predicts",
            basis_sentences(comparison),
            [PageTable(heads, tuple(rows), HOW_WELL, left=(0, 1))],
            folded=[("Influential readings", render_text(influential_blocks(comparison)).strip())],
            pictures=(Picture("comparison", HEADING, caption(comparison)),),
        ),
        prose_section(
            "What changes",
            speed_sentences(comparison),
            [PageTable(names, tuple(values), WHAT_CHANGES)],
            folded=[("What the names mean", make_meanings_table(meanings))],
        ),
    )
    return HtmlPage(listed(list(comparison.differences)), "Comparison by bowdenfit", sections)


def score_table(comparison: Comparison) -> Cells:
    """Return heads and rows of how well each fit predicts."""
    heads = ("fit", "model", "score less by", "±", "weight")
    rows: list[tuple[str, ...]] = [
        (
            name,
            comparison.descriptions[name],
            _format_elpd(d.elpd),
            "" if name == comparison.best or np.isnan(d.standard_error) else f"{d.standard_error:.1f}",
            f"{comparison.weights[name]:.2f}",
        )
        for name, d in comparison.differences.items()
    ]
    return heads, rows


def verdict_sentences(comparison: Comparison) -> list[str]:
    """Say what the data prefer, and whether they can tell."""
    best, *others = comparison.differences
    lines = [_preference_sentence(comparison, name) for name in others if comparison.verdict(name) == "clear"]
    lines += [_leaning_sentence(comparison, name) for name in others if comparison.verdict(name) == "leaning"]
    undecided = [name for name in others if comparison.verdict(name) == "open"]
    if undecided:
        size = (
            _describe_difference(comparison, undecided[0])
            if len(undecided) == 1
            else "smaller than 4 or than twice their standard errors"
        )
        noun = "the difference is" if len(undecided) == 1 else "the differences are"
        lines.append(
            f"The data cannot distinguish {best} from {listed(undecided)}: {noun} within what chance gives ({size})."
        )
        if any(name not in comparison.other_priors for name in undecided):
            lines[-1] += " Prefer the simpler one."
    lines += [_prior_sentence(comparison, name) for name in others if name in comparison.other_priors]
    return lines + [_trust_sentence(comparison, name) for name in comparison.differences if name in comparison.troubles]


def _prior_sentence(comparison: Comparison, name: str) -> str:
    """Say that a fit is the same model as the best one with other priors, and what decides between them."""
    parameters = comparison.other_priors[name]
    priors = "prior" if len(parameters) == 1 else "priors"
    return (
        f"{name} differs from {comparison.best} only in the {priors} of {listed(parameters)}: neither is simpler, and what is "
        "known besides these readings decides between them. The last table shows how far that moves each number."
    )


def _trust_sentence(comparison: Comparison, name: str) -> str:
    """Say that a fit is not to be trusted, and what this makes of the comparison."""
    sentence = f"{name} is not to be trusted: it is {listed(comparison.troubles[name])}."
    if NOT_CONVERGED in comparison.troubles[name]:
        return f"{sentence} Scores rest on its draws; fit it again with --resume before you compare."
    return (
        f"{sentence} Predicting best among these fits does not make it right." if name == comparison.best else sentence
    )


def _preference_sentence(comparison: Comparison, name: str) -> str:
    difference = _describe_difference(comparison, name)
    return f"The data prefer {comparison.best} over {name} ({difference}).{_name_dominating_reading(comparison, name)}"


def _leaning_sentence(comparison: Comparison, name: str) -> str:
    n = counted(len(comparison.readings), "reading")
    return (
        f"The data favor {comparison.best} over {name} ({_describe_difference(comparison, name)}), but with {n} the "
        f"standard error is itself uncertain and tends to be too small: not proof.{_name_dominating_reading(comparison, name)}"
    )


def _describe_difference(comparison: Comparison, name: str) -> str:
    d = comparison.differences[name]
    error = (
        ", its standard error unknown, with one reading" if np.isnan(d.standard_error) else f" ± {d.standard_error:.1f}"
    )
    return f"score less by {_format_elpd(d.elpd)}{error}"


def _format_elpd(value: float) -> str:
    """Return a difference of log densities; one that no number holds in words."""
    return f"{value:.1f}" if np.isfinite(value) else "beyond numbers"


def _name_dominating_reading(comparison: Comparison, name: str) -> str:
    """Name the reading that alone makes most of a difference, if one does."""
    differences = comparison.pointwise(name)
    largest = int(np.argmax(differences))
    if len(differences) < 2 or differences[largest] < _DOMINANT_SHARE * differences.sum():
        return ""
    return f" Most of it comes from one reading, {_format_reading(comparison.readings[largest])} ({differences[largest]:+.1f})."


def _format_reading(reading: tuple[str, str]) -> str:
    return f"{reading[0].replace('_', ' ')} {reading[1]}"


def basis_sentences(comparison: Comparison) -> list[str]:
    """Say what is compared, and what is not."""
    counts = Counter(name for name, _ in comparison.readings)
    whole = comparison.left_out == "run"
    what = listed(
        [f"{n if whole else counted(n, 'part')} of {name.replace('_', ' ')}" for name, n in counts.items()]
    )
    n, verdicts = len(comparison.readings), {comparison.verdict(name) for name in list(comparison.differences)[1:]}
    lines = [
        f"Compared on {counted(n, 'reading')}, each left out and predicted by the others: {what}. The score says how "
        "probable the readings were: 2.3 less is ten times less probable. The "
        "weights make the mixture of the models that predicts best"
        + (
            "; where the data cannot distinguish models, they follow chance, and even 0 excludes no model."
            if "open" in verdicts
            else "."
        )
    ]
    if comparison.left_out != "run":
        what = "the readings at one load" if comparison.left_out == "load" else "one reading"
        runs = "is one run" if comparison.few_runs == 1 else f"are only {comparison.few_runs} runs"
        reason = f", because there {runs}" if comparison.few_runs else ""
        lines.append(
            f"Left out at a time: {what} of a run{reason}; the effect of its mounting is known from the rest of the run. This "
            "compares how the models describe these mountings, not how they predict another mounting (--leave-out run does)."
        )
    if comparison.counts_runs:
        lines.append(
            "A run of forces counts as one reading, because its samples share one mounting: it is left out as a whole."
        )
    lines += [part.sentence() for part in comparison.omitted]
    if n < FEW_READINGS and verdicts - {"open"} and "leaning" not in verdicts:  # of which it is said already
        lines.append(f"With {counted(n, 'reading')} the standard errors tend to be too small.")
    return lines


def influential_blocks(comparison: Comparison) -> list[Block]:
    """Say which readings importance sampling could not leave out, and what was done instead."""
    names = list(comparison.differences)
    ways = {name: comparison.predictions[name].how for name in names}
    which = [
        i for i in range(len(comparison.readings)) if any(ways[name][i] != "importance sampling" for name in names)
    ]
    if not which:
        return []
    rough = sum(how.count("rough") for how in ways.values())
    blocks: list[Block] = [
        "Influential readings (the fit would change without them) were left out by moment matching (moving the "
        "draws to where they would be without them) or, where that was not enough, by fitting again."
    ]
    if rough:
        blocks.append(
            f"For {counted(rough, 'reading')} the fit without it did not converge: take the differences as rough."
        )
    if len(which) > _MAX_LISTED:
        return [*blocks, f"That concerns {len(which)} of {len(comparison.readings)} readings."]
    rows = [
        (_format_reading(comparison.readings[i]), *(_SHORT_METHODS[ways[name][i]] for name in names)) for i in which
    ]
    return [*blocks, ResultTable(("reading", *short_names(names)), rows, narrow=True)]


def parameter_table(comparison: Comparison) -> Cells:
    """Return heads and rows of parameters and the best length in each fit."""
    names = list(comparison.differences)
    rows = [
        (_format_head(p, row.unit), *(_format_interval(row.by_fit.get(name)) for name in names))
        for p, row in comparison.parameters.items()
    ]
    rows += (
        [
            (
                "optimal length",
                *(_format_interval(comparison.optimal_length[n][0], comparison.optimal_length[n][1]) for n in names),
            )
        ]
        if len(comparison.optimal_length) == len(names)
        else []
    )
    return ("parameter", *short_names(names)), rows


def short_names(names: Sequence[str]) -> list[str]:
    """Return names of fits that find room as headings: of long ones the end, or their number where that is not theirs alone."""
    short = [name if len(name) <= _MAX_HEAD_LENGTH else f"...{name[3 - _MAX_HEAD_LENGTH :]}" for name in names]
    if len(set(short)) == len(names):
        return short
    return [name if len(name) <= _MAX_HEAD_LENGTH else f"fit {i + 1} above" for i, name in enumerate(names)]


def _format_head(name: str, unit: str) -> str:
    return name if unit == "1" else f"{name} ({unit})"


def _format_interval(interval: Interval | None, unit: str = "") -> str:
    if interval is None:
        return "-"
    return give_or_take(interval.mean, interval.sd) + (f" {unit}" if unit else "")


def speed_sentences(comparison: Comparison) -> list[str]:
    """Say what speed does, from every fit that allows it."""
    lines = [f"{name}: {effect.sentence()}" for name, effect in comparison.rate_effects.items()]
    without = [name for name in comparison.differences if name not in comparison.rate_effects]
    for name in comparison.rate_effects:
        for plain in without:
            better = comparison.differences[plain].elpd - comparison.differences[name].elpd
            if better <= 0 or not comparison.differences[plain].is_distinguishable:
                lines.append(f"Letting friction depend on speed ({name}) predicts no better than not ({plain}).")
            else:
                lines.append(f"Letting friction depend on speed ({name}) predicts better than not ({plain}).")
    return lines
