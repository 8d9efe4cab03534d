"""What the checks of a fit say, in a few sentences: scatter, outliers, readings that decide by themselves, priors."""

from collections.abc import Iterable, Mapping
from typing import Any

from bowdenfit.kinds import readings_called
from bowdenfit.words import decimals, filled, listed

_FEW = 3  # readings of a kind that are named; of more, the rest is counted
_HEADING = """Fit checks: every reading against its prediction from all the others
(z is its deviation in standard deviations, k how far the fit leans on it: too far beyond 0.7)"""
_ANSWERS = {"optimal_length": "the best length", "optimal_efficiency": "the efficiency there"}


def checks_text(page: Mapping[str, Any]) -> str:
    """The checks of a fit in sentences; empty without draws.

    Args:
        page: Section "checks" of the summary.
    """
    if not page or not page["readings"]:
        return ""
    sentences = [_scatter(page), _outliers(page), _trends(page), _decisive(page), _outside(page), _priors(page)]
    return "\n".join([_HEADING, *(filled(sentence) for sentence in sentences if sentence)])


def named(reading: Mapping[str, Any]) -> str:
    """A reading in words."""
    return readings_called(reading["table"]).one.format(reading["label"])


def _scatter(page: Mapping[str, Any]) -> str:
    """How many readings their intervals hold, and which tables scatter otherwise than predicted."""
    n, held = (sum(t[key] for t in page["tables"]) for key in ("readings", "in_interval"))
    faults = [f"the readings of {readings_called(t['table']).words} {t['fault']}" for t in page["tables"] if t["fault"]]
    start = f"The 90 % intervals of these predictions hold {held} of {n} readings."
    if not faults:
        return start
    return f"{start} But {listed(faults)}, by more than chance does in one fit of a hundred."


def _outliers(page: Mapping[str, Any]) -> str:
    found = [r for r in page["readings"] if r["outlier"]]
    if not found:
        return "No reading is an outlier."
    found.sort(key=lambda r: r["chance"])
    more = f", and {len(found) - _FEW} more" if len(found) > _FEW else ""
    what = "Outlier" if len(found) == 1 else f"{len(found)} outliers"
    return (
        f"{what}: {'; '.join(_told(r) for r in found[:_FEW])}{more}. Look at how they were measured and written down."
    )


def _told(reading: Mapping[str, Any]) -> str:
    """'efficiency at 550 mm: measured 67.8 %, expected 68.1 % without it (90 % interval ..., z = -0.2, k = 0.6)'"""
    expected, low, high = (_shown(reading, reading[key]) for key in ("expected", "q05", "q95"))
    measured = (
        f"measured {_shown(reading, reading['measured'])}"
        if "measured" in reading
        else (f"at most {_shown(reading, reading['at_most'])}")
    )
    z = f", z = {reading['z']:+.1f}" if reading["z"] is not None else ""
    k = "far above 1" if reading["pareto_k"] is None else f"= {reading['pareto_k']:.2f}"
    interval = f"90 % interval {low} to {high}{z}, k {k}"
    return f"{named(reading)}: {measured}, expected {expected} without it ({interval})"


def _shown(reading: Mapping[str, Any], value: float) -> str:
    """A value of a reading's kind with its unit."""
    if readings_called(reading["table"]).are_efficiencies:
        return f"{100 * value:.{decimals(100 * reading['sd'])}f} %"
    unit = "" if reading["unit"] == "1" else f" {reading['unit']}"
    return f"{value:.{decimals(reading['sd'])}f}{unit}"


def _trends(page: Mapping[str, Any]) -> str:
    parts = []
    for t in page["trends"]:
        what = t["group"] or readings_called(t["table"]).words
        along = "" if t["against"] == "Stroke" else f" with the {t['against'].split(' (')[0].lower()}"
        parts.append(f"those of {what} {t['shape']}{along if t['shape'] in {'grow', 'fall'} else _over(along)}")
    if not parts:
        return ""
    return (
        f"Deviations from the model are not all chance: {listed(parts)}. The model lacks something that matters there."
    )


def _over(along: str) -> str:
    return along.replace(" with the ", " of the ", 1)


def _decisive(page: Mapping[str, Any]) -> str:
    """Readings that the fit leans on."""
    found = sorted((r for r in page["readings"] if r["decisive"]), key=lambda r: -(r["pareto_k"] or 9.0))
    if not found:
        return ""
    return (
        f"The fit leans on {_few(named(r) for r in found)} (k above 0.7): without {_one(len(found))} it would be "
        "markedly different, so measure there again first if in doubt."
    )


def _one(n: int) -> str:
    return "it" if n == 1 else "one of them"


def _few(names: Iterable[str]) -> str:
    every = list(names)
    rest = [f"{len(every) - _FEW} more"] if len(every) > _FEW else []
    return listed([*every[:_FEW], *rest])


def _outside(page: Mapping[str, Any]) -> str:
    """Readings outside the range of the curves, which test the model where it was not made for."""
    found = [r for r in page["readings"] if not r["inside"] and not r["outlier"]]
    if not found:
        return ""
    more = f"; and {len(found) - _FEW} more" if len(found) > _FEW else ""
    return f"Outside the range of the curves: {'; '.join(_told(r) for r in found[:_FEW])}{more}."


def _priors(page: Mapping[str, Any]) -> str:
    """What priors do to coefficients and design answers."""
    every = page["sensitivities"]
    conflicts = [s for s in every if s["diagnosis"] == "conflict"]
    felt = [s for s in every if s["diagnosis"] in {"prior decides", "both count"}]
    parts = []
    if conflicts:
        parameters = list(dict.fromkeys(s["parameter"] for s in conflicts))
        far = max(abs(s["prior_sds"]) for s in conflicts)
        parts.append(
            f"Prior and readings contradict each other about {listed(parameters)}: what was found lies {far:.1f} standard "
            f"deviations of the prior from its middle{_moved(conflicts)}. Check the prior, its unit first."
        )
    if felt:
        parts.append(f"The prior counts for {listed([_answer(s) for s in felt])}{_moved(felt)}.")
    if not parts and every:
        answers = " and the design answer" if any(s["quantity"] in _ANSWERS for s in every) else ""
        parts.append(f"Priors hardly count for the coefficients{answers}; the readings decide.")
    return " ".join(parts)


def _answer(s: Mapping[str, Any]) -> str:
    name = _ANSWERS.get(s["quantity"], s["quantity"])
    return name if s["parameter"] == s["quantity"] else f"{name} (that of {s['parameter']})"


def _moved(found: list[Any]) -> str:
    """How far the quantity that moves most would move with a wider prior."""
    known = [s for s in found if s["wider"] is not None and s["sd"]]
    if not known:
        return ""
    s = max(known, key=lambda s: abs(s["wider"] - s["median"]) / s["sd"])
    digits = decimals(s["sd"]) + 1
    return (
        f"; were the prior of {s['parameter']} 1.4 times as wide, {_ANSWERS.get(s['quantity'], s['quantity'])} would be "
        f"{s['wider']:.{digits}f} instead of {s['median']:.{digits}f}"
    )
