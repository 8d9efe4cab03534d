"""The checks of a fit in sentences: coverage of the intervals, outliers, influential readings, priors."""

from collections.abc import Mapping, Sequence
from math import isfinite

from bowdenfit.inference.prior_sensitivity import Sensitivity, WidthSensitivity
from bowdenfit.kinds import describe_reading, find_readings
from bowdenfit.questions.check.answer import Checks
from bowdenfit.questions.check.table_checks import CheckedReading
from bowdenfit.words import counted, decimals, few, filled, listed

_MAX_NAMED = 3  # readings named in a sentence; the others are counted
_ONE_IN = (
    "ten"  # of fits with few readings: correlated readings, which predict each other, miss their intervals together
)
_HEADING = """Leave-one-out checks: every reading against its prediction from all others
(z: deviation in standard deviations; k: Pareto k, influential above 0.7)"""
_ANSWERS = {"optimal_length": "the best length", "optimal_efficiency": "the efficiency at the best length"}


def describe_checks(checks: Checks | None) -> str:
    """Describe the checks of a fit in sentences; empty without draws.

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


def check_sentences(checks: Checks) -> list[str]:
    """Describe the checks for a page of their own: outliers come first.

    Args:
        checks: The checks.
    """
    sentences = (
        _describe_outliers(checks),
        _describe_coverage(checks),
        _describe_influential(checks),
        _describe_outside_range(checks),
        describe_prior_influence(checks),
    )
    return [sentence for sentence in sentences if sentence]


def _name_reading(reading: CheckedReading) -> str:
    """Return a reading in words."""
    return describe_reading(reading.table, reading.label)


def describe_misfits(checks: Checks) -> list[str]:
    """Describe the tables whose readings scatter otherwise than predicted.

    Args:
        checks: The checks.
    """
    return [f"the readings of {t.words} {t.misfit}" for t in checks.tables if t.misfit]


def _describe_coverage(checks: Checks) -> str:
    """Describe how many readings their intervals contain, and which tables scatter otherwise than predicted."""
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
    return f"{start} But {listed(misfits)}, more than happens by chance in one fit in a hundred."


def _describe_outliers(checks: Checks) -> str:
    """Describe the outliers, or that there are none."""
    far = checks.outliers
    if not far:
        return "The reading is not an outlier." if len(checks.readings) == 1 else "No reading is an outlier."
    more = f", and {len(far) - _MAX_NAMED} more" if len(far) > _MAX_NAMED else ""
    noun = "Outlier" if len(far) == 1 else f"{len(far)} outliers"
    names = "; ".join(_describe_reading(reading) for reading in far[:_MAX_NAMED])
    measured = "it was" if len(far) == 1 else "they were"
    return f"{noun}: {names}{more}. Check how {measured} measured and written down."


def _describe_reading(reading: CheckedReading) -> str:
    """Return such as 'efficiency at 550 mm: measured 67.8 %, expected 68.1 % without it (90 % interval ..., k = 0.6)'."""
    expected, low, high = (value_with_unit(reading, getattr(reading, key)) for key in ("expected", "q05", "q95"))
    measured = f"{'at most' if reading.is_bound else 'measured'} {value_with_unit(reading, reading.reading)}"
    z = f", z = {reading.z:+.1f}" if isfinite(reading.z) else ""
    k = f"= {reading.pareto_k:.2f}" if isfinite(reading.pareto_k) else "far above 1"
    interval = f"90 % interval {low} to {high}{z}, k {k}"
    return f"{_name_reading(reading)}: {measured}, expected {expected} without it ({interval})"


def value_with_unit(reading: CheckedReading, value: float) -> str:
    """Format a value of a reading's kind with its unit."""
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
        f"{'Influential reading' if len(influential) == 1 else 'Influential readings'}: {few(map(_name_reading, influential))} "
        f"(k above 0.7). Without {_one(len(influential))} the answer would change markedly, so repeat that measurement "
        "first if in doubt."
    )


def _one(n: int) -> str:
    """Return what one of so many readings is called."""
    return "it" if n == 1 else "one of them"


def _describe_outside_range(checks: Checks) -> str:
    """Describe readings outside the range of the curves, which test the model where it was not made for."""
    outside = [r for r in checks.readings if not r.inside and not r.outlier]
    if not outside:
        return ""
    more = f"; and {len(outside) - _MAX_NAMED} more" if len(outside) > _MAX_NAMED else ""
    return f"Outside the range of the curves: {'; '.join(_describe_reading(r) for r in outside[:_MAX_NAMED])}{more}."


def describe_prior_influence(checks: Checks) -> str:
    """Describe the influence of the priors; empty without sensitivities."""
    sensitivities, sentences = checks.sensitivities, [_describe_conflicts(checks)]
    prior_counts = [s for s in sensitivities if s.diagnosis in {"prior decides", "both count"}]
    if prior_counts:
        sentences.append(
            f"The prior matters for {listed([_quantity_and_prior(s) for s in prior_counts])}{_with_wider_prior(prior_counts)}."
        )
    sentences += _describe_widths(checks)
    if sensitivities and not any(sentences):
        answers = " and the design answer" if any(s.quantity in _ANSWERS for s in sensitivities) else ""
        sentences.append(f"Priors have little effect on the coefficients{answers}, or on the widths of their intervals.")
    return " ".join(part for part in sentences if part)


