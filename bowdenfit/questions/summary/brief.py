"""The summary as it is printed (`summary.txt`): one page with the answer, whether to trust it, what to do next, and numbers."""

import textwrap
from collections.abc import Sequence

from bowdenfit.kinds import describe_reading
from bowdenfit.questions.check.table_checks import CheckedReading
from bowdenfit.questions.check.words import value_with_unit
from bowdenfit.questions.summary.answer import checked_readings, key_quantities, outlying_readings, summary_sentences
from bowdenfit.questions.summary.verdict import (
    assess_fit,
    distrust_warning,
    interval_width_caveat,
    reasons_against,
    reasons_to_trust,
    suggest_next_step,
)
from bowdenfit.results.record import Record
from bowdenfit.words import WIDTH, counted, filled, table

LINES = 25
_LONGEST_NAME, _LONGEST_READING = 44, 36  # characters
_LEAST_QUANTITIES, _MOST_QUANTITIES, _MOST_OUTLIERS = 4, 8, 3  # rows
_OTHER_LINES = 7  # lines that are neither sentences nor rows: headings, what is left out, blank lines, the last one
READING_HEADS = ("measured", "expected", "90 % interval")
_MORE = "Everything else: bowdenfit summary --full"


def summary_text(fit: Record) -> str:
    """One page for people: at most `LINES` lines, as a terminal of 80 columns shows them."""
    sentences, outlier_lines = _sentence_lines(fit), _outlier_lines(fit)
    shown, complete = _quantity_lines(fit, LINES - sum(map(len, sentences)) - len(outlier_lines) - _OTHER_LINES)
    if not complete and assess_fit(fit).trusted and not assess_fit(fit).doubts:  # that all readings agree is said above already
        longer, complete = _quantity_lines(fit, LINES - sum(map(len, sentences)) - _OTHER_LINES + 1)
        shown, outlier_lines = (longer, []) if complete else (shown, outlier_lines)
    below = [line for block in (shown, outlier_lines, [_MORE]) for line in (["", *block] if block else [])]
    further = filled(interval_width_caveat(fit)).splitlines() if assess_fit(fit).trusted else []
    if further and sum(map(len, sentences)) + len(further) + len(below) <= LINES:
        sentences.insert(-1, further)
    return "\n".join([*_shorten_to(sentences, LINES - len(below)), *below]) + "\n"


def _shorten_to(sentences: list[list[str]], room: int) -> list[str]:
    """Sentences in so many lines: the first and the last stay, of the others as many as there is room for, in their order."""
    first, *others, last = sentences
    if sum(map(len, sentences)) <= room:
        return [line for sentence in sentences for line in sentence]
    left, kept = room - len(first) - len(last) - 1, list[list[str]]()
    for sentence in others:
        if (left := left - len(sentence)) < 0:
            break
        kept.append(sentence)
    more = f"[{counted(len(others) - len(kept), 'sentence')} more: bowdenfit summary --full]"
    return [line for sentence in (first, *kept, [more], last) for line in sentence][:room]


def _sentence_lines(fit: Record) -> list[list[str]]:
    """Lines of the answer, of whether to trust it and of what to do next, each sentence from a line of its own on."""
    fit_verdict, name = assess_fit(fit), textwrap.shorten(fit.name, _LONGEST_NAME, placeholder="...")
    first, *others = summary_sentences(fit)
    first = first[0].lower() + first[1:]
    if fit_verdict.trusted:
        sentences = [f"{name}: {first}", *others, *reasons_to_trust(fit), suggest_next_step(fit)]
    else:
        sentences = [f"{name}: {distrust_warning(fit_verdict)}", *reasons_against(fit_verdict), f"What they would say: {first}"]
    return [filled(sentence).splitlines() for sentence in sentences if sentence]


def _quantity_lines(fit: Record, lines: int) -> tuple[list[str], bool]:
    """The coefficients in a table of about so many rows, and whether it says what each is, for which it takes further lines."""
    rows_to_show = key_quantities(fit)
    shown = rows_to_show[: min(max(lines, _LEAST_QUANTITIES), _MOST_QUANTITIES)]
    if not shown:
        return [], True
    interval_width = max(len(q.interval) for q in shown)
    rows = [(q.name, q.value, f"{q.interval:>{interval_width}} {q.unit}".rstrip()) for q in shown]
    heads = ("", "value", f"{'90 % interval':>{interval_width}}")
    printed = table(heads, rows, left=heads[-1:]).splitlines()
    start = max(map(len, printed)) + 2
    more = len(rows_to_show) - len(shown)
    lines_made, spare, complete = printed[:2], lines - len(shown) + (more <= 0), True
    for line, q in zip(printed[2:], shown, strict=True):
        meaning = _meaning_lines(q.description, WIDTH - start, spare)
        spare -= len(meaning) - 1
        complete &= " ".join(meaning) == q.description
        lines_made += [f"{line:<{start}}{meaning[0]}".rstrip(), *(" " * start + further for further in meaning[1:])]
    return [*lines_made, *([f"and {more} more"] if more > 0 else [])], complete


def _meaning_lines(meaning: str, room: int, spare: int) -> list[str]:
    """What a coefficient is, in one line and as many more as there are to spare, else cut; the names of those that are no
    friction say it themselves where there is no room.
    """
    whole = textwrap.wrap(meaning, room) or [""]
    if len(whole) <= 1 + max(spare, 0):
        return whole
    cut = textwrap.shorten(meaning, room, placeholder=" ...") if meaning.startswith("friction") else ""
    return ["" if cut.strip() == "..." else cut]


def _outlier_lines(fit: Record) -> list[str]:
    """Readings that are off, beside what was expected of them; how many there are where none is."""
    outliers, readings = outlying_readings(fit), checked_readings(fit)
    if not outliers:
        return [filled(say_no_outliers(readings))] if len(readings) > 1 else []
    rows = [format_reading(reading) for reading in outliers[:_MOST_OUTLIERS]]
    heads = (f"Off: {len(outliers)} of {len(readings)} readings", *READING_HEADS)
    more = len(outliers) - len(rows)
    return [*table(heads, rows).splitlines(), *([f"and {more} more"] if more > 0 else [])]


def say_no_outliers(readings: Sequence[CheckedReading]) -> str:
    """That every reading agrees with all the others."""
    return f"None of {len(readings)} readings is off."


def format_reading(reading: CheckedReading) -> tuple[str, str, str, str]:
    """A reading beside what all the others say of it, under `READING_HEADS`."""
    name = describe_reading(reading.table, reading.label)
    measured, expected, low, high = (
        value_with_unit(reading, value) for value in (reading.reading, reading.expected, reading.q05, reading.q95)
    )
    bound = "at most " if reading.is_bound else ""
    interval = f"{low.rsplit(' ', 1)[0]} to {high}"
    return textwrap.shorten(name, _LONGEST_READING, placeholder="..."), f"{bound}{measured}", expected, interval
