"""What `bowdenfit pool` prints."""

import math

from bowdenfit.display import text_of
from bowdenfit.inference.interval import Interval
from bowdenfit.questions.pool.answer import Effect, Life, Pool, PooledCable
from bowdenfit.words import counted, decimals, few, filled, listed, percent, table

_NAMED, _SHOWN = 5, 12  # unlike cables, and cables in the table
_SURE = 0.999
_NONE = 0.1  # 5 % of a spread over its 95 %, below which it cannot be told from none
_ANY = 5.0  # 95 % of new cables over their 5 %, above which one cable tells little of another


@text_of.register(Pool)
def pool_text(found: Pool) -> str:
    """A pooled fleet for people: life or wear first, then who is unlike, what to inspect, and the numbers."""
    blocks = [
        filled(headline(found)),
        "\n".join(filled(line) for line in (*trust_sentences(found), *life_sentences(found), *unlike_sentences(found))),
        "\n".join(filled(line) for line in next_sentences(found)),
        "\n".join(filled(line) for line in effect_sentences(found)),
        table(*population_rows(found)) + "\n\n" + filled(how_to_read(found)),
        _cables(found),
        "\n".join(filled(line) for line in found.notes),
    ]
    return "\n\n".join(block for block in blocks if block.strip()) + "\n"


def headline(found: Pool) -> str:
    """The answer in a sentence."""
    who = f"{found.name}: " if found.name else ""
    if found.asked is not None and found.new is not None:
        until = percent(found.asked.efficiency, 0)
        early = f"one in twenty does before {_cycles(found.new.q05)}"
        if math.isinf(found.new.median):
            return f"{who}more likely than not a new cable never falls below {until}; {early}."
        return f"{who}a new cable falls below {until} after {_cycles(found.new.median)}; {early}."
    wear = found.wear.share if found.wear is not None else None
    if len(found.cables) == 1:  # of which the middle of a population tells little
        wear = found.cables[0].wear
    if wear is not None:
        way = "grows" if wear.median >= 0 else "falls"
        return f"{who}friction {way} by {_share(wear)} in {_cycles(found.reference_cycles)}."
    name, first = next(iter(found.typical.items()))
    value = f"{first.median:z.{decimals(first.sd)}f} (90 % interval {_range(first)})"
    return f"{who}{name} is {value} in the middle of {_many(found)}."


def trust_sentences(found: Pool) -> list[str]:
    """Why the answer must not be trusted; empty if it may."""
    return [f"DO NOT USE these numbers: {reason}." for reason in found.reasons[:2]]


def life_sentences(found: Pool) -> list[str]:
    """Of cables that are in use."""
    if found.asked is None:
        return []
    asked, lives = found.asked, [(each, each.life) for each in found.cables if each.life is not None]
    lines = []
    if asked.cycles is not None:
        count = _cycles(asked.cycles)
        likely = [(each, life) for each, life in lives if (life.fails or 0) > 0.5]
        worst = sorted(lives, key=lambda pair: pair[1].median)
        named = listed([f"{each.cable} ({_life(life)})" for each, life in worst[:3]])
        who = f"the first are {named}" if len(worst) > 1 else f"it lasts {_life(worst[0][1])}"
        lines.append(
            f"Before {count}, {len(likely)} of {_many(found)} fall below {percent(asked.efficiency, 0)} more likely than not; "
            f"{who}."
        )
        if found.new is not None:
            lines.append(f"A new one does so with probability {_probability(found.new.fails)}.")
    else:
        first = min(lives, key=lambda pair: (pair[1].median, pair[0].cable))
        lines.append(f"The first to do so is expected to be {first[0].cable}, after {_life(first[1])}.")
    if found.new is not None and found.new.extrapolated:
        lines.append(
            f"No cable was inspected after more than {_cycles(found.reference_cycles)}: beyond that wear is taken to go on as "
            "it did."
        )
    lines.append("If cables were taken out of use because they were bad, lives are longer here than they are.")
    return lines