def describe_assumed_widths(checks: Checks, meanings: Mapping[str, str]) -> str:
    """Say that widths depend on the prior of a noise scale which too few readings determine; empty where they do not.

    Args:
        checks: The checks.
        meanings: Meaning of each parameter, by name.
    """
    names = [
        name
        for name in checks.weakly_identified_noise
        if any(w.parameter == name for s in checks.sensitivities for w in s.followed)
    ]
    if not names:
        return ""
    readings, coefficients = _readings_and_coefficients(checks, names[0])
    priors = listed([f"{name} ({meanings[name]})" if name in meanings else name for name in names])
    return f"Interval widths depend on the prior of {priors}, with only {readings} for {coefficients}: add readings."


def _readings_and_coefficients(checks: Checks, noise: str) -> tuple[str, str]:
    """Return '4 readings' and '3 coefficients' of a weakly identified noise scale."""
    readings, coefficients = checks.weakly_identified_noise[noise]
    return counted(readings, "reading"), counted(coefficients, "coefficient")


def _describe_conflicts(checks: Checks) -> str:
    """Describe parameters that lie far out by their priors, or where a prior that counts is at odds with the readings."""
    conflicts = checks.conflicts
    sds = {s.parameter: s.prior_sds for s in conflicts} | {f.parameter: f.prior_sds for f in checks.prior_conflicts}
    if not sds:
        return ""
    far = max(abs(value) for value in sds.values())
    return (
        f"Prior and readings disagree about {listed(list(sds))}: the estimate lies {far:.1f} standard deviations of the "
        f"prior from its median{_with_wider_prior(conflicts)}. Check the prior, its unit first."
    )


def _describe_widths(checks: Checks) -> list[str]:
    """Describe the priors that widths follow, weakly identified noise first, and those for which the weights fail."""
    by_parameter: dict[str, list[tuple[str, WidthSensitivity]]] = {}
    for s in checks.sensitivities:
        for width in s.followed:
            by_parameter.setdefault(width.parameter, []).append((_quantity_name(s.quantity), width))
    names = sorted(
        by_parameter,
        key=lambda name: (
            name not in checks.weakly_identified_noise,
            -max(width.size for _, width in by_parameter[name]),
        ),
    )
    sentences = [_width_sentence(name, by_parameter[name], checks) for name in names[:1]]
    if names[1:]:
        sentences.append(f"Interval widths also depend on the prior{'s' if len(names) > 2 else ''} of {listed(names[1:])}.")
    unknown = list(dict.fromkeys(name for s in checks.sensitivities for name in s.undetermined))
    if unknown:
        sentences.append(
            f"How interval widths depend on the prior of {listed(unknown)} cannot be computed from these draws (Pareto k above "
            "0.7)."
        )
    return sentences


def _width_sentence(parameter: str, affected: list[tuple[str, WidthSensitivity]], checks: Checks) -> str:
    """Return such as 'The prior of tau sets widths: the 90 % interval of mu1 would be 1.4 times as wide with ...'."""
    name, width = max(affected, key=lambda entry: entry[1].size)
    remaining = [other for other, _ in affected if other != name]
    more = f"; less so {listed(remaining)}" if remaining else ""
    reason = (
        ", because {} must also determine {}".format(*_readings_and_coefficients(checks, parameter))
        if parameter in checks.weakly_identified_noise
        else ""
    )
    ratios = (("twice the scale of that prior", width.doubled), ("half of it", width.halved))
    changes = listed([f"{ratio:.2f} times as wide with {what}" for what, ratio in ratios if isfinite(ratio)])
    return f"Interval widths depend on the prior of {parameter}{reason}: the 90 % interval of {name} would be {changes}{more}."


def _quantity_name(quantity: str) -> str:
    """Return the name of a quantity in words."""
    return _ANSWERS.get(quantity, quantity)


def _quantity_and_prior(s: Sensitivity) -> str:
    """Return the name of a quantity, and of the parameter whose prior matters where that is another."""
    name = _quantity_name(s.quantity)
    return name if s.parameter == s.quantity else f"{name} (that of {s.parameter})"


def _with_wider_prior(sensitivities: Sequence[Sensitivity]) -> str:
    """Describe how far the quantity that moves most would move with a wider prior."""
    finite = [s for s in sensitivities if isfinite(s.wider) and s.sd]
    if not finite:
        return ""
    s = max(finite, key=lambda s: abs(s.wider - s.median) / s.sd)
    digits = decimals(s.sd) + 1
    return (
        f"; were the prior of {s.parameter} twice as wide, {_quantity_name(s.quantity)} would be "
        f"{s.wider:z.{digits}f} instead of {s.median:z.{digits}f}"
    )
