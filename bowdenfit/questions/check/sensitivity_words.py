"""Influence of the priors on coefficients, design answers and widths of intervals, in sentences."""

from collections.abc import Sequence
from math import isfinite

from bowdenfit.inference.prior_sensitivity import Sensitivity, WidthSensitivity
from bowdenfit.questions.check.answer import Checks
from bowdenfit.words import counted, decimals, listed

_ANSWERS = {"optimal_length": "the best length", "optimal_efficiency": "the efficiency there"}


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
        sentences.append(f"Priors hardly affect the coefficients{answers}, nor the widths of their intervals.")
    return " ".join(part for part in sentences if part)


def describe_assumed_widths(checks: Checks) -> str:
    """Say that widths follow the prior of a noise scale which too few readings determine; empty where they do not."""
    names = [
        name
        for name in checks.weakly_identified_noise
        if any(w.parameter == name for s in checks.sensitivities for w in s.followed)
    ]
    if not names:
        return ""
    readings, coefficients = _readings_and_coefficients(checks, names[0])
    n_readings = readings.partition(" ")[0]
    return f"Widths follow the prior of the noise {listed(names)}; add readings ({n_readings} for {coefficients})."


def _readings_and_coefficients(checks: Checks, noise: str) -> tuple[str, str]:
    """Return '4 readings' and '3 coefficients' of a weakly identified noise scale."""
    readings, coefficients = checks.weakly_identified_noise[noise]
    return counted(readings, "reading"), counted(coefficients, "coefficient")


def _describe_conflicts(checks: Checks) -> str:
    """Parameters that lie far out by their priors, or where a prior that counts is at odds with the readings."""
    conflicts = checks.conflicts
    sds = {s.parameter: s.prior_sds for s in conflicts} | {f.parameter: f.prior_sds for f in checks.prior_conflicts}
    if not sds:
        return ""
    far = max(abs(value) for value in sds.values())
    return (
        f"Prior and readings contradict each other about {listed(list(sds))}: the estimate lies {far:.1f} standard "
        f"deviations of the prior from its middle{_with_wider_prior(conflicts)}. Check the prior, its unit first."
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
        sentences.append(f"Widths also follow the prior{'s' if len(names) > 2 else ''} of {listed(names[1:])}.")
    unknown = list(dict.fromkeys(name for s in checks.sensitivities for name in s.undetermined))
    if unknown:
        sentences.append(
            f"How widths follow the prior of {listed(unknown)} cannot be computed from these draws (k above 0.7)."
        )
    return sentences


def _width_sentence(parameter: str, affected: list[tuple[str, WidthSensitivity]], checks: Checks) -> str:
    """'The prior of tau sets widths: the 90 % interval of mu1 would be 1.4 times as wide with twice its scale and ...'"""
    name, width = max(affected, key=lambda entry: entry[1].size)
    others = [other for other, _ in affected if other != name]
    more = f"; less so {listed(others)}" if others else ""
    why = (
        ", because {} must also determine {}".format(*_readings_and_coefficients(checks, parameter))
        if parameter in checks.weakly_identified_noise
        else ""
    )
    ratios = (("twice its scale", width.doubled), ("half of it", width.halved))
    changes = listed([f"{ratio:.2f} times as wide with {what}" for what, ratio in ratios if isfinite(ratio)])
    return f"The prior of {parameter} sets widths{why}: the 90 % interval of {name} would be {changes}{more}."


def _quantity_name(quantity: str) -> str:
    return _ANSWERS.get(quantity, quantity)


def _quantity_and_prior(s: Sensitivity) -> str:
    name = _quantity_name(s.quantity)
    return name if s.parameter == s.quantity else f"{name} (that of {s.parameter})"


def _with_wider_prior(sensitivities: Sequence[Sensitivity]) -> str:
    """How far the quantity that moves most would move with a wider prior."""
    known = [s for s in sensitivities if isfinite(s.wider) and s.sd]
    if not known:
        return ""
    s = max(known, key=lambda s: abs(s.wider - s.median) / s.sd)
    digits = decimals(s.sd) + 1
    return (
        f"; were the prior of {s.parameter} twice as wide, {_quantity_name(s.quantity)} would be "
        f"{s.wider:z.{digits}f} instead of {s.median:z.{digits}f}"
    )
