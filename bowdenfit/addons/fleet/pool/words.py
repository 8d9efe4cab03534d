"""Texts, captions and page of a pooled fleet: what `bowdenfit pool` prints and writes."""

import math

from bowdenfit.addons.fleet.pool.answer import Effect, Life, Pool, PooledCable
from bowdenfit.display import Block, ResultTable, blocks_of, separate
from bowdenfit.inference.interval import Interval
from bowdenfit.pages.section import HtmlPage, PageTable, Picture, prose_section
from bowdenfit.words import counted, decimals, few, listed, percent

HEADINGS = {
    "pooled-coefficients": "Cables shrunk toward the population",
    "pooled-wear": "Wear",
    "pooled-life": "How many have failed",
}
_NAMED, _SHOWN = 5, 12  # unlike cables, and cables in the table; judgements
_SURE = 0.999  # probability beyond which draws are too few to say more
_INDISTINGUISHABLE = 0.1  # 5 % of a spread over its 95 %, below which it cannot be told from none; a judgement
_UNRELATED = 5.0  # 95 % of new cables over their 5 %, above which one cable tells little of another; a judgement


@blocks_of.register(Pool)
def pool_blocks(pool: Pool) -> list[Block]:
    """Return a pooled fleet for people: life or wear first, then who is unlike, what to inspect, and the numbers."""
    return separate(
        [headline(pool)],
        [*trust_sentences(pool), *life_sentences(pool), *outlier_sentences(pool)],
        next_sentences(pool),
        effect_sentences(pool),
        [ResultTable(*population_rows(pool))],
        [explain_columns(pool)],
        _cable_table(pool),
        pool.notes,
    )


def headline(pool: Pool) -> str:
    """Return the answer in a sentence."""
    who = f"{pool.name}: " if pool.name else ""
    if pool.limit is not None and pool.new_cable is not None:
        until = percent(pool.limit.efficiency, 0)
        early = f"one in twenty does before {_format_cycles(pool.new_cable.q05)}"
        if math.isinf(pool.new_cable.median):
            return f"{who}more likely than not a new cable never falls below {until}; {early}."
        return f"{who}a new cable falls below {until} after {_format_cycles(pool.new_cable.median)}; {early}."
    wear = pool.wear.share if pool.wear is not None else None
    if len(pool.cables) == 1:  # of which the middle of a population tells little
        wear = pool.cables[0].wear
    if wear is not None:
        way = "grows" if wear.median >= 0 else "falls"
        return f"{who}friction {way} by {_format_share(wear)} in {_format_cycles(pool.reference_cycles)}."
    name, first = next(iter(pool.typical.items()))
    value = f"{first.median:z.{decimals(first.sd)}f} (90 % interval {_format_bounds(first)})"
    return f"{who}{name} is {value} in the middle of {_count_cables(pool)}."


def trust_sentences(pool: Pool) -> list[str]:
    """Say why the answer must not be trusted; empty if it may."""
    return [f"DO NOT USE these numbers: {reason}." for reason in pool.reasons[:2]]


def life_sentences(pool: Pool) -> list[str]:
    """Say how long cables last that are in use."""
    if pool.limit is None:
        return []
    limit, lives = pool.limit, [(cable, cable.life) for cable in pool.cables if cable.life is not None]
    lines = []
    if limit.cycles is not None:
        count = _format_cycles(limit.cycles)
        likely = [(cable, life) for cable, life in lives if (life.fails or 0) > 0.5]
        worst = sorted(lives, key=lambda pair: pair[1].median)
        named = listed([f"{cable.cable} ({_format_life(life)})" for cable, life in worst[:3]])
        who = f"the first are {named}" if len(worst) > 1 else f"it lasts {_format_life(worst[0][1])}"
        lines.append(
            f"Before {count}, {len(likely)} of {_count_cables(pool)} fall below {percent(limit.efficiency, 0)} more likely "
            f"than not; {who}."
        )
        if pool.new_cable is not None:
            lines.append(f"A new one does so with probability {_format_probability(pool.new_cable.fails)}.")
    else:
        first = min(lives, key=lambda pair: (pair[1].median, pair[0].cable))
        lines.append(f"The first to do so is expected to be {first[0].cable}, after {_format_life(first[1])}.")
    if pool.new_cable is not None and pool.new_cable.extrapolated:
        lines.append(
            f"No cable was inspected after more than {_format_cycles(pool.reference_cycles)}: beyond that wear is assumed to "
            "go on as before."
        )
    lines.append("If cables were taken out of use because they were bad, lives are longer here than they are.")
    return lines


