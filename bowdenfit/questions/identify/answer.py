"""What the measurements of a cable determine, before any force is measured and after a fit, in words; loads no model."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar

from bowdenfit.display import Block, Display, Legend, ResultTable, Rows, blocks_of, separate
from bowdenfit.inference.identifiability import (
    IDENTIFIABLE,
    PRIOR_DOMINATED,
    Combination,
    CovarianceAnalysis,
    ParameterContraction,
)
from bowdenfit.results.serialization import deserialize, values_by_key
from bowdenfit.words import capitalized, decimals, listed, percent, significant

if TYPE_CHECKING:
    from bowdenfit.inference.profiles import Profile

# Parameters that friction is made of, and those of the rope's elasticity: each group is judged by itself.
CURVES = "wrap angle curves"
GROUPS: Mapping[str, tuple[str, ...]] = {
    "friction": ("friction", "friction_model", "sensor", "angle"),
    "elastic": ("elastic",),
    CURVES: ("curve",),
}
_REMEDY = (
    "Coefficients rub at the same time, so only their weighted sum is seen; they come apart where the wrap angles change in "
    "different proportions: measure at lengths (or routes) where one contact turns much more than the others, or measure one "
    "coefficient separately and state it under [friction.NAME] as measured."
)
_COLLINEAR = 1000.0  # condition number beyond which parameters are hardly distinguished; a judgement
_CORRELATED = 0.9  # correlation beyond which two of them are hardly distinguished; a judgement


@dataclass(frozen=True, repr=False)
class Identifiability(Display):
    """What is known of the parameters of a cable, by group.

    Args:
        name: Name of the cable.
        basis: Where it was judged, in words.
        measured: Whether readings entered, or only the plan of what to measure.
        groups: Knowledge by group of `GROUPS`, as far as there are such parameters.
        profiles: How the sum of squares of the readings rises with each friction coefficient, the others fitted again.
        units: Units of the parameters.
        meanings: Meanings of the parameters, in words.
    """

    name: str
    basis: str
    measured: bool
    groups: dict[str, CovarianceAnalysis]
    profiles: "tuple[Profile, ...]" = ()
    units: Mapping[str, str] = field(default_factory=dict)
    meanings: Mapping[str, str] = field(default_factory=dict)

    JSON: ClassVar = ("name", "basis", "sentences", "groups", ("profiles", "rises"))

    def sentences(self) -> list[str]:
        """Describe what is known: friction first, and a remedy where something is not."""
        friction, elastic = (self.groups.get(group) for group in ("friction", "elastic"))
        sentences = [describe_identified(friction, self.measured)] if friction else []
        if elastic is not None:
            sentences.append(describe_identified(elastic, self.measured, "For the cable's compliance, they determine"))
        if friction is not None and (friction.undetermined or friction.determined):
            sentences.append(_REMEDY)
        return sentences

    def _table(self) -> Rows:
        rows = [
            {"parameter": p.name, "group": name} | values_by_key(p)
            for name, group in self.groups.items()
            for p in group.parameters
        ]
        return [{key: value for key, value in row.items() if key != "name"} for row in rows], self.units

    @property
    def rises(self) -> dict[str, dict[str, Any]]:
        """Profiles by the name of their coefficient."""
        return {p.name: {"value": p.values, "rise": p.rise} for p in self.profiles}


def describe_identified(analysis: CovarianceAnalysis, measured: bool, opening: str = "") -> str:
    """Describe what some parameters are known to, in one sentence.

    Args:
        analysis: Covariance analysis of the parameters.
        measured: Whether readings entered.
        opening: How the sentence begins.
    """
    opening = opening or ("These measurements determine" if measured else "Measurements by this plan would determine")
    parts = [f"{p.name} {describe_precision(p)}" for p in analysis.identified]
    parts += [f"{c.words} {describe_precision(c)}" for c in analysis.determined]
    sentence = f"{opening} {listed(parts)}" if parts else f"{opening} no coefficient by itself"
    prior_driven, partly = analysis.resting, analysis.partly_identified
    if partly:
        verb = "owes" if len(partly) == 1 else "owe"
        sentence += f"; {listed([p.name for p in partly])} {verb} about as much to the prior as to them"
    if prior_driven:
        verb = "rests on its prior" if len(prior_driven) == 1 else "rest on their priors"
        sentence += f"; {listed(prior_driven)} {verb}"
    if analysis.sharpest is not None and not analysis.determined:
        sentence += f"; sharpest of all is {analysis.sharpest.words}, {describe_precision(analysis.sharpest)}"
    return sentence + "."


def describe_precision(known: ParameterContraction | Combination) -> str:
    """Describe how well a quantity is known: in percent where it is clear of zero, else in its unit."""
    if abs(known.value) > 2 * known.sd:
        return f"to {significant(100 * known.sd / abs(known.value), 2)} %"
    return f"to ± {known.sd:z.{decimals(known.sd)}f}"


def rebuild_identifiability(stored: Mapping[str, Any]) -> Identifiability:
    """Return identifiability from the plain data that are stored in a results folder; profiles are not stored."""
    groups = deserialize(dict[str, CovarianceAnalysis], stored["groups"])
    words = {"units": stored["units"], "meanings": stored["meanings"]}
    return Identifiability(stored["name"], stored["basis"], stored["measured"], groups, **words)


@blocks_of.register(Identifiability)
def identifiability_blocks(result: Identifiability) -> list[Block]:
    """Describe what measurements determine: the answer first, then parameters and combinations."""
    first, *others = result.sentences() or ["There is nothing to determine."]
    tables = []
    for name, group in result.groups.items():
        units = result.units if name != CURVES else {}  # of which numbers on a logarithmic scale have none that people know
        tables += [_parameter_blocks(name, group, units), _combination_blocks(group) if name != CURVES else []]
    named = {p.name for group in result.groups.values() for p in group.parameters}
    return separate(
        [f"{result.name}: {first[0].lower()}{first[1:]}", *others],
        *tables,
        [Legend({name: meaning for name, meaning in result.meanings.items() if name in named})],
        [
            f"Judged at {result.basis}. ± is one standard deviation, now and before anything was measured (the prior); "
            "determined by: whether the measurements or the prior determine the value, with their share of the prior variance."
        ],
    )


def _parameter_blocks(name: str, group: CovarianceAnalysis, units: Mapping[str, str]) -> list[Block]:
    """Return the parameters of a group in a table, and which are hard to tell apart."""
    heads: tuple[str, ...] = ("", "value", "known to", "before", "unit", "determined by")
    unit = {p.name: units.get(p.name, "1") for p in group.parameters}
    rows: list[tuple[str, ...]] = [
        (p.name, *_format_numbers(p), "" if unit[p.name] == "1" else unit[p.name], _describe_source(p.share))
        for p in group.parameters
    ]
    if set(unit.values()) <= {"1"}:
        heads, rows = (*heads[:4], *heads[5:]), [(*row[:4], *row[5:]) for row in rows]
    correlated = [sorted((p.name, p.most_correlated)) for p in group.parameters if abs(p.correlation) > _CORRELATED]
    pairs = [f"{first} and {second}" for first, second in dict.fromkeys(map(tuple, correlated))]
    if len(group.parameters) > 1 and not group.collinearity < _COLLINEAR:
        pairs = [*pairs, "all of them together"]
    note = f"Strongly correlated, hard to separate: {'; '.join(pairs)}." if pairs else ""
    return [f"{capitalized(name)}, one by one", ResultTable(heads, rows, left=("unit", "determined by"), narrow=True), note]


def _format_numbers(p: ParameterContraction) -> tuple[str, str, str]:
    """Format value, standard deviation, and that of the prior."""
    digits = decimals(p.sd)
    return f"{p.value:z.{digits}f}", f"± {p.sd:z.{digits}f}", f"± {p.prior_sd:z.{digits}f}"


def _describe_source(share: float) -> str:
    """Describe what determines a value: measurements, its prior, or both."""
    if share < IDENTIFIABLE:
        return f"measurements ({percent(1 - share, 0)})"
    return f"prior ({percent(share, 0)})" if share > PRIOR_DOMINATED else f"both (prior {percent(share, 0)})"


def _combination_blocks(group: CovarianceAnalysis) -> list[Block]:
    """Return independent combinations in a table, the best determined first; empty of a single parameter."""
    if len(group.directions) < 2:
        return []
    rows = [(combination.words, *_format_sum(combination)) for combination in group.directions]
    return ["Independent sums, the best determined first", ResultTable(("", "value", "known to"), rows, narrow=True)]


def _format_sum(d: Combination) -> tuple[str, str]:
    """Format the value and standard deviation of a combination."""
    digits = decimals(d.sd)
    return f"{d.value:z.{digits}f}", f"± {d.sd:z.{digits}f}"
