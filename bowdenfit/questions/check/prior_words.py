"""What the priors alone hold possible, in words: which readings lie outside, and what the usual cause is."""

from bowdenfit.questions.check.prior_predictive import PriorPredictive, PriorTable
from bowdenfit.words import few, filled, significant

WORTH_WARNING = (
    0.2  # share of a table's readings outside the central 99 %: that many are in at most 1 of 20 good data sets
)
_FEW = 3


def prior_predictive_text(found: PriorPredictive) -> str:
    """Which readings the priors hold impossible, and what to do about it.

    Args:
        found: What the priors hold possible.
    """
    lines = [line for table in found.tables if (line := _sentence(table))]
    if not lines:
        n = sum(len(table.outside) for table in found.tables)
        lines = [f"All {n} readings lie inside the central 99 % of what the priors alone hold possible."]
    return "\n".join(filled(line) for line in lines) + "\n"


def _sentence(table: PriorTable) -> str:
    """What to say of a table; by Markov's inequality a fifth of its readings lies outside 1 % in 1 of 20 cases at most."""
    n, outside = len(table.outside), [i for i, out in enumerate(table.outside) if out]
    if not outside:
        return ""
    lie = "lies" if len(outside) == 1 else "lie"
    said = (
        f"{len(outside)} of {n} readings ({table.name}: {_which(table, outside)}) {lie} outside the central 99 % of what "
        "the priors hold possible"
    )
    if len(outside) < WORTH_WARNING * n:
        return f"{said}; a few may by chance, but look at {'it' if len(outside) == 1 else 'them'}."
    return (
        f"Warning: {said}. The usual cause is a unit: check those of the table, then those of the wrap angles; else the priors "
        "are too narrow for this cable, and [friction] and [prior] in cable.toml can widen them."
    )


def _which(table: PriorTable, outside: list[int]) -> str:
    """The first few, with what was read and what the priors allow."""
    return few((f"{table.labels[i]}{_values(table, i)}" for i in outside), _FEW)


def _values(table: PriorTable, i: int) -> str:
    low, high = table.quantiles[0][i], table.quantiles[-1][i]
    read = f"{significant(table.reading[i])}, " if table.reading[i] == table.reading[i] else ""
    return f" [{read}priors {significant(low)} to {significant(high)}]"
