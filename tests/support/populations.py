"""Populations of cables drawn by Gibbs sampling, many fleets at once, in NumPy: nothing is shared with `bowdenfit pool`.

Errors of inspections are stretched normal ones, so that given the stretches, the spreads and the effect of oil every cable is
normal. Spreads have a grid, and every third sweep cables are stretched with their spread, as they hang together.
"""

import numpy as np

from bowdenfit.addons.fleet.population.model import Inspections
from bowdenfit.addons.fleet.population.sampling import PopulationDraws

SPREADS = np.exp(np.linspace(np.log(2e-3), np.log(3.0), 120))
SPREAD, WEAR, WEAR_SPREAD, OIL = 0.5, 1.0, 0.3, 1.0  # scales of the priors, as the model is written down


def gibbs(
    fleets: list[Inspections], without: list[tuple[int, ...]], seed: int, sweeps: int = 1000, initial: int = 150
) -> list[PopulationDraws]:
    """Draws of each population, one a sweep; cables in `without` are not looked at.

    Args:
        fleets: Of as many cables and inspections, whose effect is lubrication.
        without: Of each.
        seed: Random seed.
        sweeps, before: That are kept, and that are not.
    """
    g, first, fleet = np.random.default_rng([seed, 99]), fleets[0], len(fleets)
    k, cables, wears = first.coefficients, first.cables, first.cycles is not None
    times, n_values = len(first.cable) // cables, k + wears

    def split(name):
        arrays = np.stack([getattr(fleet.summaries, name) for fleet in fleets])
        return arrays.reshape(fleet, cables, times, *arrays.shape[2:])

    center, inverse, freedom = split("center"), np.linalg.inv(split("scale")), split("freedom")
    design = first.design.reshape(cables, times, k, n_values)
    oil = np.stack([fleet.effects["lubrication"].reshape(cables, times) for fleet in fleets])
    live = np.array([[i not in out for i in range(cables)] for out in without])
    prior_mean = np.append(first.prior_mean, [0.0] * wears)
    prior_sd = np.append(first.prior_sd, [WEAR] * wears)
    scale = np.append(np.full(k, SPREAD), [WEAR_SPREAD] * wears)
    toward = np.swapaxes(design, -1, -2) @ inverse
    moved, rows, whole = toward @ design, inverse.sum(-1), inverse.sum((-1, -2))
    u = np.zeros((fleet, cables, n_values)) + prior_mean
    u[..., :k] = center.mean(axis=2)
    mean, spread, effect = u.mean(axis=1), np.full((fleet, n_values), 0.2), np.zeros(fleet)
    count, logs = live.sum(axis=1)[:, None], np.log(SPREADS)
    histories = [np.zeros((fleet, sweeps, *shape)) for shape in ((n_values,), (n_values,), (1,), (cables, n_values))]

    def away(u, effect):
        return center - (design @ u[:, :, None, :, None])[..., 0] - (oil * effect[:, None, None])[..., None]

    def distance(u):
        left = away(u, effect)
        return np.sum(left * (inverse @ left[..., None])[..., 0], axis=-1)

    for sweep in range(-initial, sweeps):
        stretch = g.standard_gamma((freedom + k) / 2) / ((freedom + distance(u)) / 2) * live[..., None]
        precision = (stretch[..., None, None] * moved).sum(axis=2) + np.eye(n_values) * (spread**-2)[:, None, None, :]
        seen = center - (oil * effect[:, None, None])[..., None]
        pull = (stretch[..., None] * (toward @ seen[..., None])[..., 0]).sum(axis=2) + (mean / spread**2)[:, None]
        covariance = np.linalg.inv(precision)
        u = (covariance @ pull[..., None])[..., 0]
        u = u + (np.linalg.cholesky(covariance) @ g.standard_normal((*u.shape, 1)))[..., 0]
        information = np.sum(stretch * whole * oil**2, axis=(1, 2)) + OIL**-2
        effect = np.sum(stretch * oil * np.sum(rows * away(u, np.zeros(fleet)), axis=-1), axis=(1, 2)) / information
        effect = effect + g.standard_normal(fleet) / np.sqrt(information)
        deviations = np.where(live[..., None], u, 0.0)
        information = count / spread**2 + prior_sd**-2
        mean = (deviations.sum(axis=1) / spread**2 + prior_mean / prior_sd**2) / information
        mean = mean + g.standard_normal(mean.shape) / np.sqrt(information)
        squares = np.sum(np.where(live[..., None], (u - mean[:, None]) ** 2, 0.0), axis=1)
        log = (1 - count[..., None]) * logs - squares[..., None] / 2 / SPREADS**2 - SPREADS**2 / 2 / scale[:, None] ** 2
        place = (log + g.gumbel(size=log.shape)).argmax(axis=-1)
        spread = np.exp(logs[place] + (g.uniform(size=place.shape) - 0.5) * (logs[1] - logs[0]))
        i, longer = sweep % n_values, np.exp(0.5 * g.standard_normal(fleet))
        other, wider = u.copy(), spread.copy()
        wider[:, i] *= longer
        other[..., i] = mean[:, None, i] + (u[..., i] - mean[:, None, i]) * longer[:, None]
        gain = np.sum(stretch * (distance(u) - distance(other)), axis=(1, 2)) / 2
        gain = gain - (wider[:, i] ** 2 - spread[:, i] ** 2) / 2 / scale[i] ** 2 + np.log(longer)
        yes = np.log(g.uniform(size=fleet)) < gain
        u, spread = np.where(yes[:, None, None], other, u), np.where(yes[:, None], wider, spread)
        if sweep >= 0:
            for store, now in zip(histories, (mean, spread, effect[:, None], u), strict=True):
                store[:, sweep] = now
    return [PopulationDraws(*(store[i] for store in histories), (), float(sweeps)) for i in range(fleet)]
