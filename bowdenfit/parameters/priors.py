"""Priors as maps from a standard normal onto their support.

Each prior is two functions, `constrain` and its inverse `unconstrain`. In the coordinates z every prior is the standard
normal, whatever it is in physical units, so that no Jacobian, bound or density has to be written anywhere else.
A prior's hyperparameters may be arrays, so that parameters with priors of one kind are mapped in one operation.
"""

from dataclasses import dataclass
from typing import ClassVar, Protocol, TypeAlias, runtime_checkable

import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.scipy.special import erf, erfc, erfinv, ndtr, ndtri
from jax.scipy.stats import norm
from jaxtyping import Float

_NEAR_ZERO = 1e-4  # step below which quantiles are computed from their series
_FARTHEST = 20.0  # z; the half-Cauchy's quantile there is 1e88 of its scale

Numbers: TypeAlias = Array | np.ndarray
Real: TypeAlias = float | Float[Numbers, "*any"]


@runtime_checkable
class Prior(Protocol):
    """Interface of a prior."""

    allowed_ends: ClassVar[tuple[bool, bool]]
    """Whether its density goes on undiminished to the lower and to the upper end of its range."""

    def constrain(self, z: Float[Numbers, "*any"]) -> Float[Numbers, "*any"]:
        """Return the parameter at z: its quantile of Phi(z)."""
        ...

    def unconstrain(self, value: Float[Numbers, "*any"]) -> Float[Numbers, "*any"]:
        """Return z at a parameter value: the inverse of `constrain`."""
        ...

    def text(self, unit: str = "", scale: float = 1.0, digits: int = 6) -> str:
        """Return the prior as users read it.

        Args:
            unit: Unit in which it is shown; empty or "1" where there is none.
            scale: Shown value over internal value.
            digits: Significant digits of numbers with a unit.
        """
        ...

    def widening(self, value: np.ndarray, factor: float) -> np.ndarray:
        """Return the log ratio of the density with its scale times a factor to its own, up to a constant; 0 without a scale."""
        ...


@dataclass(frozen=True)
class Normal:
    """Normal(mean, sd): a quantity of either sign."""

    mean: Real
    sd: Real
    allowed_ends: ClassVar = False, False

    def constrain(self, z: Float[Numbers, "*any"]) -> Float[Numbers, "*any"]:
        """Return mean + sd z."""
        return self.mean + self.sd * z

    def unconstrain(self, value: Float[Numbers, "*any"]) -> Float[Numbers, "*any"]:
        """Return (value - mean) / sd."""
        return (value - self.mean) / self.sd

    def text(self, unit: str = "", scale: float = 1.0, digits: int = 6) -> str:
        """Return "Normal(mean, sd) unit"."""
        return f"Normal({_number(self.mean, scale, digits)}, {_number(self.sd, scale, digits)}){_suffix(unit)}"

    def widening(self, value: np.ndarray, factor: float) -> np.ndarray:
        """See `Prior`."""
        return _widening((value - self.mean) / self.sd, factor)


@dataclass(frozen=True)
class LogNormal:
    """LogNormal: a positive quantity known to a factor; `median` and the sd of its natural logarithm."""

    median: Real
    log_sd: Real
    allowed_ends: ClassVar = False, False

    def constrain(self, z: Float[Numbers, "*any"]) -> Float[Numbers, "*any"]:
        """Return median exp(log_sd z)."""
        return self.median * jnp.exp(self.log_sd * z)

    def unconstrain(self, value: Float[Numbers, "*any"]) -> Float[Numbers, "*any"]:
        """Return log(value / median) / log_sd."""
        return jnp.log(value / self.median) / self.log_sd

    def text(self, unit: str = "", scale: float = 1.0, digits: int = 6) -> str:
        """Return "LogNormal(median unit, log_sd)"."""
        return f"LogNormal({_number(self.median, scale, digits)}{_suffix(unit)}, {_number(self.log_sd)})"

    def widening(self, value: np.ndarray, factor: float) -> np.ndarray:
        """See `Prior`."""
        return _widening(np.log(value / self.median) / self.log_sd, factor)


