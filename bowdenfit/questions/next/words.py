"""What to measure next, for people: as text, and as a section of the report."""

import math

from bowdenfit.display import Block, ResultTable, blocks_of, separate
from bowdenfit.kinds.candidate import STROKE_WORDS
from bowdenfit.kinds.terms import candidate_kinds
from bowdenfit.pages.section import PageSection, PageTable, prose_section
from bowdenfit.questions.next.answer import NextMeasurement, RankedCandidate, SecondMounting
from bowdenfit.words import decimals, few, percent, significant

TITLE = "What to measure next"
HOW_TO_READ = (
    "± is one standard deviation, averaged over what the reading may turn out to be; candidates that differ only in the "
    "last digit are equally good."
)
_MAX_NAMED = 3  # candidates as good as the best that are named in the sentence; a judgement
_MAX_ROWS = 10  # of the table in the report; a judgement


@blocks_of.register(NextMeasurement)
def ranking_blocks(ranking: NextMeasurement, top: int = 10) -> list[Block]:
    """Say what to measure next and when to stop, in sentences and a table of the best candidates.

    Args:
        ranking: The ranking.
        top: How many candidates the table shows.
    """
    if ranking.second_mounting is not None:  # beside which averages over all outcomes would mislead
        return list(ranking_sentences(ranking))
    more = len(ranking.ranked) - top
    lower = [f"... and {more} more, ranked lower; --top {len(ranking.ranked)} shows all."] if more > 0 else []
    return separate(ranking_sentences(ranking), [ResultTable(*ranking_table(ranking, top)), *lower], [HOW_TO_READ])


def ranking_section(ranking: NextMeasurement) -> PageSection:
    """Return the advice, and the best candidates in a table."""
    if ranking.second_mounting is not None:
        return prose_section(TITLE, ranking_sentences(ranking))
    heads, rows = ranking_table(ranking, _MAX_ROWS)
    return prose_section(
        TITLE, ranking_sentences(ranking), [PageTable(tuple(heads), tuple(map(tuple, rows)), HOW_TO_READ)]
    )


def ranking_sentences(ranking: NextMeasurement) -> list[str]:
    """Say what to measure next, at which load, when to stop, and what would come after it."""
    if ranking.second_mounting is not None:
        return _second_mounting_sentences(ranking, ranking.second_mounting)
    sentences = [
        *_advice_sentences(ranking),
        *_load_and_stroke_sentences(ranking),
        ranking.stop,
        *_plan_sentences(ranking),
        *_repeat_sentences(ranking),
    ]
    return [sentence for sentence in sentences if sentence]


def _second_mounting_sentences(ranking: NextMeasurement, second: SecondMounting) -> list[str]:
    """Say that a second mounting comes first, and what it may bring."""
    answer = ranking.answer
    unit = f" {answer.unit}" if answer.unit else ""
    return [
        f"Remount the cable and measure {second.words} next: all readings come from one mounting, which cannot show how "
        "far mountings differ.",
        f"Then the 90 % interval of {answer.words} would be about {format_width(second.width)}{unit} wide, now "
        f"{format_width(second.width_now)}{unit}. How the second mounting turns out decides: 90 % of the outcomes leave "
        f"{significant(second.low, 1)} to {significant(second.high, 1)}{unit}.",
    ]


def format_width(width: float) -> str:
    """Return a width to one digit, or two where the first is 1: another seed moves it by a twentieth."""
    return significant(width, 2 if f"{width:e}".startswith("1") else 1)


def _format_sd(ranking: NextMeasurement, sd: float) -> str:
    """Return a standard deviation with the answer's unit."""
    unit = f" {ranking.answer.unit}" if ranking.answer.unit else ""
    return f"± {sd:.{_count_decimals(ranking)}f}{unit}"


def _count_decimals(ranking: NextMeasurement) -> int:
    """Return the decimals of standard deviations: two significant digits, or three where the best candidate changes little."""
    usual, change = decimals(ranking.answer.sd), ranking.answer.sd - ranking.ranked[0].sd
    return min(max(usual, decimals(change) - 1), usual + 1) if change > 0 else usual


