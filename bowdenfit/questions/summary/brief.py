"""The summary as it is printed (`summary.txt`): one page with the answer, whether to trust it, what to do next, and numbers."""

import textwrap
from collections.abc import Sequence
from dataclasses import dataclass

from bowdenfit.arguments import Purpose
from bowdenfit.cable.sensors import RUN_SCATTER
from bowdenfit.display import Block, ResultTable, render_text, separate
from bowdenfit.inference.interval import NORMAL_90, Interval
from bowdenfit.inference.least_squares import Estimate
from bowdenfit.kinds import describe_reading
from bowdenfit.parameters.space import Parameter
from bowdenfit.questions.bends.words import elastic_overview
from bowdenfit.questions.check.data_set_words import describe_assumed_decimals
from bowdenfit.questions.check.table_checks import CheckedReading
from bowdenfit.questions.check.words import value_with_unit
from bowdenfit.questions.error_budget import KEY_ROLES, answer_interval, bench_sentences, find_optimal_length
from bowdenfit.questions.groups import contrast_groups
from bowdenfit.questions.loss import loss_by_contact
from bowdenfit.questions.recorded.friction_effects import compare_speeds, compute_lost_force
from bowdenfit.questions.recorded.presliding import estimate_presliding
from bowdenfit.questions.recorded.recording_caveats import describe_recording_caveats
from bowdenfit.questions.summary.usable_answers import find_usable_answers
from bowdenfit.questions.summary.verdict import (
    BETWEEN_MOUNTINGS,
    assess_for,
    collect_checked_readings,
    distrust_warning,
    find_outliers,
    interval_width_caveat,
    reasons_against,
    reasons_to_trust,
    suggest_next_step,
)
from bowdenfit.results.record import Record
from bowdenfit.words import WIDTH, counted, decimals, few, filled, table

LINES = 25  # fit on one terminal of usual height
_LONGEST_NAME, _LONGEST_READING = 44, 36  # characters of names in a line of 80
_LEAST_QUANTITIES, _MOST_QUANTITIES, _MOST_OUTLIERS = 4, 8, 3  # rows
_OTHER_LINES = 7  # lines that are neither sentences nor rows: headings, what is left out, blank lines, the last one
_LEAST_ROOM = 12  # characters of a line in which words can be wrapped; a judgement
READING_HEADS = ("measured", "expected", "90 % interval")
_MORE = "Everything else: bowdenfit summary --full"
_FEW = 3  # coefficients and contrasts that the answer names
_COEFFICIENT = "friction coefficient"


def summary_text(fit: Record, purpose: Purpose = "design") -> str:
    """Return the summary as text."""
    return render_text(summary_blocks(fit, purpose))


def summary_blocks(fit: Record, purpose: Purpose = "design") -> list[Block]:
    """Return one page for people: at most `LINES` lines, as a terminal of 80 columns shows them.

    Args:
        fit: The fit.
        purpose: What the answer is for; it comes first.
    """
    (answer, verdict), outliers = _sentences(fit, purpose), _outlier_blocks(fit)
    fit_verdict = assess_for(fit, purpose)
    excluded = [sentence for sentence in [fit.dataset.description.tables.describe_excluded()] if sentence]
    room = LINES - _count_lines([*answer, *verdict, *excluded]) - _OTHER_LINES
    shown, complete = _quantity_blocks(fit, room - _count_lines(outliers))
    if not complete and fit_verdict.trusted and not fit_verdict.doubts:  # that all readings agree is said above already
        longer, complete = _quantity_blocks(fit, room + 1)
        shown, outliers = (longer, []) if complete else (shown, outliers)
    below = separate(shown, [*excluded, *outliers], [_MORE])
    room = LINES - _count_lines(below) - 1
    further = interval_width_caveat(fit) if fit_verdict.trusted else ""
    if further and _count_lines([*answer, *verdict, further]) <= room:
        verdict.insert(-1, further)
    return [*_shorten_to(answer, verdict, room), "", *below]