@dataclass(frozen=True)
class HalfNormal:
    """HalfNormal(sd): a scale that may be zero."""

    sd: Real
    allowed_ends: ClassVar = True, False

    def constrain(self, z: Float[Numbers, "*any"]) -> Float[Numbers, "*any"]:
        """Return the quantile, computed from the nearer tail by one error function."""
        is_low = z < 0
        tail = erfc(jnp.where(is_low, -z, z) * (0.5 * np.sqrt(2.0))) / 2  # Phi(-|z|)
        low = np.sqrt(2.0) * erfinv(jnp.where(is_low, tail, 0.5))
        high = -ndtri(jnp.where(is_low, 0.5, tail) / 2)
        return self.sd * jnp.where(is_low, low, high)

    def unconstrain(self, value: Float[Numbers, "*any"]) -> Float[Numbers, "*any"]:
        """Return the standard normal quantile of 2 Phi(value / sd) - 1."""
        x = value / self.sd
        tail = 2 * ndtr(-x)
        return jnp.where(tail < 0.5, -ndtri(jnp.minimum(tail, 0.5)), ndtri(erf(x / jnp.sqrt(2.0))))

    def text(self, unit: str = "", scale: float = 1.0, digits: int = 6) -> str:
        """Return "HalfNormal(sd unit)"."""
        return f"HalfNormal({_number(self.sd, scale, digits)}{_suffix(unit)})"

    def widening(self, value: np.ndarray, factor: float) -> np.ndarray:
        """See `Prior`."""
        return _widening(value / self.sd, factor)


@dataclass(frozen=True)
class HalfCauchy:
    r"""HalfCauchy(scale) to a power: a scale of which little more than its order of magnitude is known.

    .. math:: x = \left(s \tan\left(\tfrac\pi2 \Phi(z)\right)\right)^q

    On the logarithm it is symmetric about its median: nine tenths of x lie between s/12.7 and 12.7 s (q = 1), and its tails
    are so heavy that the readings can override it. Zero is allowed.

    Args:
        scale: s, the median where q = 1.
        power: q; 2 for a quantity whose root is half-Cauchy.

    References:
        Gelman, Prior distributions for variance parameters in hierarchical models, Bayesian Analysis 1 (2006), 515.
    """

    scale: Real
    power: Real = 1.0
    allowed_ends: ClassVar = True, False

    def constrain(self, z: Float[Numbers, "*any"]) -> Float[Numbers, "*any"]:
        """Return the quantile, computed from the nearer tail; constant beyond z = 20, where its derivative would overflow."""
        below, above = _split(jnp.minimum(z, _FARTHEST))
        ratio = jnp.where(z < 0, jnp.tan(jnp.pi / 2 * ndtr(below)), 1 / jnp.tan(jnp.pi / 2 * ndtr(-above)))
        return (self.scale * ratio) ** self.power

    def unconstrain(self, value: Float[Numbers, "*any"]) -> Float[Numbers, "*any"]:
        """Return the standard normal quantile of the half-Cauchy distribution function."""
        root = value ** (1 / self.power)
        lower, upper = 2 / jnp.pi * jnp.arctan2(root, self.scale), 2 / jnp.pi * jnp.arctan2(self.scale, root)
        return jnp.where(root < self.scale, ndtri(lower), -ndtri(upper))

    def text(self, unit: str = "", scale: float = 1.0, digits: int = 6) -> str:
        """Return "HalfCauchy(scale unit)", with its power where that is not 1."""
        power = "" if self.power == 1 else f"^{float(self.power):g}"
        return f"HalfCauchy({_number(self.scale, scale, digits)}{_suffix(unit)}){power}"

    def widening(self, value: np.ndarray, factor: float) -> np.ndarray:
        """See `Prior`."""
        ratio = value ** (1 / self.power) / self.scale
        return np.log1p(ratio**2) - np.log1p((ratio / factor) ** 2)


@dataclass(frozen=True)
class JohnsonSU:
    r"""JohnsonSU(scale): a quantity of either sign that is usually near 0 and sometimes far from it.

    .. math:: x = s \sinh z

    Nine tenths of x lie within 2.5 s of 0, and one in a hundred is beyond 6.5 s.

    References:
        Johnson, Systems of frequency curves generated by methods of translation, Biometrika 36 (1949), 149.
    """

    scale: Real
    allowed_ends: ClassVar = False, False

    def constrain(self, z: Float[Numbers, "*any"]) -> Float[Numbers, "*any"]:
        """Return scale sinh(z)."""
        grown = jnp.exp(z)
        return self.scale * (grown - 1 / grown) / 2

    def unconstrain(self, value: Float[Numbers, "*any"]) -> Float[Numbers, "*any"]:
        """Return arsinh(value / scale)."""
        return jnp.arcsinh(value / self.scale)

    def text(self, unit: str = "", scale: float = 1.0, digits: int = 6) -> str:
        """Return "JohnsonSU(scale unit)"."""
        return f"JohnsonSU({_number(self.scale, scale, digits)}{_suffix(unit)})"

    def widening(self, value: np.ndarray, factor: float) -> np.ndarray:
        """See `Prior`."""
        ratio = value / self.scale
        normal = (np.arcsinh(ratio) ** 2 - np.arcsinh(ratio / factor) ** 2) / 2
        return normal - np.log((ratio**2 + factor**2) / (ratio**2 + 1)) / 2


