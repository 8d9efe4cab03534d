"""Lost forces in the likelihood: F (1 - exp(-Lambda)), read with noise."""

from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp

from bowdenfit.cable.cable import Cable
from bowdenfit.kinds.bench import Remeasurement
from bowdenfit.kinds.term import TermKind
from bowdenfit.parameters.priors import HalfNormal
from bowdenfit.parameters.space import Parameter

NOISE = "sigma_loss"


@dataclass(frozen=True)
class LossTerm:
    """The likelihood of the table."""

    cable: Cable
    data: dict[str, Any]
    labels: tuple[str, ...]
    name: str = "lost_force"
    unit: str = "N"
    noise: str = NOISE

    @property
    def residual_blocks(self):
        return ((len(self.labels), len(self.labels)),)

    def expected(self, values, data):
        exponent = self.cable.exponent_at(values, jnp.zeros(1))
        return data["input_force"] * -jnp.expm1(-exponent)

    def residuals(self, values, data):
        return (data["loss"] - self.expected(values, data)) / jax.lax.stop_gradient(values[NOISE])

    def log_likelihood(self, values, data):
        deviation = (data["loss"] - self.expected(values, data)) / values[NOISE]
        return -0.5 * deviation**2 - jnp.log(values[NOISE]) - 0.5 * jnp.log(2 * jnp.pi)

    def simulate(self, values, data, key):
        expected = self.expected(values, data)
        return expected + values[NOISE] * jax.random.normal(key, expected.shape)

    def observed(self):
        return self.data["loss"]


def _terms(cable, table, angles):
    labels = tuple(f"{force:g} N" for force in table.input_force)
    return (LossTerm(cable, {"input_force": table.input_force, "loss": table.loss}, labels),)


def _parameters(table, circumstances):
    return [Parameter(NOISE, r"$\sigma$ loss", "noise of a lost force", "noise", HalfNormal(1.0), "N")]


def _draw(table, truth):
    (term,) = _terms(truth.cable, table, truth.angles)
    expected = term.expected(truth.values, {name: jnp.asarray(array) for name, array in term.data.items()})
    return {"loss": expected + truth.scale * truth.values[NOISE] * truth.scatter(truth.key, expected.shape)}


LOSSES = TermKind("losses", _terms, _parameters, Remeasurement(_draw))
