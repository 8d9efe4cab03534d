"""Prior predictive check in sentences: which readings lie outside, and the usual cause."""

from bowdenfit.questions.check.prior_predictive import PriorPredictive, PriorTable
from bowdenfit.words import counted, few, filled, significant

WORTH_WARNING = (
    0.2  # share of a table's readings outside the central 99 %: that many are in at most 1 of 20 good data sets
)
_MAX_NAMED = 3


def describe_prior_predictive(predictive: PriorPredictive) -> str:
    """Name the readings outside what the priors allow, and what to do about them.

    Args:
        predictive: The prior predictive draws beside the readings.
    """
    lines = [line for table in predictive.tables if (line := _describe_table(table))]
    if not lines:
        n = sum(len(table.outside) for table in predictive.tables)
        lie = "The reading lies" if n == 1 else f"All {n} readings lie"
        lines = [f"{lie} inside the central 99 % of what the priors alone allow."]
    return "\n".join(filled(line) for line in lines) + "\n"


def _describe_table(table: PriorTable) -> str:
    """Describe a table; by Markov's inequality, a fifth of its readings lies outside 1 % in at most 1 of 20 cases."""
    n, outside = len(table.outside), [i for i, out in enumerate(table.outside) if out]
    if not outside:
        return ""
    lie = "lies" if len(outside) == 1 else "lie"
    statement = (
        f"{len(outside)} of {counted(n, 'reading')} ({table.name}: {_name_readings(table, outside)}) {lie} outside "
        "the central 99 % of what the priors allow"
    )
    if len(outside) < WORTH_WARNING * n:
        return f"{statement}; a few may by chance, but look at {'it' if len(outside) == 1 else 'them'}."
    return (
        f"Warning: {statement}. The usual cause is a wrong unit: check those of the table, then those of the wrap angles. "
        "Otherwise the priors are too narrow for this cable, and [friction] and [prior] in cable.toml can widen them."
    )


def _name_readings(table: PriorTable, outside: list[int]) -> str:
    """The first few, with what was read and what the priors allow."""
    return few((f"{table.labels[i]}{_reading_and_range(table, i)}" for i in outside), _MAX_NAMED)


def _reading_and_range(table: PriorTable, i: int) -> str:
    low, high = table.quantiles[0][i], table.quantiles[-1][i]
    read = f"{significant(table.reading[i])}, " if table.reading[i] == table.reading[i] else ""
    return f" [{read}priors {significant(low)} to {significant(high)}]"