def _count_lines(blocks: Sequence[Block]) -> int:
    """Return the number of lines that blocks have as text."""
    return render_text(blocks).count("\n") if blocks else 0


def _shorten_to(answer: list[str], verdict: list[str], room: int) -> list[str]:
    """Return sentences in at most so many lines: the first, the verdict, and of the rest of the answer what has room."""
    first, *further = answer
    if _count_lines([*answer, *verdict]) <= room:
        return [*answer, *verdict]
    left, fitting = room - _count_lines([first, *verdict]) - 1, list[str]()
    for sentence in further:
        if (left := left - _count_lines([sentence])) < 0:
            break
        fitting.append(sentence)
    more = f"[{counted(len(further) - len(fitting), 'sentence')} more: bowdenfit summary --full]"
    sentences = [first, *fitting, more, *verdict]
    while _count_lines(sentences) > room:  # the last sentence loses its last line
        *sentences, last = sentences
        sentences += [" ".join(filled(last).splitlines()[:-1])] if "\n" in filled(last) else []
    return sentences


def _sentences(fit: Record, purpose: Purpose) -> tuple[list[str], list[str]]:
    """Return the sentences of the answer, and of whether to trust it and what to do next.

    Of a fit that is not to be trusted, why comes first and the answer last.
    """
    fit_verdict, name = assess_for(fit, purpose), textwrap.shorten(fit.name, _LONGEST_NAME, placeholder="...")
    first, *further = summary_sentences(fit, purpose)
    first = first[0].lower() + first[1:]
    caveats = [*describe_assumed_decimals(fit.dataset), *describe_recording_caveats(fit)]
    if fit_verdict.trusted:
        # the lengths that are good enough, and the best one
        n_first = 2 if fit.dataset.description.route is not None and purpose == "design" else 0
        answer = [f"{name}: {first}", *further[:n_first], *bench_sentences(fit), *further[n_first:]]
        verdict = [*reasons_to_trust(fit), *caveats, suggest_next_step(fit)]
    else:
        answer = [f"{name}: {distrust_warning(fit_verdict)}", *reasons_against(fit_verdict)]
        verdict = [f"What they would say: {first}", *caveats]
    return list(filter(None, answer)), list(filter(None, verdict))


def _quantity_blocks(fit: Record, lines: int) -> tuple[list[Block], bool]:
    """Return the coefficients in a table of about so many rows, and whether it says in full what every one is."""
    rows_to_show = key_quantities(fit)
    shown = rows_to_show[: min(max(lines, _LEAST_QUANTITIES), _MOST_QUANTITIES)]
    if not shown:
        return [], True
    interval_width = max(len(q.interval) for q in shown)
    rows: list[tuple[str, ...]] = [(q.name, q.value, f"{q.interval:>{interval_width}} {q.unit}".rstrip()) for q in shown]
    heads: tuple[str, ...] = ("", "value", f"{'90 % interval':>{interval_width}}")
    room = WIDTH - _table_width(heads, rows) - 2
    more = len(rows_to_show) - len(shown)
    meanings, spare = list[str](), lines - len(shown) + (more <= 0)
    for q in shown:
        meaning = _meaning_lines(q.description, room, spare)
        spare -= len(meaning) - 1
        meanings.append("\n".join(meaning))
    complete = [meaning.replace("\n", " ") for meaning in meanings] == [q.description for q in shown]
    if any(meanings):
        heads, rows = (*heads, ""), [(*row, meaning) for row, meaning in zip(rows, meanings, strict=True)]
    return [ResultTable(heads, rows, left=heads[2:]), *([f"and {more} more"] if more > 0 else [])], complete


