"""What `bowdenfit identify` prints."""

from collections.abc import Mapping

from bowdenfit.display import text_of
from bowdenfit.inference.identifiability import (
    IDENTIFIABLE,
    PRIOR_DOMINATED,
    Combination,
    CovarianceAnalysis,
    ParameterContraction,
)
from bowdenfit.questions.identify.answer import CURVES, Identifiability
from bowdenfit.words import decimals, filled, legend, narrow_table, percent

_HARD = 1000.0  # condition number beyond which parameters are hardly told apart
_ALIKE = 0.9  # correlation beyond which two of them are


@text_of.register(Identifiability)
def identifiability_text(found: Identifiability) -> str:
    """What measurements determine, for people: the answer first, then parameters and combinations."""
    first, *others = found.sentences() or ["There is nothing to determine."]
    blocks = ["\n".join(filled(sentence) for sentence in [f"{found.name}: {first[0].lower()}{first[1:]}", *others])]
    for name, group in found.groups.items():
        units = found.units if name != CURVES else {}  # of which numbers on a logarithmic scale have none that people know
        blocks.append(_parameters(name, group, units))
        if name != CURVES:
            blocks.append(_directions(group))
    named = {p.name for group in found.groups.values() for p in group.parameters}
    blocks.append(legend({name: what for name, what in found.meanings.items() if name in named}))
    blocks.append(
        filled(
            f"Judged at {found.basis}. ± is one standard deviation, now and before anything was measured; told by: who settles "
            "the value, and how much of what was open before."
        )
    )
    return "\n\n".join(block for block in blocks if block) + "\n"


def _parameters(name: str, group: CovarianceAnalysis, units: Mapping[str, str]) -> str:
    heads: tuple[str, ...] = ("", "value", "known to", "before", "unit", "told by")
    unit = {p.name: units.get(p.name, "1") for p in group.parameters}
    rows: list[tuple[str, ...]] = [
        (p.name, *_numbers(p), "" if unit[p.name] == "1" else unit[p.name], _informed(p.share)) for p in group.parameters
    ]
    if set(unit.values()) <= {"1"}:
        heads, rows = (*heads[:4], *heads[5:]), [(*row[:4], *row[5:]) for row in rows]
    said = f"{name[0].upper() + name[1:]}, one by one\n" + narrow_table(heads, rows, left=("unit", "told by"))
    alike = [sorted((p.name, p.most_correlated)) for p in group.parameters if abs(p.correlation) > _ALIKE]
    pairs = [f"{first} and {second}" for first, second in dict.fromkeys(map(tuple, alike))]
    if len(group.parameters) > 1 and not group.collinearity < _HARD:
        pairs = [*pairs, "all of them together"]
    return "\n".join([said, filled(f"Hard to tell apart: {'; '.join(pairs)}.")]) if pairs else said


def _numbers(p: ParameterContraction) -> tuple[str, str, str]:
    digits = decimals(p.sd)
    return f"{p.value:z.{digits}f}", f"± {p.sd:z.{digits}f}", f"± {p.prior_sd:z.{digits}f}"


def _informed(share: float) -> str:
    """What settles it: measurements, or what was assumed before."""
    if share < IDENTIFIABLE:
        return f"measurements ({percent(1 - share, 0)})"
    return f"assumption ({percent(share, 0)})" if share > PRIOR_DOMINATED else f"both (assumption {percent(share, 0)})"


def _directions(group: CovarianceAnalysis) -> str:
    """Independent combinations, the best determined first; of a single parameter there is nothing more to say."""
    if len(group.directions) < 2:
        return ""
    rows = [(d.words, *_sum(d)) for d in group.directions]
    return "Independent sums, the best determined first\n" + narrow_table(("", "value", "known to"), rows)


def _sum(d: Combination) -> tuple[str, str]:
    digits = decimals(d.sd)
    return f"{d.value:z.{digits}f}", f"± {d.sd:z.{digits}f}"