def unlike_sentences(found: Pool) -> list[str]:
    """Which cables are unlike the rest."""
    if len(found.cables) == 1:
        return []
    lines = [
        f"{each.cable} is unlike the rest: {each.unlike} (by chance in {_probability(each.chance)} of such fleets)."
        for each in found.unlike[:_NAMED]
    ]
    if len(found.unlike) > _NAMED:
        lines.append(f"So are {counted(len(found.unlike) - _NAMED, 'other')}, in the JSON.")
    lines += _apart_sentences(found)
    if found.mixed:
        names = listed(list(found.mixed))
        lines.append(
            f"These cables do not look like one population in {names}: there are heaps or stragglers, as where cables of two "
            "makes are pooled. Pool each make by itself, or a new cable is not what is said here."
        )
    return [*(lines or ["No cable is unlike the rest."]), *kind_sentences(found)]


def _apart_sentences(found: Pool) -> list[str]:
    """By what cables that are unlike the rest are shown."""
    if not found.unlike:
        return []
    shown = "It is shown by its" if len(found.unlike) == 1 else "They are shown by their"
    lines = [
        f"{shown} own inspections alone, not drawn toward the others; what cables have in common and a new cable are said "
        f"without {'it' if len(found.unlike) == 1 else 'them'}."
    ]
    borrowed = [each.cable for each in found.unlike if each.pooled]
    if borrowed:
        lines.append(f"Only the wear of {few(borrowed)} is that of the others, because no own inspections tell it.")
    return lines


def kind_sentences(found: Pool) -> list[str]:
    """Whether all cables are alike, or all unlike."""
    if found.spreads and all(each.q05 < _NONE * each.q95 for each in found.spreads.values()):
        most = max(found.spreads.values(), key=lambda each: each.q95)
        return [f"As far as these inspections tell all cables are alike: they differ by at most {percent(most.q95)}."]
    apart = {name: new for name, new in found.coefficients.items() if new.q95 > _ANY * new.q05}
    if not apart or found.unlike or found.mixed:  # a few that stand apart are said by name
        return []
    named = listed([f"{name} ({new.q05:.2g} to {new.q95:.2g} of nine in ten)" for name, new in apart.items()])
    return [f"All cables are unlike in {named}: one of them tells little of another, and nothing is drawn toward a middle."]


def next_sentences(found: Pool) -> list[str]:
    """What to inspect next."""
    if not found.next:
        return []
    best = found.next[0]
    if best.probability is not None and found.asked is not None:
        what = (
            f"it fails before {_cycles(found.asked.cycles or 0)} with probability {_probability(best.probability)}, and no "
            "other inspection settles as much"
        )
    else:
        what = (
            f"its wear in {_cycles(found.reference_cycles)} would be known to ± {percent(best.after)}, and is to ± "
            f"{percent(best.before)}"
        )
    return [f"Inspect {best.cable} next, after {_cycles(best.cycles)}: {what}."]


def effect_sentences(found: Pool) -> list[str]:
    """What changes friction."""
    lines = []
    if found.wear is not None and found.new is not None:
        lines.append(f"Friction {_way(found.wear)} by {_share(found.wear.share)} in {_cycles(found.reference_cycles)}.")
    for effect in found.effects:
        if effect.name == "lubrication":
            lines.append(f"Where a cable was lubricated friction {_way(effect)} by {_share(effect.share)}.")
        else:
            lines.append(f"Friction {_way(effect)} by {_share(effect.share, 2)} a degree.")
    return lines