def _table_width(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> int:
    """Return the width of a table as text."""
    return max(map(len, table(heads, rows, left=heads[2:]).splitlines()))


def _meaning_lines(meaning: str, room: int, spare: int) -> list[str]:
    """Return what a coefficient is, in one line and at most so many more; cut, or left out, where there is no room."""
    if room < _LEAST_ROOM:
        return [""]
    whole = textwrap.wrap(meaning, room) or [""]
    if len(whole) <= 1 + max(spare, 0):
        return whole
    cut = textwrap.shorten(meaning, room, placeholder=" ...") if meaning.startswith("friction") else ""
    return ["" if cut.strip() == "..." else cut]


def _outlier_blocks(fit: Record) -> list[Block]:
    """Return the outliers beside what was expected of them; how many readings there are where none is an outlier."""
    outliers, readings = find_outliers(fit), collect_checked_readings(fit)
    if not outliers:
        return [say_no_outliers(readings)] if len(readings) > 1 else []
    rows = [format_reading(reading) for reading in outliers[:_MOST_OUTLIERS]]
    heads = (f"Outliers: {len(outliers)} of {counted(len(readings), 'reading')}", *READING_HEADS)
    more = len(outliers) - len(rows)
    return [ResultTable(heads, rows), *([f"and {more} more"] if more > 0 else [])]


def say_no_outliers(readings: Sequence[CheckedReading]) -> str:
    """Say that every reading agrees with all the others."""
    return f"None of the {len(readings)} readings is an outlier." if len(readings) > 1 else "The reading is not an outlier."


def format_reading(reading: CheckedReading) -> tuple[str, str, str, str]:
    """Format a reading beside its prediction from all the others, under `READING_HEADS`."""
    name = describe_reading(reading.table, reading.label)
    measured, expected, low, high = (
        value_with_unit(reading, value) for value in (reading.reading, reading.expected, reading.q05, reading.q95)
    )
    bound = "at most " if reading.is_bound else ""
    interval = f"{low.rsplit(' ', 1)[0]} to {high}"
    return textwrap.shorten(name, _LONGEST_READING, placeholder="..."), f"{bound}{measured}", expected, interval


@dataclass(frozen=True)
class KeyQuantity:
    """One coefficient as it is shown.

    Args:
        name: As in cable.toml.
        description: What it is.
        unit: Its unit, empty without one.
        value: Median, or estimate of least squares.
        interval: 90 % interval; what is known instead where there is none.
    """

    name: str
    description: str
    unit: str
    value: str
    interval: str


def key_quantities(fit: Record) -> list[KeyQuantity]:
    """Return the coefficients of friction, of the rope, and the scatter of mountings; curves and noise are details."""
    selected = [p for p in fit.model.space.parameters if p.role in KEY_ROLES or (p.name == RUN_SCATTER and p.fixed is None)]
    rows = [_key_quantity(fit, p) for p in sorted(selected, key=lambda p: p.name == RUN_SCATTER)]
    return [row for row in rows if row is not None]


def summary_sentences(fit: Record, purpose: Purpose = "design") -> list[str]:
    """Return the answer in sentences: the first says what to do, or what the coefficients are."""
    if fit.sampled is not None and fit.dataset.description.route is not None:
        best = find_optimal_length(fit)
        if purpose == "coefficients":
            return [_coefficient_sentence(fit), *_loss_sentence(fit), *_option_sentences(fit), best.headline]
        return [best.headline, *best.sentences(), *_loss_sentence(fit), *_option_sentences(fit)]
    return [_coefficient_sentence(fit), *_preload_advice(fit), *_loss_sentence(fit), *_option_sentences(fit)]


def _key_quantity(fit: Record, parameter: Parameter) -> KeyQuantity | None:
    """Return a parameter as it is shown; None without an estimate."""
    is_run_scatter = parameter.name == RUN_SCATTER
    unit, scale = ("%", 100.0) if is_run_scatter else ("" if parameter.unit == "1" else parameter.unit, 1.0)
    description = BETWEEN_MOUNTINGS if is_run_scatter else _describe(parameter)
    if fit.sampled is not None and parameter.name in find_usable_answers(fit).undetermined:
        description = f"NOT DETERMINED: {description}"
    if parameter.fixed is not None:
        return KeyQuantity(parameter.name, description, unit, f"{parameter.fixed * parameter.shown_scale:.4g}", "as stated")
    if fit.sampled is not None:
        interval = answer_interval(fit, parameter.name).times(scale)
        return KeyQuantity(parameter.name, description, unit, *_format_posterior(interval))
    estimate = fit.least_squares.estimates.get(parameter.name)
    return KeyQuantity(parameter.name, description, unit, *_format_estimate(estimate)) if estimate is not None else None


def _describe(parameter: Parameter) -> str:
    """Describe a parameter, such as 'friction, free sheath'; of options by what stands before the colon."""
    meaning = parameter.meaning.replace(_COEFFICIENT, "friction")
    return meaning.split(": ", 1)[-1] if parameter.role == "friction_model" else meaning


def _format_posterior(interval: Interval) -> tuple[str, str]:
    """Format a median and its 90 % interval."""
    digits = interval.digits
    return f"{interval.median:z.{digits}f}", interval.range_text(digits)


def _format_estimate(estimate: Estimate) -> tuple[str, str]:
    """Format an estimate of least squares and its 90 % interval."""
    if not estimate.identified:
        return "unknown", "not determined"
    digits = decimals(2 * NORMAL_90 * estimate.standard_error)
    interval = f"{estimate.lower:z.{digits}f} to {estimate.upper:z.{digits}f}"
    return f"{estimate.value:z.{digits}f}", interval if "nan" not in interval and "inf" not in interval else "not known"


def _coefficient_sentence(fit: Record) -> str:
    """Return such as 'Coefficient of friction 0.181 (90 % interval 0.177 to 0.185).'"""
    names = {p.name: p for p in fit.model.space.parameters}
    coefficients = [q for q in key_quantities(fit) if q.name != RUN_SCATTER]
    shown = [q for q in coefficients if names[q.name].role == "friction"] or coefficients
    if not shown:
        return "Nothing was fitted: every coefficient is stated."
    if len(shown) == 1:
        (only,) = shown
        what = (
            "Coefficient of friction"
            if names[only.name].role == "friction"
            else only.description[0].upper() + only.description[1:]
        )
        return f"{what} {_with_unit(only)} ({_interval_phrase(only)})."
    start = "Coefficients of friction: " if names[shown[0].name].role == "friction" else ""
    return f"{start}{few([f'{q.name} {_with_unit(q)}' for q in shown], _FEW)}."


def _with_unit(quantity: KeyQuantity) -> str:
    """Return the value of a quantity with its unit."""
    return f"{quantity.value} {quantity.unit}".rstrip()


def _interval_phrase(quantity: KeyQuantity) -> str:
    """Return the interval of a quantity in words."""
    return f"90 % interval {quantity.interval}" if " to " in quantity.interval else quantity.interval


def _preload_advice(fit: Record) -> list[str]:
    """Say which preload to set, of a cable that has one."""
    overview = elastic_overview(fit)
    return [overview.preload_window.advice] if overview is not None and overview.preload_window is not None else []


def _loss_sentence(fit: Record) -> list[str]:
    """Say which contact takes how much of the loss, of a cable that has several."""
    loss = loss_by_contact(fit)
    return [loss.sentence()] if loss is not None else []


def _option_sentences(fit: Record) -> list[str]:
    """Say what was found of drag, of speed, of turns and of groups, where the fit asked for them."""
    groups = contrast_groups(fit)
    contrasts = [f"Friction {c.coefficient}, {c.sentence()}." for c in (groups.contrasts if groups else ())[:_FEW]]
    effects = (compute_lost_force(fit), compare_speeds(fit), estimate_presliding(fit))
    return [effect.sentence() for effect in effects if effect is not None] + contrasts
