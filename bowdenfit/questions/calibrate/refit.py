"""Fits of many data sets of one model: those of one shape together, with programs that serve the next as well."""

from collections.abc import Sequence
from dataclasses import astuple, dataclass, field, replace

import jax

from bowdenfit.dataset import Dataset
from bowdenfit.description import SamplerSettings
from bowdenfit.inference.batch.fitting import BatchFit, fit_batch
from bowdenfit.inference.batch.programs import BatchPrograms, BatchSettings
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.model import Model, build_model

# The rank of a truth among any number of independent draws is exactly uniform: 200 only say it less finely than 400. Tails of
# noise scales mix slowest, so their posteriors are given many steps before they are given up.
RANKS = BatchSettings(
    SamplerSettings(n_ensembles=2, n_walkers=64, max_steps=24000, target_ess=200, target_r_hat=1.03),
    target_sd_error=float("inf"),
    nuts=False,
)


@dataclass(frozen=True)
class Laboratory:
    """Fits data sets by the dozen, and keeps what it has compiled.

    Args:
        settings: How carefully.
        programs: What has been compiled, by cable and shape of the data.
    """

    settings: BatchSettings = field(default=RANKS)
    programs: dict[str, BatchPrograms] = field(default_factory=dict)

    def fits(self, posteriors: Sequence[LogDensity], seeds: Sequence[int]) -> list[BatchFit]:
        """Draws of every posterior, in order."""
        kinds: dict[str, list[int]] = {}
        for i, posterior in enumerate(posteriors):
            kinds.setdefault(_kind(posterior), []).append(i)
        found: dict[int, BatchFit] = {}
        for kind, members in kinds.items():
            first = posteriors[members[0]]
            default = BatchPrograms(replace(first, data_override=first.padded), self.settings)
            programs = self.programs.setdefault(kind, default)
            data, own = [posteriors[i].padded for i in members], [seeds[i] for i in members]
            found |= zip(members, fit_batch(programs.posterior, data, own, programs=programs), strict=True)
        return [found[i] for i in range(len(posteriors))]


def _kind(posterior: LogDensity) -> str:
    """Cable, parameters and shapes of the data: what programs are compiled for."""
    shapes = jax.tree.map(lambda array: (array.shape, str(array.dtype)), posterior.padded)
    parameters = [(type(each.prior).__name__, *astuple(each)) for each in posterior.model.space.parameters]
    return f"{shapes} {parameters} {posterior.model.description.to_json()}"


def with_parameters_of(model: Model, dataset: Dataset) -> Model:
    """The model of other readings on the same bench: priors that look at the data stay those of the data they looked at."""
    terms = build_model(dataset).terms
    return Model(model.cable, model.space, tuple(replace(term, cable=model.cable) for term in terms))  # type: ignore[type-var]
