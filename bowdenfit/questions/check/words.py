"""The checks of a fit in sentences: coverage of the intervals, outliers, influential readings, priors."""

from math import isfinite

from bowdenfit.kinds import describe_reading, find_readings
from bowdenfit.questions.check.answer import Checks
from bowdenfit.questions.check.sensitivity_words import describe_prior_influence
from bowdenfit.questions.check.table_checks import CheckedReading
from bowdenfit.words import counted, decimals, few, filled, listed

_MAX_NAMED = 3  # readings named in a sentence; the others are counted
_ONE_IN = "ten"  # two correlated readings, of which each predicts the other, miss their intervals together
_HEADING = """Fit checks: every reading against its prediction from all the others
(z: deviation in standard deviations; k: Pareto k, influential above 0.7)"""


def describe_checks(checks: Checks | None) -> str:
    """The checks of a fit in sentences; empty without draws.

    Args:
        checks: The checks.
    """
    if checks is None or not checks.readings:
        return ""
    sentences = [
        _describe_coverage(checks),
        _describe_outliers(checks),
        _describe_influential(checks),
        _describe_outside_range(checks),
        describe_prior_influence(checks),
    ]
    return "\n".join([_HEADING, *(filled(sentence) for sentence in sentences if sentence)])


def checks_page(checks: Checks) -> str:
    """Return the sentences for a page of the checks alone: outliers come first.

    Args:
        checks: The checks.
    """
    sentences = [
        _describe_outliers(checks),
        _describe_coverage(checks),
        _describe_influential(checks),
        _describe_outside_range(checks),
        describe_prior_influence(checks),
    ]
    return "\n".join(filled(sentence) for sentence in sentences if sentence)


def _name(reading: CheckedReading) -> str:
    """A reading in words."""
    return describe_reading(reading.table, reading.label)


def describe_misfits(checks: Checks) -> list[str]:
    """Tables whose readings scatter otherwise than predicted, and how.

    Args:
        checks: The checks.
    """
    return [f"the readings of {find_readings(t.table).words} {t.misfit}" for t in checks.tables if t.misfit]


def _describe_coverage(checks: Checks) -> str:
    """How many readings their intervals hold, and which tables scatter otherwise than predicted."""
    n, held = (sum(getattr(t, key) for t in checks.tables) for key in ("measured", "in_interval"))
    misfits = describe_misfits(checks)
    few = (
        f" With so few readings, that happens by chance in one fit of {_ONE_IN}."
        if held == 0 and n <= _MAX_NAMED
        else ""
    )
    start = f"The 90 % intervals of these predictions contain {held} of {counted(n, 'reading')}.{few}"
    if not misfits:
        return start
    return f"{start} But {listed(misfits)}, more than happens by chance in one fit of a hundred."


def _describe_outliers(checks: Checks) -> str:
    far = checks.outliers
    if not far:
        return "The reading is not an outlier." if len(checks.readings) == 1 else "No reading is an outlier."
    more = f", and {len(far) - _MAX_NAMED} more" if len(far) > _MAX_NAMED else ""
    what = "Outlier" if len(far) == 1 else f"{len(far)} outliers"
    names = "; ".join(_describe_reading(reading) for reading in far[:_MAX_NAMED])
    measured = "it was" if len(far) == 1 else "they were"
    return f"{what}: {names}{more}. Check how {measured} measured and written down."


def _describe_reading(reading: CheckedReading) -> str:
    """'efficiency at 550 mm: measured 67.8 %, expected 68.1 % without it (90 % interval ..., z = -0.2, k = 0.6)'"""
    expected, low, high = (value_with_unit(reading, getattr(reading, key)) for key in ("expected", "q05", "q95"))
    measured = f"{'at most' if reading.is_bound else 'measured'} {value_with_unit(reading, reading.reading)}"
    z = f", z = {reading.z:+.1f}" if isfinite(reading.z) else ""
    k = f"= {reading.pareto_k:.2f}" if isfinite(reading.pareto_k) else "far above 1"
    interval = f"90 % interval {low} to {high}{z}, k {k}"
    return f"{_name(reading)}: {measured}, expected {expected} without it ({interval})"


def value_with_unit(reading: CheckedReading, value: float) -> str:
    """A value of a reading's kind with its unit."""
    if find_readings(reading.table).are_efficiencies:
        return f"{100 * value:z.{decimals(100 * reading.sd)}f} %"
    unit = "" if reading.unit == "1" else f" {reading.unit}"
    return f"{value:z.{decimals(reading.sd)}f}{unit}"


def _describe_influential(checks: Checks) -> str:
    """Name the influential readings, without which the answer would change."""
    influential = checks.influential
    if not influential:
        return ""
    return (
        f"Influential: {few(_name(r) for r in influential)} (k above 0.7). Without {_one(len(influential))} the answer would "
        "change markedly, so repeat that measurement first if in doubt."
    )


def _one(n: int) -> str:
    return "it" if n == 1 else "one of them"


def _describe_outside_range(checks: Checks) -> str:
    """Readings outside the range of the curves, which test the model where it was not made for."""
    outside = [r for r in checks.readings if not r.inside and not r.outlier]
    if not outside:
        return ""
    more = f"; and {len(outside) - _MAX_NAMED} more" if len(outside) > _MAX_NAMED else ""
    return f"Outside the range of the curves: {'; '.join(_describe_reading(r) for r in outside[:_MAX_NAMED])}{more}."
