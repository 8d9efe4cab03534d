"""The parameters of a model: which are free, which fixed, the map between z and named values, and scales of default priors."""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any, Literal

import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

from bowdenfit.errors import DescriptionError
from bowdenfit.parameters.priors import Prior
from bowdenfit.words import significant

Role = Literal["friction", "friction_model", "curve", "departure", "angle", "noise", "sensor", "elastic"]


@dataclass(frozen=True)
class Scale:
    """Size of the measurements to which default priors are proportional, whatever the unit or the size of the bench.

    Args:
        value: Size in internal units, above 0.
        name: Name of the size, such as "median load".
        unit: Unit in which it is shown.
    """

    value: float
    name: str
    unit: str

    def __str__(self) -> str:
        """Return a phrase such as "the median load, 39.1 N"."""
        return f"the {self.name}, {significant(self.value)} {self.unit}"

    def describe_share(self, part: float) -> str:
        """Return a phrase such as "5 % of the median load, 39.1 N"."""
        return f"{significant(100 * part)} % of {self}"


@dataclass(frozen=True)
class Parameter:
    """One parameter of the model, declared once for fit, tables, figures and report.

    Args:
        name: Unique machine-readable name.
        symbol: Symbol for figures, in matplotlib's math notation.
        meaning: One phrase for tables and reports.
        role: Group that it belongs to; decides how least squares treats it and where it is shown.
        prior: Prior in internal units.
        unit: Unit in which it is shown ("1" where there is none).
        shown_scale: Shown value over internal value.
        fixed: Value [internal unit] where it is held fixed, else None.
        prior_words: Description of the prior that replaces its own text.
        scaled_by: Measurements that a default prior is proportional to; empty where there are none.
        starts: z from which the maximum of the density is searched: several where there may be several maxima, none where
            `first_look` suffices.
        first_look: Further start of that search, as a value [internal unit]; NaN where there is none.
    """

    name: str
    symbol: str
    meaning: str
    role: Role
    prior: Prior
    unit: str = "1"
    shown_scale: float = 1.0
    fixed: float | None = None
    prior_words: str = ""
    scaled_by: str = ""
    starts: tuple[float, ...] = (0.0,)
    first_look: float = float("nan")

    @property
    def label(self) -> str:
        """Symbol and unit for an axis."""
        return self.symbol if self.unit == "1" else f"{self.symbol} ({self.unit})"

    @property
    def prior_text(self) -> str:
        """The prior as people read it."""
        stated = self.prior_words or ("" if self.fixed is None else "fixed")
        return stated or self.prior.text(self.unit, self.shown_scale, 3 if self.scaled_by else 6)


@dataclass(frozen=True)
class ParameterSpace:
    """All parameters of a model, and the map from z (free parameters, standard normal) to named values."""

    parameters: tuple[Parameter, ...]

    def __post_init__(self) -> None:
        names = [p.name for p in self.parameters]
        for name in names:
            if names.count(name) > 1:
                raise DescriptionError(
                    f"Two parameters are both called {name!r}; "
                    "rename the friction coefficient or the angle column in cable.toml."
                )

    @cached_property
    def free(self) -> tuple[Parameter, ...]:
        """The parameters that are inferred, in the order of z."""
        return tuple(p for p in self.parameters if p.fixed is None)

    @cached_property
    def fixed(self) -> tuple[Parameter, ...]:
        """The parameters that are held at a value."""
        return tuple(p for p in self.parameters if p.fixed is not None)

    @property
    def size(self) -> int:
        """Number of free parameters."""
        return len(self.free)

    @cached_property
    def index(self) -> dict[str, int]:
        """Position of each free parameter in z."""
        return {p.name: i for i, p in enumerate(self.free)}

    @cached_property
    def _groups(self) -> tuple[tuple[np.ndarray, Prior], ...]:
        """Free parameters by kind of prior: positions, and one prior with array hyperparameters."""
        kinds: dict[type, list[int]] = {}
        for i, parameter in enumerate(self.free):
            kinds.setdefault(type(parameter.prior), []).append(i)
        return tuple(
            (np.array(where), _stack_priors(kind, [self.free[i].prior for i in where])) for kind, where in kinds.items()
        )

    @cached_property
    def _order(self) -> np.ndarray:
        """Permutation from the order of the groups to that of z."""
        return np.argsort(np.concatenate([where for where, _ in self._groups]))

    def vector(self, z: Float[Array, " free"]) -> Float[Array, " free"]:
        """Return values of the free parameters [internal units] at z."""
        if not self._groups:
            return z
        return jnp.concatenate([prior.constrain(z[where]) for where, prior in self._groups])[self._order]

    def z_of(self, vector: Float[Array, " free"]) -> Float[Array, " free"]:
        """Return z at values of the free parameters [internal units], the inverse of `vector`; NaN at impossible values."""
        if not self._groups:
            return vector
        return jnp.concatenate([prior.unconstrain(vector[where]) for where, prior in self._groups])[self._order]

    def constrain(self, z: Float[Array, " free"]) -> dict[str, Array]:
        """Return named values of all parameters, fixed ones included [internal units], at z."""
        return self.named(self.vector(z))

    def named(self, vector: Float[Array, " free"]) -> dict[str, Array]:
        """Return named values of all parameters, fixed ones included, from a vector of the free ones [internal units]."""
        values = {p.name: vector[i] for i, p in enumerate(self.free)}
        return values | {p.name: jnp.asarray(p.fixed, dtype=vector.dtype) for p in self.fixed}

    def unconstrain(self, values: Mapping[str, Any]) -> Float[Array, " free"]:
        """Return z at named values [internal units]."""
        return jnp.array(
            [p.prior.unconstrain(jnp.asarray(values[p.name], dtype=float)) for p in self.free], dtype=float
        )


def _stack_priors(kind: type, priors: list[Any]) -> Prior:
    """Combine several priors of a kind into one whose hyperparameters are arrays."""
    return kind(**{field.name: np.array([getattr(p, field.name) for p in priors]) for field in fields(kind)})