def outlier_sentences(pool: Pool) -> list[str]:
    """Say which cables are unlike the rest."""
    if len(pool.cables) == 1:
        return []
    lines = [
        f"{cable.cable} is an outlier: {cable.departure} (by chance in {_format_probability(cable.p_value)} of such fleets)."
        for cable in pool.outliers[:_NAMED]
    ]
    if len(pool.outliers) > _NAMED:
        lines.append(f"So are {counted(len(pool.outliers) - _NAMED, 'other')}, in the JSON.")
    lines += _outlier_treatment_sentences(pool)
    if pool.mixtures:
        names = listed(list(pool.mixtures))
        lines.append(
            f"These cables do not look like one population in {names}: there are clusters or outliers, as where cables of two "
            "makes are pooled. Pool each make by itself; otherwise the prediction for a new cable is wrong."
        )
    return [*(lines or ["No cable is an outlier."]), *homogeneity_sentences(pool)]


def _outlier_treatment_sentences(pool: Pool) -> list[str]:
    """Say by what cables that are outliers are shown."""
    if not pool.outliers:
        return []
    shown = "It is shown by its" if len(pool.outliers) == 1 else "They are shown by their"
    lines = [
        f"{shown} own inspections alone, not shrunk toward the population; what cables have in common and a new cable are said "
        f"without {'it' if len(pool.outliers) == 1 else 'them'}."
    ]
    borrowed = [cable.cable for cable in pool.outliers if cable.pooled]
    if borrowed:
        lines.append(f"Only the wear of {few(borrowed)} is that of the others, as their own inspections do not determine it.")
    return lines


def homogeneity_sentences(pool: Pool) -> list[str]:
    """Whether all cables are alike, or all unlike."""
    if pool.spreads and all(spread.q05 < _INDISTINGUISHABLE * spread.q95 for spread in pool.spreads.values()):
        most = max(pool.spreads.values(), key=lambda spread: spread.q95)
        return [f"As far as these inspections show, all cables are alike: they differ by at most {percent(most.q95)}."]
    apart = {name: new for name, new in pool.coefficients.items() if new.q95 > _UNRELATED * new.q05}
    if not apart or pool.outliers or pool.mixtures:  # a few that stand apart are said by name
        return []
    named = listed([f"{name} ({new.q05:.2g} to {new.q95:.2g} of nine in ten)" for name, new in apart.items()])
    return [
        f"All cables differ in {named}: one of them says little about another, and none is shrunk toward a common mean."
    ]


def next_sentences(pool: Pool) -> list[str]:
    """Say what to inspect next."""
    if not pool.next_inspections:
        return []
    best = pool.next_inspections[0]
    if best.probability is not None and pool.limit is not None:
        what = (
            f"it fails before {_format_cycles(pool.limit.cycles or 0)} with probability "
            f"{_format_probability(best.probability)}, and no other inspection would say more"
        )
    else:
        what = (
            f"that would narrow its wear in {_format_cycles(pool.reference_cycles)} from ± {percent(best.before)} to ± "
            f"{percent(best.after)}"
        )
    return [f"Inspect {best.cable} next, after {_format_cycles(best.cycles)}: {what}."]