@dataclass(frozen=True)
class Uniform:
    """Uniform(low, high): only the limits are known."""

    low: Real
    high: Real
    allowed_ends: ClassVar = True, True

    def constrain(self, z: Float[Numbers, "*any"]) -> Float[Numbers, "*any"]:
        """Return low + (high - low) Phi(z), computed from the nearer end."""
        width = self.high - self.low
        return jnp.where(z < 0, self.low + width * ndtr(z), self.high - width * ndtr(-z))

    def unconstrain(self, value: Float[Numbers, "*any"]) -> Float[Numbers, "*any"]:
        """Return the standard normal quantile of the fraction of the range."""
        fraction = (value - self.low) / (self.high - self.low)
        return jnp.where(fraction < 0.5, ndtri(fraction), -ndtri(1 - fraction))

    def text(self, unit: str = "", scale: float = 1.0, digits: int = 6) -> str:
        """Return "Uniform(low, high) unit"."""
        return f"Uniform({_number(self.low, scale, digits)}, {_number(self.high, scale, digits)}){_suffix(unit)}"

    def widening(self, value: np.ndarray, factor: float) -> np.ndarray:
        """See `Prior`."""
        del factor  # limits are no scale
        return np.zeros(np.shape(value))


@dataclass(frozen=True)
class TruncatedNormal:
    """Normal(mean, sd) truncated at 0: a coefficient measured separately, with its standard deviation."""

    mean: Real
    sd: Real
    allowed_ends: ClassVar = False, False

    def constrain(self, z: Float[Numbers, "*any"]) -> Float[Numbers, "*any"]:
        """Return the quantile, computed from the nearer tail; next to 0, where digits cancel, from its series."""
        ratio = self.mean / self.sd
        below, above = _split(z)
        per_density = ndtr(ratio) * jnp.exp(jnp.minimum(-norm.logpdf(ratio), 700.0))  # inf would spoil derivatives
        step = per_density * ndtr(below)
        near = step * (1 + ratio) < _NEAR_ZERO
        step = jnp.where(near, step, 0.0)
        series = step - ratio * step**2 / 2 + (2 * ratio**2 + 1) * step**3 / 6
        low = ratio + ndtri(ndtr(-ratio) + ndtr(ratio) * ndtr(jnp.where(near, -1.0, below)))
        high = ratio - ndtri(ndtr(ratio) * ndtr(-above))
        return self.sd * jnp.where(z < 0, jnp.where(near, series, low), high)

    def unconstrain(self, value: Float[Numbers, "*any"]) -> Float[Numbers, "*any"]:
        """Return the standard normal quantile of the truncated distribution function."""
        ratio, x = self.mean / self.sd, value / self.sd
        above = ndtr(ratio)
        upper = ndtr(ratio - x) / above
        series = jnp.exp(norm.logpdf(ratio)) * (x + ratio * x**2 / 2 + (ratio**2 - 1) * x**3 / 6)
        lower = jnp.where(x * (1 + ratio) < _NEAR_ZERO, series, ndtr(x - ratio) - ndtr(-ratio)) / above
        return jnp.where(upper < 0.5, -ndtri(jnp.minimum(upper, 0.5)), ndtri(jnp.minimum(lower, 0.5)))

    def text(self, unit: str = "", scale: float = 1.0, digits: int = 6) -> str:
        """Return "Normal(mean, sd) unit, cut off at 0"."""
        return f"{Normal(self.mean, self.sd).text(unit, scale, digits)}, cut off at 0"

    def widening(self, value: np.ndarray, factor: float) -> np.ndarray:
        """See `Prior`."""
        return _widening((value - self.mean) / self.sd, factor)


def _split(z: Float[Numbers, "*any"]) -> tuple[Float[Numbers, "*any"], Float[Numbers, "*any"]]:
    """Return z for the lower and the upper branch of a quantile, each harmless where the other branch is taken.

    (A plain minimum or maximum would halve the derivative at z = 0, where least squares starts.)
    """
    return jnp.where(z < 0, z, -1.0), jnp.where(z < 0, 1.0, z)


def _widening(deviation: np.ndarray, factor: float) -> np.ndarray:
    """Return the log ratio for a normal, given deviations in its standard deviations."""
    return deviation**2 * (1 - factor**-2) / 2


def _number(value: Real, scale: float = 1.0, digits: int = 6) -> str:
    """Return a hyperparameter in its shown unit."""
    return f"{float(value) * scale:.{digits}g}"


def _suffix(unit: str) -> str:
    return "" if unit in {"", "1"} else f" {unit}"