def population_rows(found: Pool) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Heads and rows of the population."""
    heads = ("quantity", "typical", "from", "to", "between cables", "new cable from", "to")
    rows = []
    for name, typical in found.typical.items():
        digits, new, spread = decimals(typical.sd), found.coefficients.get(name), found.spreads.get(name)
        rows.append(
            (name, *(f"{value:z.{digits}f}" for value in (typical.median, typical.q05, typical.q95)),
             f"{100 * spread.median:.0f} %" if spread else "",
             f"{new.q05:z.{digits}f}" if new else "", f"{new.q95:z.{digits}f}" if new else "")
        )  # fmt: skip
    return heads, rows


def how_to_read(found: Pool) -> str:
    """What the columns are."""
    dry = "dry " if any(each.name == "lubrication" for each in found.effects) else ""
    warm = f"at {found.reference_temperature:g} °C " if any(each.name == "per_degree" for each in found.effects) else ""
    state = f", when new {dry}{warm}".rstrip() if found.wear is not None else ""
    if len(found.cables) == 1:
        return f"Typical: the middle of what is likely{state} after this cable alone, median and 90 % interval."
    return (
        f"Typical: the middle of the population{state}, median and 90 % interval. Between cables: the standard deviation of "
        "one cable from another. A new cable lies in the last interval nine times in ten."
    )


def cable_rows(found: Pool) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Heads and rows of the cables."""
    names = list(found.typical)[:2]
    wears, lives = found.wear is not None, found.asked is not None
    counted_ = lives and found.asked is not None and found.asked.cycles is not None
    heads = ["cable", *names, *(["wear"] if wears else []), *(["life"] if lives else []), *(["fails"] if counted_ else []), ""]
    rows = []
    for each in found.cables:
        cells = [_short(each.coefficients.get(name), bare=lives) for name in names]
        cells += [_short(each.wear, 100, " %")] if wears else []
        cells += [_cycles(each.life.median, bare=True)] if each.life else []
        cells += [_probability(each.life.fails)] if each.life and counted_ else []
        rows.append((each.cable, *cells, "unlike" if each.unlike else ""))
    return tuple(heads), rows


def _cables(found: Pool) -> str:
    """The cables that matter most in a table."""
    heads, rows = cable_rows(found)
    order = sorted(range(len(rows)), key=lambda i: _importance(found.cables[i]))
    shown = sorted(order[:_SHOWN])
    more = f"\n... and {len(rows) - len(shown)} more; --csv and --json have all" if len(shown) < len(rows) else ""
    return table(heads, [rows[i] for i in shown], left=("",)) + more


def _importance(cable: PooledCable) -> tuple[float, float]:
    life = cable.life
    return (-1.0 if cable.unlike else 0.0, life.median if life else -(cable.wear.median if cable.wear else 0.0))


def _short(interval: Interval | None, times: float = 1.0, unit: str = "", bare: bool = False) -> str:
    if interval is None:
        return ""
    digits = decimals(times * interval.sd)
    if bare:
        return f"{times * interval.median:z.{digits}f}{unit}"
    return f"{times * interval.median:z.{digits}f} ± {times * interval.sd:z.{digits}f}{unit}"


def _way(effect: Effect) -> str:
    return "grows" if effect.share.median >= 0 else "falls"


def _share(share: Interval, digits: int = 1) -> str:
    low, high = sorted((abs(share.q05), abs(share.q95))) if share.q05 * share.q95 > 0 else (share.q05, share.q95)
    return f"{percent(abs(share.median), digits)} ({percent(low, digits)} to {percent(high, digits)})"


def _range(interval: Interval) -> str:
    digits = decimals(interval.sd)
    return f"{interval.q05:z.{digits}f} to {interval.q95:z.{digits}f}"


def _life(life: Life) -> str:
    return _cycles(life.median)


def _cycles(count: float, bare: bool = False) -> str:
    """A count to three digits, in words."""
    if math.isinf(count):
        return "for ever"
    digits = max(0, len(str(int(count))) - 3)
    text = f"{round(count, -digits):,.0f}"
    return text if bare else f"{text} cycles"


def _probability(p: float | None) -> str:
    if p is None:
        return ""
    if p < 1 - _SURE:
        return f"below {1 - _SURE:.3f}"
    return f"above {_SURE}" if p > _SURE else f"{p:.2g}"


def _many(found: Pool) -> str:
    return counted(len(found.cables), "cable")