def effect_sentences(pool: Pool) -> list[str]:
    """Say what changes friction."""
    lines = []
    if pool.wear is not None and pool.new_cable is not None:
        cycles = _format_cycles(pool.reference_cycles)
        lines.append(f"Friction {_verb_of_change(pool.wear)} by {_format_share(pool.wear.share)} in {cycles}.")
    for effect in pool.effects:
        if effect.name == "lubrication":
            lines.append(f"Where a cable was lubricated friction {_verb_of_change(effect)} by {_format_share(effect.share)}.")
        else:
            lines.append(f"Friction {_verb_of_change(effect)} by {_format_share(effect.share, 2)} a degree.")
    return lines


def population_rows(pool: Pool) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Return heads and rows of the population."""
    heads = ("quantity", "typical", "from", "to", "between cables", "new cable from", "to")
    rows = []
    for name, typical in pool.typical.items():
        digits, new, spread = decimals(typical.sd), pool.coefficients.get(name), pool.spreads.get(name)
        rows.append(
            (name, *(f"{value:z.{digits}f}" for value in (typical.median, typical.q05, typical.q95)),
             f"{100 * spread.median:.0f} %" if spread else "",
             f"{new.q05:z.{digits}f}" if new else "", f"{new.q95:z.{digits}f}" if new else "")
        )  # fmt: skip
    return heads, rows


def explain_columns(pool: Pool) -> str:
    """Say what the columns are."""
    dry = "dry " if any(effect.name == "lubrication" for effect in pool.effects) else ""
    warm = (
        f"at {pool.reference_temperature:g} °C " if any(effect.name == "per_degree" for effect in pool.effects) else ""
    )
    state = f", when new {dry}{warm}".rstrip() if pool.wear is not None else ""
    if len(pool.cables) == 1:
        return f"Typical: the middle of what is likely{state} after this cable alone, median and 90 % interval."
    return (
        f"Typical: the middle of the population{state}, median and 90 % interval. Between cables: the standard deviation of "
        "one cable from another. A new cable lies in the last interval nine times in ten."
    )


def cable_rows(pool: Pool) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Return heads and rows of the cables."""
    names = list(pool.typical)[:2]
    wears, lives = pool.wear is not None, pool.limit is not None
    with_failures = lives and pool.limit is not None and pool.limit.cycles is not None
    heads = [
        "cable",
        *names,
        *(["wear"] if wears else []),
        *(["life"] if lives else []),
        *(["fails"] if with_failures else []),
        "",
    ]
    rows = []
    for cable in pool.cables:
        cells = [_format_interval(cable.coefficients.get(name), bare=lives) for name in names]
        cells += [_format_interval(cable.wear, 100, " %")] if wears else []
        cells += [_format_cycles(cable.life.median, bare=True)] if cable.life else []
        cells += [_format_probability(cable.life.fails)] if cable.life and with_failures else []
        rows.append((cable.cable, *cells, "outlier" if cable.departure else ""))
    return tuple(heads), rows


def _cable_table(pool: Pool) -> list[Block]:
    """Return the cables that matter most in a table."""
    heads, rows = cable_rows(pool)
    order = sorted(range(len(rows)), key=lambda i: _rank_importance(pool.cables[i]))
    shown = sorted(order[:_SHOWN])
    more = f"... and {len(rows) - len(shown)} more; --csv and --json have all" if len(shown) < len(rows) else ""
    return [ResultTable(heads, [rows[i] for i in shown], left=("",)), more]


def _rank_importance(cable: PooledCable) -> tuple[float, float]:
    life = cable.life
    return (-1.0 if cable.departure else 0.0, life.median if life else -(cable.wear.median if cable.wear else 0.0))


def _format_interval(interval: Interval | None, times: float = 1.0, unit: str = "", bare: bool = False) -> str:
    if interval is None:
        return ""
    digits = decimals(times * interval.sd)
    if bare:
        return f"{times * interval.median:z.{digits}f}{unit}"
    return f"{times * interval.median:z.{digits}f} ± {times * interval.sd:z.{digits}f}{unit}"


