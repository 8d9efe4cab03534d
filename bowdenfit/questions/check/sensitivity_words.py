"""What priors do to coefficients, design answers and the widths of their intervals, in sentences."""

from collections.abc import Sequence
from math import isfinite

from bowdenfit.inference.prior_sensitivity import Sensitivity, WidthSensitivity
from bowdenfit.questions.check.answer import Checks
from bowdenfit.words import counted, decimals, listed

_ANSWERS = {"optimal_length": "the best length", "optimal_efficiency": "the efficiency there"}


def priors_text(found: Checks) -> str:
    """What priors do; empty without sensitivities."""
    every, said = found.sensitivities, [_contradictions(found)]
    felt = [s for s in every if s.diagnosis in {"prior decides", "both count"}]
    if felt:
        said.append(f"The prior counts for {listed([_felt(s) for s in felt])}{_with_wider_prior(felt)}.")
    said += _widths(found)
    if every and not any(said):
        answers = " and the design answer" if any(s.quantity in _ANSWERS for s in every) else ""
        said.append(f"Priors hardly count for the coefficients{answers}, nor for the widths of their intervals.")
    return " ".join(part for part in said if part)


def assumed_widths(found: Checks) -> str:
    """That widths of intervals follow the prior of a noise scale that too few readings tell; empty where they do not."""
    names = [name for name in found.told_by if any(w.parameter == name for s in found.sensitivities for w in s.followed)]
    if not names:
        return ""
    return f"Interval widths rest on what was assumed of {listed(names)}: {', '.join(_told_by(found, names[0]))}."


def _told_by(found: Checks, noise: str) -> tuple[str, str]:
    """'4 readings' and '3 coefficients', of a noise scale that few readings tell."""
    readings, coefficients = found.told_by[noise]
    return counted(readings, "reading"), counted(coefficients, "coefficient")


def _contradictions(found: Checks) -> str:
    """Parameters that lie far out by their priors, or where a prior that counts is at odds with the readings."""
    conflicts = found.conflicts
    sds = {s.parameter: s.prior_sds for s in conflicts} | {f.parameter: f.prior_sds for f in found.prior_conflicts}
    if not sds:
        return ""
    far = max(abs(value) for value in sds.values())
    return (
        f"Prior and readings contradict each other about {listed(list(sds))}: what was found lies {far:.1f} standard "
        f"deviations of the prior from its middle{_with_wider_prior(conflicts)}. Check the prior, its unit first."
    )


def _widths(found: Checks) -> list[str]:
    """Priors that widths follow, first where too few readings are the reason, and those of which the draws cannot tell."""
    held: dict[str, list[tuple[str, WidthSensitivity]]] = {}
    for s in found.sensitivities:
        for width in s.followed:
            held.setdefault(width.parameter, []).append((_answer(s.quantity), width))
    names = sorted(held, key=lambda name: (name not in found.told_by, -max(width.size for _, width in held[name])))
    said = [_follows(name, held[name], found) for name in names[:1]]
    if names[1:]:
        said.append(f"Widths also follow the prior{'s' if len(names) > 2 else ''} of {listed(names[1:])}.")
    untold = list(dict.fromkeys(name for s in found.sensitivities for name in s.undetermined))
    if untold:
        said.append(f"The draws cannot tell how widths follow the prior of {listed(untold)} (k above 0.7).")
    return said


def _follows(parameter: str, held: list[tuple[str, WidthSensitivity]], found: Checks) -> str:
    """'The prior of tau sets widths: the 90 % interval of mu1 would be 1.4 times as wide with twice its scale and ...'"""
    name, width = max(held, key=lambda each: each[1].size)
    others = [other for other, _ in held if other != name]
    more = f"; less so {listed(others)}" if others else ""
    why = ", because {} tell {} too".format(*_told_by(found, parameter)) if parameter in found.told_by else ""
    ratios = (("twice its scale", width.doubled), ("half of it", width.halved))
    changes = listed([f"{ratio:.2f} times as wide with {what}" for what, ratio in ratios if isfinite(ratio)])
    return f"The prior of {parameter} sets widths{why}: the 90 % interval of {name} would be {changes}{more}."


def _answer(quantity: str) -> str:
    return _ANSWERS.get(quantity, quantity)


def _felt(s: Sensitivity) -> str:
    name = _answer(s.quantity)
    return name if s.parameter == s.quantity else f"{name} (that of {s.parameter})"


def _with_wider_prior(found: Sequence[Sensitivity]) -> str:
    """How far the quantity that moves most would move with a wider prior."""
    known = [s for s in found if isfinite(s.wider) and s.sd]
    if not known:
        return ""
    s = max(known, key=lambda s: abs(s.wider - s.median) / s.sd)
    digits = decimals(s.sd) + 1
    return (
        f"; were the prior of {s.parameter} twice as wide, {_answer(s.quantity)} would be "
        f"{s.wider:z.{digits}f} instead of {s.median:z.{digits}f}"
    )
