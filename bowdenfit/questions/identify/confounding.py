"""Parameters that the measurements cannot tell apart, and the combination of them that they do determine."""

from dataclasses import dataclass
from itertools import combinations
from typing import ClassVar

import numpy as np

from bowdenfit.results.record import Record
from bowdenfit.words import significant

_ROLES = {"friction", "friction_model", "sensor", "angle", "elastic"}
_CLOSE = 0.9  # correlation beyond which two parameters are said to be confounded
_WELL = 0.1  # relative standard deviation below which a positive quantity is known well
_WORTH_SAYING = 0.5  # the combination must be known to less than this share of what it would be without the correlation


@dataclass(frozen=True)
class Confounded:
    """Two parameters of which only a combination is known.

    Args:
        first, second: Their names.
        factor: The combination is first + factor x second, in shown units.
        mean, sd: Of the combination.
        first_sd, second_sd: Of the parameters by themselves.
        correlation: Of their draws.
    """

    first: str
    second: str
    factor: float
    mean: float
    sd: float
    first_sd: float
    second_sd: float
    correlation: float

    JSON: ClassVar = (..., "combination")

    @property
    def combination(self) -> str:
        """The combination in symbols."""
        sign = "+" if self.factor >= 0 else "-"
        return f"{self.first} {sign} {significant(abs(self.factor))} {self.second}"

    def sentence(self) -> str:
        """What to say of it."""
        digits = int(np.clip(1 - np.floor(np.log10(max(self.sd, 1e-12))), 0, 8))
        return (
            f"The measurements hardly tell {self.first} and {self.second} apart (correlation {self.correlation:+.2f}); what "
            f"they do determine is {self.combination} = {self.mean:z.{digits}f} ± {self.sd:z.{digits}f}, while {self.first} "
            f"alone is known to ± {significant(self.first_sd, 2)}."
        )


def confounded_pairs(fit: Record) -> list[Confounded]:
    """Pairs of parameters whose draws lie along a line, the closest first; empty without draws."""
    if fit.sampled is None:
        return []
    names = [
        p.name for p in fit.model.space.free if p.role in _ROLES and not (p.role == "elastic" and _known(fit, p.name))
    ]
    pairs = [_pair(fit, a, b) for a, b in combinations(names, 2)]
    found = [pair for pair in pairs if abs(pair.correlation) > _CLOSE and pair.sd < _WORTH_SAYING * pair.first_sd]
    return sorted(found, key=lambda pair: -abs(pair.correlation))


def _known(fit: Record, name: str) -> bool:
    """Whether a parameter is known well by itself, so that what it is correlated with does not matter."""
    draws = fit.posterior.values[name]
    return bool(np.std(draws) < _WELL * np.abs(np.median(draws)))


def _pair(fit: Record, first: str, second: str) -> Confounded:
    a, b = fit.posterior.values[first].ravel(), fit.posterior.values[second].ravel()
    covariance = np.cov(a, b)
    factor = -covariance[0, 1] / covariance[1, 1] if covariance[1, 1] > 0 else 0.0
    spread = np.sqrt(covariance[0, 0] * covariance[1, 1])
    correlation = float(covariance[0, 1] / spread) if spread > 0 else 0.0
    together = a + factor * b
    a_sd, b_sd = (float(np.std(x)) for x in (a, b))
    return Confounded(
        first, second, float(factor), float(together.mean()), float(together.std()), a_sd, b_sd, correlation
    )
