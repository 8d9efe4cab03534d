"""What the checks of a fit say, in a few sentences: scatter, outliers, readings that decide by themselves, priors."""

from math import isfinite

from bowdenfit.kinds import reading_called, readings_called
from bowdenfit.questions.check.answer import Checks
from bowdenfit.questions.check.sensitivity_words import priors_text
from bowdenfit.questions.check.table_checks import CheckedReading
from bowdenfit.words import decimals, few, filled, listed

_FEW = 3  # readings of a kind that are named; of more, the rest is counted
_FEW_CHANCE = "ten"  # where readings hang together, as two do of which each predicts the other
_HEADING = """Fit checks: every reading against its prediction from all the others
(z is its deviation in standard deviations, k how far the fit leans on it: too far beyond 0.7)"""


def checks_text(found: Checks | None) -> str:
    """The checks of a fit in sentences; empty without draws.

    Args:
        found: The checks.
    """
    if found is None or not found.readings:
        return ""
    sentences = [_scatter(found), _outliers(found), _decisive(found), _outside(found), priors_text(found)]
    return "\n".join([_HEADING, *(filled(sentence) for sentence in sentences if sentence)])


def checks_page(found: Checks) -> str:
    """The same for one who asks for the checks alone: whether any reading is off comes first.

    Args:
        found: The checks.
    """
    sentences = [_outliers(found), _scatter(found), _decisive(found), _outside(found), priors_text(found)]
    return "\n".join(filled(sentence) for sentence in sentences if sentence)


def _name(reading: CheckedReading) -> str:
    """A reading in words."""
    return reading_called(reading.table, reading.label)


def scattering(found: Checks) -> list[str]:
    """Tables whose readings scatter otherwise than predicted, and how.

    Args:
        found: The checks.
    """
    return [f"the readings of {readings_called(t.table).words} {t.fault}" for t in found.tables if t.fault]


def _scatter(found: Checks) -> str:
    """How many readings their intervals hold, and which tables scatter otherwise than predicted."""
    n, held = (sum(getattr(t, key) for t in found.tables) for key in ("measured", "in_interval"))
    faults = scattering(found)
    few = f" Of so few, chance leaves none inside in one fit of {_FEW_CHANCE}." if held == 0 and n <= _FEW else ""
    start = f"The 90 % intervals of these predictions hold {held} of {n} readings.{few}"
    if not faults:
        return start
    return f"{start} But {listed(faults)}, by more than chance does in one fit of a hundred."


def _outliers(found: Checks) -> str:
    far = found.outliers
    if not far:
        return "No reading is an outlier."
    more = f", and {len(far) - _FEW} more" if len(far) > _FEW else ""
    what = "Outlier" if len(far) == 1 else f"{len(far)} outliers"
    return (
        f"{what}: {'; '.join(_sentence(r) for r in far[:_FEW])}{more}. Look at how they were measured and written down."
    )


def _sentence(reading: CheckedReading) -> str:
    """'efficiency at 550 mm: measured 67.8 %, expected 68.1 % without it (90 % interval ..., z = -0.2, k = 0.6)'"""
    expected, low, high = (with_unit(reading, getattr(reading, key)) for key in ("expected", "q05", "q95"))
    measured = f"{'at most' if reading.is_bound else 'measured'} {with_unit(reading, reading.reading)}"
    z = f", z = {reading.z:+.1f}" if isfinite(reading.z) else ""
    k = f"= {reading.pareto_k:.2f}" if isfinite(reading.pareto_k) else "far above 1"
    interval = f"90 % interval {low} to {high}{z}, k {k}"
    return f"{_name(reading)}: {measured}, expected {expected} without it ({interval})"


def with_unit(reading: CheckedReading, value: float) -> str:
    """A value of a reading's kind with its unit."""
    if readings_called(reading.table).are_efficiencies:
        return f"{100 * value:z.{decimals(100 * reading.sd)}f} %"
    unit = "" if reading.unit == "1" else f" {reading.unit}"
    return f"{value:z.{decimals(reading.sd)}f}{unit}"


def _decisive(found: Checks) -> str:
    """Readings that the fit leans on."""
    decisive = found.decisive
    if not decisive:
        return ""
    return (
        f"The fit leans on {few(_name(r) for r in decisive)} (k above 0.7): without {_one(len(decisive))} it would be "
        "markedly different, so measure there again first if in doubt."
    )


def _one(n: int) -> str:
    return "it" if n == 1 else "one of them"


def _outside(found: Checks) -> str:
    """Readings outside the range of the curves, which test the model where it was not made for."""
    outside = [r for r in found.readings if not r.inside and not r.outlier]
    if not outside:
        return ""
    more = f"; and {len(outside) - _FEW} more" if len(outside) > _FEW else ""
    return f"Outside the range of the curves: {'; '.join(_sentence(r) for r in outside[:_FEW])}{more}."
