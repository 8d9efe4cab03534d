"""Whether the draws of one of many data sets can be trusted, by as few of them as a rank or an interval needs."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from bowdenfit.inference.diagnostics import MAXIMUM_DRIFT, Diagnostics, describe_low_ess, diagnose_all
from bowdenfit.words import percent

_ENOUGH = 1000.0  # effective draws


def diagnose_few_draws(draws: Mapping[str, np.ndarray], n_ensembles: int) -> dict[str, Diagnostics]:
    """Diagnostics of a few hundred effective draws.

    Two halves of n effective draws differ by 2 / sqrt(n) of their spread by chance alone. `MAXIMUM_DRIFT` is 2.5 / sqrt(n) at a
    thousand; here twice that is allowed, with no more than a thousand: else those that had to go on for one reason would be
    judged more strictly for another.
    """
    diagnostics = diagnose_all(draws, n_ensembles)
    allowed = {name: 2.5 / np.sqrt(np.clip(min(d.ess_bulk, d.ess_tail), 1.0, _ENOUGH)) for name, d in diagnostics.items()}
    return {name: replace(d, drift=float(d.drift / allowed[name]) / 2 * MAXIMUM_DRIFT) for name, d in diagnostics.items()}


def describe_remembered_starts(diagnostics: Mapping[str, Diagnostics], least: int) -> tuple[str, ...]:
    """Where too few effective draws were made for walkers to have forgotten where they started, in words."""
    return tuple(
        describe_low_ess(f"the middle of {name}", d.ess_bulk, least)
        for name, d in diagnostics.items()
        if not d.ess_bulk >= least
    )


def estimate_sd_errors(draws: Mapping[str, np.ndarray]) -> dict[str, float]:
    """Monte Carlo error of each standard deviation as a share of it; draws are (walker, draw)."""
    from arviz_stats.base import array_stats

    return {
        name: float(array_stats.mcse(values, method="sd", chain_axis=0, draw_axis=1) / np.std(values))
        for name, values in draws.items()
        if np.ptp(values) > 0
    }


def describe_uncertain_sds(errors: Mapping[str, float], most: float) -> tuple[str, ...]:
    """Which standard deviations are not known well enough, in words."""
    return tuple(
        f"the standard deviation of {name} is known to {percent(error)} and should be to {percent(most)}"
        for name, error in errors.items()
        if not error <= most
    )
