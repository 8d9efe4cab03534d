"""What `bowdenfit next` prints."""

import math

from bowdenfit.display import text_of
from bowdenfit.kinds.candidate import STROKE_WORDS
from bowdenfit.kinds.terms import candidate_kinds
from bowdenfit.questions.next.answer import NextMeasurement, Ranked
from bowdenfit.words import decimals, few, filled, percent, significant, table

HOW_TO_READ = (
    "± is one standard deviation, on average over what the reading may turn out to be; two that differ in the last digit "
    "are as good as each other."
)
_MOST_NAMED = 3  # candidates as good as the best that are named in the sentence


@text_of.register(NextMeasurement)
def next_measurement_text(found: NextMeasurement, top: int = 10) -> str:
    """What to measure next and when to stop, in sentences and a table of the best candidates.

    Args:
        found: The ranking.
        top: How many candidates the table shows.
    """
    more = len(found.ranked) - top
    lines = [
        "\n".join(filled(line) for line in ranking_sentences(found)),
        table(*ranking_table(found, top))
        + (f"\n... and {more} more, ranked lower; --top {len(found.ranked)} shows all." if more > 0 else ""),
        filled(HOW_TO_READ),
    ]
    return "\n\n".join(lines) + "\n"


def ranking_sentences(found: NextMeasurement) -> list[str]:
    """What to measure next, at which load, when to stop, and what would come after it."""
    sentences = [*_advice(found), *_load_and_stroke(found), found.stop, *_planned(found), *_repeated(found)]
    return [sentence for sentence in sentences if sentence]


def _sd(found: NextMeasurement, sd: float) -> str:
    """A standard deviation with the answer's unit."""
    unit = f" {found.answer.unit}" if found.answer.unit else ""
    return f"± {sd:.{_digits(found)}f}{unit}"


def _digits(found: NextMeasurement) -> int:
    """Decimals of standard deviations: two significant digits, or three where the best candidate changes little."""
    usual, change = decimals(found.answer.sd), found.answer.sd - found.ranked[0].sd
    return min(max(usual, decimals(change) - 1), usual + 1) if change > 0 else usual


def _advice(found: NextMeasurement) -> list[str]:
    """What to measure, at which load, and what would do as well."""
    best, answer = found.best, found.answer
    if best is None:
        first = found.ranked[0]
        return [
            f"None of these measurements would narrow {answer.words} noticeably: it is known to {_sd(found, answer.sd)}, and "
            f"to {_sd(found, first.sd)} after the best of them, {first.words}.",
            "One more reading of a kind that there are many of already adds little; name another kind with --candidate, or "
            "ask for another answer with --for.",
        ]
    per_cost = " for its cost" if best.cost is not None else ""
    lines = [
        f"Measure {best.words} next{per_cost}{_how(found, best)}. Then {answer.words} would be known to "
        f"{_sd(found, best.sd)}, now to {_sd(found, answer.sd)}."
    ]
    alike = [r for r in found.ranked if r.as_good and r is not best]
    if alike:
        named = [r.words[0].upper() + r.words[1:] if i == 0 else r.words for i, r in enumerate(alike)]
        lines.append(f"{few(named, _MOST_NAMED)} would do as well.")
    return lines


def _how(found: NextMeasurement, best: Ranked) -> str:
    """That the cable is to be mounted anew, and at which loads, where neither is said already."""
    if not candidate_kinds()[best.candidate.kind].mounted_anew:
        return ""
    if found.loads is None or math.isfinite(best.candidate.load):
        return ", mounted anew"
    low, high = map(significant, found.loads)
    return f", mounted anew, at {low} N" if low == high else f", mounted anew, at {low} to {high} N as so far"


def _load_and_stroke(found: NextMeasurement) -> list[str]:
    """At which load and of which stroke its readings tell most, against the same number of them as usual."""
    within = found.within
    if within is None:
        return []
    usual = next(r for r in within.ranked if r.name == found.ranked[0].name)
    best, worst = within.ranked[0], within.ranked[-1]
    said = f"That is a run as those made so far: {within.usual}."
    if worst.as_good or (usual.as_good and len({r.as_good for r in within.ranked}) == 1):
        return [f"{said} Which load and stroke they are taken at makes no difference beyond the error of this estimate."]
    if usual.as_good:
        return [
            f"{said} No other load or stroke does better beyond the error of this estimate; as many {_where(worst)} would "
            f"leave {_sd(found, worst.sd)}."
        ]
    return [
        f"{said} As many readings {_where(best)} do most: they leave {_sd(found, best.sd)}, those as usual "
        f"{_sd(found, usual.sd)}, and {_where(worst)} {_sd(found, worst.sd)}; name it with --candidate {best.name}."
    ]


def _where(ranked: Ranked) -> str:
    """'at 64 N while pulling'"""
    load, stroke = ranked.candidate.load, ranked.candidate.stroke
    way = f"while {STROKE_WORDS[stroke]}" if stroke else "of both strokes"
    return f"all at {significant(load)} N {way}"


def _planned(found: NextMeasurement) -> list[str]:
    """What would be best after it."""
    after = [
        f"{step.words}{' again' if step.name in [s.name for s in found.plan[:i]] else ''} ({_sd(found, step.sd)})"
        for i, step in enumerate(found.plan)
    ][1:]
    return [f"After it, {', then '.join(after)}."] if after else []


def _repeated(found: NextMeasurement) -> list[str]:
    """How often the best candidate would have to be measured to halve the uncertainty."""
    best, repeats = found.best, found.repeats
    if best is None or repeats is None:
        return []
    half, most = repeats.to_halve(found.answer.sd), repeats.times[-1]
    if half == 1:
        return []
    if half is not None:
        return [f"By itself it would halve the uncertainty after about {half} times."]
    still = _sd(found, repeats.sd[-1])
    return [f"By itself it would not halve the uncertainty: after {most} times that would still be {still}."]


def ranking_table(found: NextMeasurement, top: int) -> tuple[list[str], list[list[str]]]:
    """Heads and rows of so many of the best candidates."""
    shown = found.ranked[:top]
    unit = f" ({found.answer.unit})" if found.answer.unit else ""
    digits = _digits(found)
    heads = ["measurement", f"then known to{unit}", "uncertainty less by"]
    rows = [[r.name, f"± {r.sd:z.{digits}f}", percent(1 - r.sd / found.answer.sd)] for r in shown]
    if any(r.cost is not None for r in shown):
        heads += ["cost", "variance less by, per cost"]
        rows = [[*row, f"{r.cost:g}", percent(r.worth, 2)] for row, r in zip(rows, shown, strict=True)]
    return heads, rows
