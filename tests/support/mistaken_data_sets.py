"""How a data set with a mistake in a table ends: refused, not trusted, harmless, or trusted and wrong."""

from pathlib import Path

import bowdenfit as bf
from bowdenfit.inference.interval import Interval

ENDS = REFUSED, NOT_TRUSTED, HARMLESS, WRONG = "refused", "exit 3", "exit 0 and right", "exit 0 and WRONG"
_ROLES = {"friction", "friction_model", "elastic"}
_NORMAL_90 = 1.645


def answers(fit: bf.Fit) -> dict[str, Interval]:
    """Coefficients and the best length with their 90 % intervals; of least squares those of a normal distribution."""
    names = [p.name for p in fit.model.space.free if p.role in _ROLES]
    if fit.sampled is None:
        estimates = {name: fit.least_squares.estimates[name] for name in names}
        return {name: _normal(interval.value, interval.standard_error) for name, interval in estimates.items()}
    best = {"best length": fit.optimal_length().length} if fit.dataset.description.route else {}
    return {name: fit.parameter(name) for name in names} | best


def _normal(value: float, sd: float) -> Interval:
    return Interval(value, sd, value, value - _NORMAL_90 * sd, value + _NORMAL_90 * sd)


def outside(estimates: dict[str, Interval], clean: dict[str, Interval]) -> list[str]:
    """Answers that lie outside the intervals of the fit without the mistake."""
    both = [(name, estimates[name].median, clean[name]) for name in estimates if name in clean]
    return [
        f"{name} {estimate:.4g}, not {c.q05:.4g} to {c.q95:.4g}" for name, estimate, c in both if not c.q05 <= estimate <= c.q95
    ]


def end_of(folder: Path, clean: dict[str, Interval], mcmc: bool) -> tuple[str, str]:
    """How a data set with a mistake ends, and why in words."""
    try:
        fit = bf.fit(folder, mcmc=False, seed=1)
        if mcmc and fit.verdict().trusted:
            fit = bf.fit(folder, seed=1)
        verdict = fit.verdict()
    except bf.BowdenfitError as error:
        return REFUSED, str(error)
    if not verdict.trusted:
        return NOT_TRUSTED, ", ".join(verdict.troubles)
    off = outside(answers(fit), clean)
    return (WRONG, "; ".join(off)) if off else (HARMLESS, "")
