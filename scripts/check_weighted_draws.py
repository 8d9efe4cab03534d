"""Whether weighted draws of single fits are from the posterior: ranks of known truths among them, which must be uniform.

    python scripts/check_weighted_draws.py DATASET [--replications N] [--seed S]

Truths are drawn from the priors and readings are simulated with them, as `bowdenfit calibrate` does; but each table is fitted
as `bowdenfit fit --sampler importance` fits it, from its own least squares. Fits whose Pareto k or effective sample sizes are
refused do not count: walkers follow them. Prints how many those were, and of every parameter the share of truths in its 90 %
interval and the p-value of uniform ranks (Talts et al. 2018, arXiv:1804.06788), which is below 0.01 / parameters by chance once
in a hundred runs. The exit code is 1 where one is.
"""

import argparse
import sys
from collections.abc import Sequence
from dataclasses import replace

import jax
import numpy as np
from scipy import stats

import bowdenfit as bf
from bowdenfit.description import SamplerSettings
from bowdenfit.inference.batch.fitting import BatchFit
from bowdenfit.inference.chain import SamplingRequest
from bowdenfit.inference.importance import compile_densities, sample
from bowdenfit.inference.least_squares import find_maximum_posterior
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.inference.objective import make_objective
from bowdenfit.questions.calibrate.plan import make_plan
from bowdenfit.questions.calibrate.replicator import BatchFitter, Replicator

CHANCE = 0.01


class WeightedFitter(BatchFitter):
    """Fits each table as a single fit does, with programs that serve all tables of one shape."""

    def fit_all(self, posteriors: Sequence[LogDensity], seeds: Sequence[int]) -> list[BatchFit]:
        """Return draws of every posterior, in order."""
        with jax.enable_x64(True):
            return [self._fit(posterior, seed) for posterior, seed in zip(posteriors, seeds, strict=True)]

    def _fit(self, posterior: LogDensity, seed: int) -> BatchFit:
        shapes = str(jax.tree.map(np.shape, posterior.data))
        if shapes not in self.programs:
            densities = compile_densities(posterior.log_density, posterior.data, posterior.model.space.size)
            self.programs[shapes] = make_objective(posterior), densities
        objective, densities = self.programs[shapes]
        start = find_maximum_posterior(posterior, objective)
        request = SamplingRequest(posterior, start, SamplerSettings(), seed)
        chain = sample(request, replace(densities, data=posterior.data))
        return BatchFit(chain.z.reshape(-1, chain.z.shape[-1]), "laplace", chain.pareto_k, chain.diagnostics, chain.reasons)


def main() -> int:
    """Replicate, and print the table."""
    parser = argparse.ArgumentParser(description="Check weighted draws; the head of this file says how.")
    parser.add_argument("dataset")
    parser.add_argument("--replications", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    data = bf.read(options.dataset)
    replicator = Replicator(make_plan(data, data, options.seed, None), WeightedFitter())
    replications = list(replicator.replicate(range(options.replications)))
    good = [replication for replication in replications if not replication.reasons]
    print(f"{options.dataset}: {len(good)} of {len(replications)} had enough even weights")
    smallest = 1.0
    for name in good[0].ranked:
        ranks = np.array([replication.ranked[name].rank for replication in good])
        p = stats.kstest(ranks, "uniform").pvalue
        smallest = min(smallest, p * len(good[0].ranked))
        print(f"{name:30s} {np.mean(np.abs(ranks - 0.5) < 0.45):6.1%}  p = {p:.3f}", flush=True)
    return int(smallest < CHANCE)


if __name__ == "__main__":
    sys.exit(main())