def _advice_sentences(ranking: NextMeasurement) -> list[str]:
    """Say what to measure, at which load, and what would do equally well."""
    best, answer = ranking.best, ranking.answer
    if best is None:
        first = ranking.ranked[0]
        return [
            f"None of these measurements would narrow {answer.words} noticeably: it is known to "
            f"{_format_sd(ranking, answer.sd)}, and "
            f"to {_format_sd(ranking, first.sd)} after the best of them, {first.words}.",
            "One more reading of a kind that was measured many times adds little; name another kind with --candidate, or "
            "ask for another answer with --for.",
        ]
    per_cost = " for its cost" if best.cost is not None else ""
    lines = [
        f"Measure {best.words} next{per_cost}{_mounting_and_loads(ranking, best)}. That would narrow {answer.words} from "
        f"{_format_sd(ranking, answer.sd)} to {_format_sd(ranking, best.sd)}."
    ]
    equally_good = [r for r in ranking.ranked if r.as_good and r is not best]
    if equally_good:
        named = [r.words[0].upper() + r.words[1:] if i == 0 else r.words for i, r in enumerate(equally_good)]
        lines.append(f"{few(named, _MAX_NAMED)} would do equally well.")
    return lines


def _mounting_and_loads(ranking: NextMeasurement, best: RankedCandidate) -> str:
    """Say that the cable is to be mounted anew, and at which loads, where neither is said already."""
    if not candidate_kinds()[best.candidate.kind].mounted_anew:
        return ""
    if ranking.loads is None or math.isfinite(best.candidate.load):
        return ", after remounting the cable"
    low, high = map(significant, ranking.loads)
    loads = f"{low} N" if low == high else f"{low} to {high} N as so far"
    return f", after remounting the cable, at {loads}"


def _load_and_stroke_sentences(ranking: NextMeasurement) -> list[str]:
    """Say at which load and of which stroke its readings help most, against the same number of them as usual."""
    within = ranking.within
    if within is None:
        return []
    usual = next(r for r in within.ranked if r.name == ranking.ranked[0].name)
    best, worst = within.ranked[0], within.ranked[-1]
    remark = f"That is a run like those made so far: {within.usual}."
    if worst.as_good or (usual.as_good and len({r.as_good for r in within.ranked}) == 1):
        return [
            f"{remark} Which load and stroke they are taken at makes no difference beyond the error of this estimate."
        ]
    if usual.as_good:
        return [
            f"{remark} No other load or stroke does better beyond the error of this estimate; as many "
            f"{_describe_design(worst)} would "
            f"leave {_format_sd(ranking, worst.sd)}."
        ]
    return [
        f"{remark} As many readings {_describe_design(best)} would help most: they leave {_format_sd(ranking, best.sd)}, the "
        f"usual ones {_format_sd(ranking, usual.sd)}, and readings {_describe_design(worst)} {_format_sd(ranking, worst.sd)}; "
        f"name them with --candidate {best.name}."
    ]


def _describe_design(ranked: RankedCandidate) -> str:
    """Return load and stroke in words, as 'at 64 N while pulling'."""
    load, stroke = ranked.candidate.load, ranked.candidate.stroke
    way = f"while {STROKE_WORDS[stroke]}" if stroke else "of both strokes"
    return f"all at {significant(load)} N {way}"


def _plan_sentences(ranking: NextMeasurement) -> list[str]:
    """Say what would be best after the best candidate."""
    after = [
        f"{step.words}{' again' if step.name in [s.name for s in ranking.plan[:i]] else ''} ({_format_sd(ranking, step.sd)})"
        for i, step in enumerate(ranking.plan)
    ][1:]
    return [f"After it, {', then '.join(after)}."] if after else []


def _repeat_sentences(ranking: NextMeasurement) -> list[str]:
    """Say how often the best candidate would have to be measured to halve the uncertainty."""
    best, repeats = ranking.best, ranking.repeats
    if best is None or repeats is None:
        return []
    half, largest = repeats.to_halve(ranking.answer.sd), repeats.times[-1]
    if half == 1:
        return []
    if half is not None:
        return [f"Measuring only {best.words}, about {half} times, would halve the uncertainty."]
    still = _format_sd(ranking, repeats.sd[-1])
    return [f"Measuring only {best.words} would not halve the uncertainty: after {largest} times it would still be {still}."]


def ranking_table(ranking: NextMeasurement, top: int) -> tuple[list[str], list[list[str]]]:
    """Return heads and rows of so many of the best candidates."""
    best = ranking.ranked[:top]
    unit = f" ({ranking.answer.unit})" if ranking.answer.unit else ""
    digits = _count_decimals(ranking)
    heads = ["measurement", f"then known to{unit}", "uncertainty lower by"]
    rows = [[r.name, f"± {r.sd:z.{digits}f}", percent(1 - r.sd / ranking.answer.sd)] for r in best]
    if any(r.cost is not None for r in best):
        heads += ["cost", "variance lower by, per cost"]
        rows = [[*row, f"{r.cost:g}", percent(r.worth, 2)] for row, r in zip(rows, best, strict=True)]
    return heads, rows
