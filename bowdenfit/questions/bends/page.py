"""The page about stretch, preload and loops in `summary.json`; people's version is made from the same numbers."""

from dataclasses import asdict
from typing import Any

import numpy as np

from bowdenfit.description.elastic import PRELOAD
from bowdenfit.errors import UsageError
from bowdenfit.inference.interval import Interval
from bowdenfit.questions.bends.answer import TAUT, PreloadAnswer, elastic_answers, friction_arm, has_elastic_answers
from bowdenfit.questions.bends.equations import bending_contact
from bowdenfit.results.record import Record

_CLOSE = -0.9  # correlation of logarithms beyond which only a product is said to be known


def elastic_page(fit: Record) -> dict[str, Any]:
    """Answers at the wrap angles that were measured at, and sentences; empty where there are none or no draws."""
    if fit.posterior is None or not has_elastic_answers(fit):
        return {}
    page: dict[str, Any] = {
        "input_force": elastic_answers(fit).reference_force,
        "friction_unit": friction_arm(fit)[1],
        "bends": [],
    }
    window = None
    if has_bends(fit):
        bends, draws, window = elastic_answers(fit).usual
        page["bends"] = _bends(fit, bends, draws)
    if window is not None:
        page["preload_window"] = window_page(fit, window)
    page["sentences"] = [*_sentences(fit, window), *products_with_preload(fit)]
    return page


def has_bends(fit: Record) -> bool:
    """Whether there are answers at wrap angles, and a wrap angle says which contact is bent."""
    try:
        bending_contact(fit.model)
    except UsageError:
        return False
    return has_elastic_answers(fit)


def _bends(fit: Record, bends: np.ndarray, draws: dict[str, np.ndarray]) -> list[dict[str, Any]]:
    """One row a wrap angle, in the units that are shown."""
    scale = {"friction": friction_arm(fit)[0], "efficiency": 100.0}
    return [
        {"wrap_angle": float(f"{angle:.6g}")}
        | {name: asdict(Interval.of(scale.get(name, 1.0) * d[:, i])) for name, d in draws.items()}
        for i, angle in enumerate(np.rad2deg(bends))
    ]


def window_page(fit: Record, window: PreloadAnswer) -> dict[str, Any]:
    """A preload window as plain data; angles in deg, friction in the unit that it is felt in."""
    arm, unit = friction_arm(fit)
    felt = {name: arm * value for name, value in asdict(window.felt).items()}
    return {
        "bends": [float(angle) for angle in np.rad2deg(window.bends)],
        "reference_angle": float(np.rad2deg(window.reference_angle)),
        "input_force": window.input_force,
        "friction_limit": arm * window.friction,
        "friction_unit": unit,
        "lowest": asdict(window.lowest),
        "highest": asdict(window.highest) if window.highest is not None else None,
        "best": window.best,
        "felt": felt,
        "possible": window.possible,
    }


def _sentences(fit: Record, window: PreloadAnswer | None) -> list[str]:
    sentences = []
    if window is not None:
        sentences.append(window_sentence(fit, window))
    warning = fit.dataset.description.cable.sharp_bend
    if warning:
        sentences.append("Warning: " + warning)
    return sentences


def window_sentence(fit: Record, window: PreloadAnswer) -> str:
    """The preload window in words."""
    low, high = (f"{angle:.4g}" for angle in np.rad2deg(window.bends))
    page, (_, unit) = window_page(fit, window), friction_arm(fit)
    at = "" if np.isnan(window.reference_angle) else f" at {page['reference_angle']:.4g} deg"
    under = f" under up to {window.input_force:g} N" if window.input_force > 0 else ""
    lowest = window.lowest
    parts = [
        f"Over bends from {low} to {high} deg{under} the cable stays taut from a preload of {lowest.median:.3g} N{at} on (90 % "
        f"interval {lowest.q05:.3g} to {lowest.q95:.3g} N). Least friction is felt without slack, with {TAUT:.0%} "
        f"probability, at {window.best:.3g} N: then free motion takes {page['felt']['median']:.3g} {unit} "
        f"({page['felt']['q05']:.3g} to {page['felt']['q95']:.3g}) at the bend where it is most."
    ]
    if window.highest is not None:
        parts.append(
            f"To be felt as no more than {page['friction_limit']:.3g} {unit}, preload must not exceed "
            f"{window.highest.median:.3g} N{at} ({window.highest.q05:.3g} to {window.highest.q95:.3g} N)."
        )
        if window.possible < TAUT:
            parts.append(f"That leaves a preload that does both with a probability of only {window.possible:.0%}.")
    return " ".join(parts)


def products_with_preload(fit: Record) -> list[str]:
    """What to say of coefficients of friction of which only the product with the preload is known, as in free motion."""
    names = [p.name for p in fit.model.space.free]
    if fit.posterior is None or PRELOAD not in names:
        return []
    preload, sentences = fit.posterior.values[PRELOAD].ravel(), []
    for name in (n for n in fit.dataset.description.coefficients if n in names):
        friction = fit.posterior.values[name].ravel()
        if np.corrcoef(np.log(preload), np.log(friction))[0, 1] > _CLOSE:
            continue
        known = Interval.of(preload * friction)
        sentences.append(
            f"The measurements hardly tell {PRELOAD} and {name} apart; what they do determine is {PRELOAD} x {name} = "
            f"{known.median:.3g} N (90 % interval {known.q05:.3g} to {known.q95:.3g} N)."
        )
    return sentences
