"""`bf.model`: the model of a data set as pure functions of its parameters, for samplers and optimizers of one's own.

All functions are JAX's: they can be differentiated, vectorized and compiled. They compute with 64-bit floats, so that a program
that uses them begins with `jax.config.update("jax_enable_x64", True)`.
"""

from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Unpack

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

from bowdenfit.arguments import DATASET, PATH, read_first
from bowdenfit.display import Display, Rows
from bowdenfit.errors import UsageError, suggest_name
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.kinds.term import Term
from bowdenfit.models import Model, build_model
from bowdenfit.reading import Reading, read
from bowdenfit.words import listed

if TYPE_CHECKING:
    from bowdenfit.dataset import Dataset
    from bowdenfit.frames import Frame


class CableModel(Display):
    """A cable's model and its readings, as functions of parameters.

    Parameters are a dictionary by name, in the units that the summary prints (`units`), or a vector z of the free ones, in
    which every prior is a standard normal and nothing is bounded.

    Args:
        model: The model with its readings.

    Raises:
        UsageError: JAX is set to 32-bit floats.
    """

    def __init__(self, model: Model) -> None:
        if jax.dtypes.canonicalize_dtype(float) != jnp.float64:
            raise UsageError(
                "bf.model computes with 64-bit floats, and JAX is set to 32; write jax.config.update('jax_enable_x64', True) "
                "at the beginning of the program."
            )
        self._model, self._density = model, LogDensity(model)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the free parameters, in the order of z."""
        return tuple(p.name for p in self._model.space.free)

    @property
    def units(self) -> dict[str, str]:
        """Unit of each free parameter; "1" where there is none."""
        return {p.name: p.unit for p in self._model.space.free}

    @property
    def readings(self) -> dict[str, np.ndarray]:
        """What was read, by kind of reading; angles in deg, forces in N, efficiencies as ratios."""
        return {term.name: term.observed() for term in self._model.terms}

    def constrain(self, z: Float[Array, " free"]) -> dict[str, Array]:
        """Return the free parameters at z, by name."""
        values = self._model.space.constrain(z)
        return {p.name: values[p.name] * p.shown_scale for p in self._model.space.free}

    def unconstrain(self, parameters: Mapping[str, Any]) -> Float[Array, " free"]:
        """Return z at values of the free parameters, the inverse of `constrain`.

        Raises:
            UsageError: A parameter is missing, or there is no such parameter.
        """
        return self._model.space.z_of(self._vector(parameters))

    def log_density(self, z: Float[Array, " free"]) -> Float[Array, ""]:
        """Return the log density of the posterior in z, up to a constant."""
        return self._density.log_density(z, self._density.data)

    def log_likelihood(self, parameters: Mapping[str, Any]) -> Float[Array, ""]:
        """Return the log likelihood of all readings."""
        return sum((jnp.sum(part) for part in self.log_likelihoods(parameters).values()), jnp.zeros(()))

    def log_likelihoods(self, parameters: Mapping[str, Any]) -> dict[str, Array]:
        """Return the log likelihood of each reading, by kind of reading."""
        values = self._values(parameters)
        return {term.name: term.log_likelihood(values, data) for term, data in self._terms_with_data}

    def log_prior(self, parameters: Mapping[str, Any]) -> Float[Array, ""]:
        """Return the log density of the prior of the free parameters, in their units."""
        space, z = self._model.space, self.unconstrain(parameters)
        _, slopes = jax.jvp(space.vector, (z,), (jnp.ones_like(z),))  # of each parameter by its own z
        scales = jnp.array([p.shown_scale for p in space.free])
        return jnp.sum(-0.5 * (z**2 + jnp.log(2 * jnp.pi)) - jnp.log(slopes * scales))

    def residuals(self, parameters: Mapping[str, Any]) -> Float[Array, " readings"]:
        """Return standardized residuals of all readings.

        Half their sum of squares is minus the log likelihood, up to a constant that depends on scales of noise: these are held
        where residuals are minimized.
        """
        by_term = self._density.residuals_at(self._values(parameters), self._density.data)
        return jnp.concatenate(list(by_term.values()))

    def expected(self, parameters: Mapping[str, Any]) -> dict[str, Array]:
        """Return what is expected of each reading, by kind of reading, in the units of `readings`."""
        values = self._values(parameters)
        return {term.name: term.expected(values, data) for term, data in self._terms_with_data}

    def efficiency(self, parameters: Mapping[str, Any], lengths: Any) -> Float[Array, " lengths"]:
        """Return the efficiency while pulling at lengths in the route's unit (ch. "Efficiency along the route" of the theory).

        Raises:
            UsageError: The cable has no route.
        """
        route = self._model.description.route
        if route is None:
            raise UsageError(f"{self._model.description.name} has no route along which its efficiency could be given.")
        return self._model.cable.efficiency_at(self._values(parameters), jnp.atleast_1d(jnp.asarray(lengths, dtype=float)))

    def sentences(self) -> list[str]:
        """Free parameters and readings."""
        return self._model.sentences()

    @property
    def _terms_with_data(self) -> list[tuple[Term, dict[str, Any]]]:
        return list(zip(self._model.terms, self._density.data, strict=True))

    @cached_property
    def _scales(self) -> dict[str, float]:
        return {p.name: p.shown_scale for p in self._model.space.free}

    def _vector(self, parameters: Mapping[str, Any]) -> Float[Array, " free"]:
        """Return values of the free parameters [internal units], in the order of z."""
        missing = [name for name in self.names if name not in parameters]
        unknown = [name for name in parameters if name not in self._scales]
        if missing or unknown:
            if unknown:
                what = f"there is no free parameter {listed(unknown)}{suggest_name(unknown[0], list(self.names))}"
            else:
                what = f"{listed(missing)} is missing"
            raise UsageError(f"{what.rstrip('?')}; the free parameters are {listed(self.names)}.")
        return jnp.stack([jnp.asarray(parameters[name], dtype=float) / scale for name, scale in self._scales.items()])

    def _values(self, parameters: Mapping[str, Any]) -> dict[str, Array]:
        return self._model.space.named(self._vector(parameters))

    def _table(self) -> Rows:
        return self._model._table()


@read_first
def model(dataset: Annotated["str | Path | Dataset | Frame", DATASET, PATH], **reading: Unpack[Reading]) -> CableModel:
    """Return the model of a data set: log density, residuals, expected readings and efficiency as pure functions of parameters.

    Args:
        dataset: See `bowdenfit.read`; its keywords are taken too.
        reading: Keywords of `bowdenfit.read`.

    Raises:
        BowdenfitError: What is wrong with the data set, in a sentence; or JAX is set to 32-bit floats.
    """
    return CableModel(build_model(read(dataset, **reading)))
