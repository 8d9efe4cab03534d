"""Curves of many draws for the figures of a cable that stretches or has preload, and the range of bends they show.

Quantiles have the 5 %, 50 % and 95 % quantiles of the draws as first axis; one row, the least-squares line, without draws.
"""

from collections.abc import Callable, Mapping
from typing import Any

import jax
import numpy as np
from jax import Array

from bowdenfit.errors import UsageError
from bowdenfit.inference.draws import BATCH, for_each_value
from bowdenfit.questions.bends.answer import elastic_answers
from bowdenfit.questions.bends.equations import has_preload
from bowdenfit.results.record import Record, thinned_parameter_values

QUANTILES = (0.05, 0.5, 0.95)
POINTS = 61  # of a line
_LEAST_BEND = 0.1  # rad; a figure against the wrap angle needs a range

Values = Mapping[str, Array]


def evaluate_curves(fit: Record, curves: Callable[[Values], dict[str, Any]]) -> dict[str, np.ndarray]:
    """Evaluate curves for some of the draws (rows), or for least squares alone.

    Args:
        fit: The fit.
        curves: Function of the values of one draw.
    """
    values = thinned_parameter_values(fit, 1 if fit.sampled is None else BATCH)
    with jax.enable_x64(True):
        found_curves: dict[str, np.ndarray] = for_each_value(curves, values)
    return found_curves


def quantiles_of_draws(draws: np.ndarray) -> np.ndarray:
    """5 %, 50 % and 95 % quantiles over the draws; the one line without draws."""
    return draws if len(draws) == 1 else np.quantile(draws, QUANTILES, axis=0)


def measured_loop_bends(fit: Record) -> np.ndarray | None:
    """Wrap angles that a loop with preload was measured at [rad]; None of anything else."""
    if not fit.model.cable.is_loop or not has_preload(fit.model):
        return None
    try:
        return elastic_answers(fit).measured_bends
    except UsageError:  # no wrap angle says which of several contacts is bent
        return None


def range_of_bends(fit: Record) -> tuple[float, float] | None:
    """Return the smallest and largest measured wrap angle of a loop; None where there is no range to show."""
    bends = measured_loop_bends(fit)
    return (float(bends[0]), float(bends[-1])) if bends is not None and len(bends) and bends[-1] > _LEAST_BEND else None


def describe_reference_angle(fit: Record) -> str:
    """'at 0 deg', where preload depends on the wrap angle."""
    settings, follows = fit.dataset.description.preload, fit.dataset.description.preload_follows_stretch
    return f"at {settings.wrap_angle.value:g} {settings.wrap_angle.unit}" if follows else ""