def _verb_of_change(effect: Effect) -> str:
    return "grows" if effect.share.median >= 0 else "falls"


def _format_share(share: Interval, digits: int = 1) -> str:
    low, high = sorted((abs(share.q05), abs(share.q95))) if share.q05 * share.q95 > 0 else (share.q05, share.q95)
    return f"{percent(abs(share.median), digits)} ({percent(low, digits)} to {percent(high, digits)})"


def _format_bounds(interval: Interval) -> str:
    return interval.range_text(decimals(interval.sd))


def _format_life(life: Life) -> str:
    return _format_cycles(life.median)


def _format_cycles(count: float, bare: bool = False) -> str:
    """Return a count to three digits, in words."""
    if math.isinf(count):
        return "for ever"
    digits = max(0, len(str(int(count))) - 3)
    text = f"{round(count, -digits):,.0f}"
    return text if bare else f"{text} cycles"


def _format_probability(p: float | None) -> str:
    if p is None:
        return ""
    if p < 1 - _SURE:
        return f"below {1 - _SURE:.3f}"
    return f"above {_SURE}" if p > _SURE else f"{p:.2g}"


def _count_cables(pool: Pool) -> str:
    return counted(len(pool.cables), "cable")


def captions(pool: Pool) -> dict[str, str]:
    """Say what each figure shows, in plain words."""
    limit = pool.limit
    what = f"efficiency falls below {100 * limit.efficiency:g} %" if limit is not None else ""
    return {
        "pooled-coefficients": (
            "Each cable by itself from its first inspection (open), and shrunk toward the population as far as its own "
            "inspections leave it open (filled, with 90 % interval); gray: where nine of ten new cables lie. n = "
            f"{len(pool.cables)} cables; orange: outliers, by their own inspections alone."
        ),
        "pooled-wear": (
            f"{'Efficiency' if limit else 'Friction over that of the new cable'} of each cable (thin) and of a new one (thick, "
            f"with 90 % interval), dry and at {pool.reference_temperature:g} °C. n = {len(pool.cables)} cables, inspected up "
            "to the dotted line; beyond it wear is assumed to go on as before."
        ),
        "pooled-life": (
            f"Probability that {what} before a number of cycles: of each cable (thin) and of a new one (thick). n = "
            f"{len(pool.cables)} cables."
        ),
    }


def pool_page(pool: Pool) -> HtmlPage:
    """Return the page of a pooled fleet.

    Args:
        pool: The pooled fleet.
    """
    texts = captions(pool)
    pictures = {name: Picture(name, heading, texts[name]) for name, heading in HEADINGS.items()}
    heads, rows = population_rows(pool)
    cable_heads, cables = cable_rows(pool)
    left_out = [f"{inspection.inspection}: {inspection.why}." for inspection in pool.left_out]
    sections = (
        prose_section(
            "The answer",
            [*trust_sentences(pool), *life_sentences(pool), *outlier_sentences(pool), *next_sentences(pool)],
            headline=headline(pool),
            pictures=(pictures["pooled-life"], pictures["pooled-wear"]),
        ),
        prose_section(
            "What cables have in common", [*effect_sentences(pool), explain_columns(pool)], [PageTable(heads, tuple(rows))]
        ),
        prose_section(
            "Every cable",
            [
                "Shrunk toward the population as far as its own inspections leave it open, or by its own inspections alone if "
                "it is an outlier; median ± standard deviation."
            ],
            [PageTable(cable_heads, tuple(cables))],
            pictures=(pictures["pooled-coefficients"],),
        ),
        prose_section("What is not estimated", pool.notes or ["Everything that was measured is pooled."], items=left_out),
    )
    return HtmlPage(pool.name or "Fleet", f"Pooled by bowdenfit; seed {pool.seed}", sections)
