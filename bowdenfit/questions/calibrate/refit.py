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
RANK_SETTINGS = BatchSettings(
    SamplerSettings(n_ensembles=2, n_walkers=64, max_steps=24000, target_ess=200, target_r_hat=1.03),
    target_sd_error=float("inf"),
    nuts=False,
)


@dataclass(frozen=True)
class BatchFitter:
    """Fits data sets by the dozen, and keeps what it has compiled.

    Args:
        settings: How carefully.
        programs: What has been compiled, by cable and shape of the data.
    """

    settings: BatchSettings = field(default=RANK_SETTINGS)
    programs: dict[str, BatchPrograms] = field(default_factory=dict)

    def fit_all(self, posteriors: Sequence[LogDensity], seeds: Sequence[int]) -> list[BatchFit]:
        """Draws of every posterior, in order."""
        groups: dict[str, list[int]] = {}
        for i, posterior in enumerate(posteriors):
            groups.setdefault(_compilation_key(posterior), []).append(i)
        fits: dict[int, BatchFit] = {}
        for key, members in groups.items():
            first = posteriors[members[0]]
            default = BatchPrograms(replace(first, data_override=first.padded), self.settings)
            programs = self.programs.setdefault(key, default)
            data, own_seeds = [posteriors[i].padded for i in members], [seeds[i] for i in members]
            fits |= zip(members, fit_batch(programs.posterior, data, own_seeds, programs=programs), strict=True)
        return [fits[i] for i in range(len(posteriors))]


def _compilation_key(posterior: LogDensity) -> str:
    """Cable, parameters and shapes of the data: what programs are compiled for."""
    shapes = jax.tree.map(lambda array: (array.shape, str(array.dtype)), posterior.padded)
    parameters = [(type(parameter.prior).__name__, *astuple(parameter)) for parameter in posterior.model.space.parameters]
    return f"{shapes} {parameters} {posterior.model.description.to_json()}"


def replace_data(model: Model, dataset: Dataset) -> Model:
    """The model of other readings on the same bench: priors that look at the data stay those of the data they looked at."""
    terms = build_model(dataset).terms
    return Model(model.cable, model.space, tuple(replace(term, cable=model.cable) for term in terms))  # type: ignore[type-var]
