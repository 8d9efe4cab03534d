"""The summary as it is printed (`summary.txt`): one page with the answer, whether to trust it, what to do next, and numbers."""

import textwrap
from collections.abc import Sequence

from bowdenfit.kinds import reading_called
from bowdenfit.questions.check.table_checks import CheckedReading
from bowdenfit.questions.check.words import value_with_unit
from bowdenfit.questions.summary.answer import answer, checked_readings, quantities, readings_off
from bowdenfit.questions.summary.trust_words import assumed, next_step, reasons, trust, warning
from bowdenfit.questions.summary.verdict import verdict
from bowdenfit.results.record import Record
from bowdenfit.words import WIDTH, counted, filled, table

LINES = 25
_LONGEST_NAME, _LONGEST_READING = 44, 36  # characters
_LEAST_QUANTITIES, _MOST_QUANTITIES, _MOST_OFF = 4, 8, 3  # rows
_BESIDE = 7  # lines that are neither sentences nor rows: headings, what is left out, blank lines, the last one
READING_HEADS = ("measured", "expected", "90 % interval")
_MORE = "Everything else: bowdenfit summary --full"


def summary_text(fit: Record) -> str:
    """One page for people: at most `LINES` lines, as a terminal of 80 columns shows them."""
    said, off = _said(fit), _off(fit)
    shown, whole = _quantities(fit, LINES - sum(map(len, said)) - len(off) - _BESIDE)
    if not whole and verdict(fit).trusted and not verdict(fit).doubts:  # that all readings agree is said above already
        longer, whole = _quantities(fit, LINES - sum(map(len, said)) - _BESIDE + 1)
        shown, off = (longer, []) if whole else (shown, off)
    below = [line for block in (shown, off, [_MORE]) for line in (["", *block] if block else [])]
    further = filled(assumed(fit)).splitlines() if verdict(fit).trusted else []
    if further and sum(map(len, said)) + len(further) + len(below) <= LINES:
        said.insert(-1, further)
    return "\n".join([*_within(said, LINES - len(below)), *below]) + "\n"


def _within(said: list[list[str]], room: int) -> list[str]:
    """Sentences in so many lines: the first and the last stay, of the others as many as there is room for, in their order."""
    first, *others, last = said
    if sum(map(len, said)) <= room:
        return [line for sentence in said for line in sentence]
    left, kept = room - len(first) - len(last) - 1, list[list[str]]()
    for sentence in others:
        if (left := left - len(sentence)) < 0:
            break
        kept.append(sentence)
    more = f"[{counted(len(others) - len(kept), 'sentence')} more: bowdenfit summary --full]"
    return [line for sentence in (first, *kept, [more], last) for line in sentence][:room]


def _said(fit: Record) -> list[list[str]]:
    """Lines of the answer, of whether to trust it and of what to do next, each sentence from a line of its own on."""
    found, name = verdict(fit), textwrap.shorten(fit.name, _LONGEST_NAME, placeholder="...")
    first, *others = answer(fit)
    first = first[0].lower() + first[1:]
    if found.trusted:
        sentences = [f"{name}: {first}", *others, *trust(fit), next_step(fit)]
    else:
        sentences = [f"{name}: {warning(found)}", *reasons(found), f"What they would say: {first}"]
    return [filled(sentence).splitlines() for sentence in sentences if sentence]


def _quantities(fit: Record, lines: int) -> tuple[list[str], bool]:
    """The coefficients in a table of about so many rows, and whether it says what each is, for which it takes further lines."""
    found = quantities(fit)
    shown = found[: min(max(lines, _LEAST_QUANTITIES), _MOST_QUANTITIES)]
    if not shown:
        return [], True
    wide = max(len(q.interval) for q in shown)
    rows = [(q.name, q.value, f"{q.interval:>{wide}} {q.unit}".rstrip()) for q in shown]
    heads = ("", "value", f"{'90 % interval':>{wide}}")
    printed = table(heads, rows, left=heads[-1:]).splitlines()
    start = max(map(len, printed)) + 2
    more = len(found) - len(shown)
    made, spare, whole = printed[:2], lines - len(shown) + (more <= 0), True
    for line, q in zip(printed[2:], shown, strict=True):
        meaning = _meaning(q.what, WIDTH - start, spare)
        spare -= len(meaning) - 1
        whole &= " ".join(meaning) == q.what
        made += [f"{line:<{start}}{meaning[0]}".rstrip(), *(" " * start + further for further in meaning[1:])]
    return [*made, *([f"and {more} more"] if more > 0 else [])], whole


def _meaning(what: str, room: int, spare: int) -> list[str]:
    """What a coefficient is, in one line and as many more as there are to spare, else cut; the names of those that are no
    friction say it themselves where there is no room.
    """
    whole = textwrap.wrap(what, room) or [""]
    if len(whole) <= 1 + max(spare, 0):
        return whole
    cut = textwrap.shorten(what, room, placeholder=" ...") if what.startswith("friction") else ""
    return ["" if cut.strip() == "..." else cut]


def _off(fit: Record) -> list[str]:
    """Readings that are off, beside what was expected of them; how many there are where none is."""
    off, every = readings_off(fit), checked_readings(fit)
    if not off:
        return [filled(none_is_off(every))] if len(every) > 1 else []
    rows = [reading_row(reading) for reading in off[:_MOST_OFF]]
    heads = (f"Off: {len(off)} of {len(every)} readings", *READING_HEADS)
    more = len(off) - len(rows)
    return [*table(heads, rows).splitlines(), *([f"and {more} more"] if more > 0 else [])]


def none_is_off(every: Sequence[CheckedReading]) -> str:
    """That every reading agrees with all the others."""
    return f"None of {len(every)} readings is off."


def reading_row(reading: CheckedReading) -> tuple[str, str, str, str]:
    """A reading beside what all the others say of it, under `READING_HEADS`."""
    name = reading_called(reading.table, reading.label)
    measured, expected, low, high = (
        value_with_unit(reading, value) for value in (reading.reading, reading.expected, reading.q05, reading.q95)
    )
    bound = "at most " if reading.is_bound else ""
    interval = f"{low.rsplit(' ', 1)[0]} to {high}"
    return textwrap.shorten(name, _LONGEST_READING, placeholder="..."), f"{bound}{measured}", expected, interval
