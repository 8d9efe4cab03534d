"""Lost forces in the likelihood: F (1 - exp(-Lambda)), read with noise."""

from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp

from bowdenfit.kinds.term import IndependentReadings, TermKind
from bowdenfit.parameters.priors import HalfNormal
from bowdenfit.parameters.space import Parameter
from scratch.losses.kind import LossTable

NOISE = "sigma_loss"


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class LossData:
    """Lost forces and input forces [N], (rows)."""

    reading: Any
    input_force: Any


class LossTerm(IndependentReadings):
    """Each lost force scatters by itself about what friction takes."""

    name = "lost_force"
    unit = "N"
    noise = NOISE

    def expected(self, values, data):
        exponent = self.cable.exponent_at(values, jnp.zeros(1))
        return data.input_force * -jnp.expm1(-exponent)


class LossTerms(TermKind[LossTable]):
    """The four things that a kind must give of its likelihood."""

    name = "losses"

    def terms(self, cable, table, angles):
        labels = tuple(f"{force:g} N" for force in table.input_force)
        return (LossTerm(cable, LossData(table.loss, table.input_force), labels),)

    def parameters(self, table, point):
        return [Parameter(NOISE, r"$\sigma$ loss", "noise of a lost force", "noise", HalfNormal(1.0), "N")]

    def draw(self, table, truth):
        (term,) = self.terms(truth.cable, table, truth.angles)
        return {"loss": truth.simulate(term, truth.key)}
