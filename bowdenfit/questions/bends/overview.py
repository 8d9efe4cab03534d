"""Answers about stretch and preload at the measured wrap angles."""

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from bowdenfit.description.stated_parameters import PRELOAD
from bowdenfit.errors import UsageError
from bowdenfit.inference.interval import Interval
from bowdenfit.questions.bends.answer import elastic_answers, friction_arm, has_elastic_answers
from bowdenfit.questions.bends.equations import bending_contact
from bowdenfit.questions.bends.preload_window import PreloadWindow
from bowdenfit.results.record import Record, cached_per_fit
from bowdenfit.words import significant

_MAX_CORRELATION = -0.9  # correlation of logarithms below which only the product is reported: the draws then lie along a line


@dataclass(frozen=True)
class ElasticOverview:
    """Answers about stretch and preload.

    Args:
        input_force: Force at the motor side under which they hold [N].
        friction_unit: Unit of what is felt in free motion.
        bends: One row a wrap angle [deg], with intervals by quantity; in the units that are shown.
        preload_window: Which preloads will do; None where nothing tells.
        sentences: What else there is to say.
    """

    input_force: float
    friction_unit: str
    bends: tuple[dict[str, Any], ...]
    preload_window: PreloadWindow | None
    sentences: tuple[str, ...]

    JSON: ClassVar = ("input_force", "friction_unit", "bends", "preload_window?", "sentences")


@cached_per_fit
def elastic_overview(fit: Record) -> ElasticOverview | None:
    """Answers at the wrap angles that were measured at; None without draws, or of a cable that has none."""
    if fit.sampled is None or not has_elastic_answers(fit):
        return None
    answers, (arm, unit) = elastic_answers(fit), friction_arm(fit)
    bends, draws, window = answers.usual if has_answers_at_bends(fit) else (np.zeros(0), {}, None)
    scale = {"friction": arm, "efficiency": 100.0}
    rows = tuple(
        {"wrap_angle": float(f"{angle:.6g}")}
        | {name: Interval.of(scale.get(name, 1.0) * values[:, i]) for name, values in draws.items()}
        for i, angle in enumerate(np.rad2deg(bends))
    )
    sharp = fit.dataset.description.cable.sharp_bend
    sentences = [window.sentence()] if window is not None else []
    sentences += [f"Warning: {sharp}"] if sharp else []
    return ElasticOverview(
        answers.reference_force, unit, rows, window, (*sentences, *describe_products_with_preload(fit))
    )


def has_answers_at_bends(fit: Record) -> bool:
    """Whether there are answers at wrap angles, and a wrap angle says which contact is bent."""
    try:
        bending_contact(fit.model)
    except UsageError:
        return False
    return has_elastic_answers(fit)


def describe_products_with_preload(fit: Record) -> list[str]:
    """Describe friction coefficients of which only the product with the preload is known, as in free motion."""
    names = [p.name for p in fit.model.space.free]
    if fit.sampled is None or PRELOAD not in names:
        return []
    preload, sentences = fit.posterior.values[PRELOAD].ravel(), []
    for name in (n for n in fit.dataset.description.coefficients if n in names):
        friction = fit.posterior.values[name].ravel()
        if np.corrcoef(np.log(preload), np.log(friction))[0, 1] > _MAX_CORRELATION:
            continue
        product = Interval.of(preload * friction)
        sentences.append(
            f"The measurements hardly separate {PRELOAD} from {name}; they determine the product {PRELOAD} x {name} = "
            f"{significant(product.median)} N (90 % interval {significant(product.q05)} to {significant(product.q95)} N)."
        )
    return sentences
