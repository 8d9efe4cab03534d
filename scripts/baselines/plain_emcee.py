"""The on-body posterior with emcee and NumPy: physical parameters, bounds by minus infinity, emcee's default move."""

import emcee
import numpy as np
import onbody
from scipy.special import log_ndtr

N_WALKERS = 256  # quicker here than 64 or 128
FIRST_LOOK = 1000  # steps before the effective sample size is looked at
THIN = 10
DATA = onbody.tables()


def log_density(p: np.ndarray) -> np.ndarray:
    """Log posterior density of many walkers, one a row: mu1 to mu3, a, b, c of both curves, sigma_theta, tau."""
    mu, curves, sigma, tau = p[:, :3], p[:, 3:9].reshape(-1, 2, 3), p[:, 9], p[:, 10]
    inside = (mu > 0).all(axis=1) & (curves[..., 2] >= 0).all(axis=1) & (sigma > 0) & (tau > 0)
    with np.errstate(all="ignore"):
        total = log_prior(mu, curves, sigma, tau) + log_likelihood(mu, curves, sigma, tau)
    return np.where(inside & np.isfinite(total), total, -np.inf)


def log_prior(mu: np.ndarray, curves: np.ndarray, sigma: np.ndarray, tau: np.ndarray) -> np.ndarray:
    """Log prior density, up to a constant."""
    center, width = onbody.FRICTION
    levels = [curve["level"] for curve in DATA["curves"]]
    total = -0.5 * (((np.log(mu) - center) / width) ** 2).sum(axis=1) - np.log(mu).sum(axis=1)
    total -= 0.5 * (((curves[..., 0] - levels) / onbody.LEVEL_SD) ** 2).sum(axis=1)
    total -= 0.5 * ((curves[..., 1] / onbody.SLOPE_SD) ** 2).sum(axis=1)
    total -= (0.5 * np.log(curves[..., 2]) + np.log1p(curves[..., 2])).sum(axis=1)
    return total - np.log1p((sigma / onbody.ANGLE_NOISE) ** 2) - np.log1p((tau / onbody.SCATTER) ** 2)


def log_likelihood(mu: np.ndarray, curves: np.ndarray, sigma: np.ndarray, tau: np.ndarray) -> np.ndarray:
    """Log likelihood of angles, detected or not, and of efficiencies, up to a constant."""
    total = np.zeros(len(mu))
    for k, curve in enumerate(DATA["curves"]):
        deviation = (curve["angle"] - wrap_angle(curves[:, k], curve["z"])) / sigma[:, None]
        total += (-0.5 * deviation**2 - np.log(sigma)[:, None]).sum(axis=1)
        hidden = (onbody.LIMIT - wrap_angle(curves[:, k], curve["z_undetected"])) / sigma[:, None]
        total += log_ndtr(hidden).sum(axis=1)
    free, squeezed = (
        np.where(DATA["own"], DATA["angles"][:, k], wrap_angle(curves[:, k], DATA["z"])) for k in range(2)
    )
    mean = mu[:, 0, None] * free + mu[:, 1, None] * squeezed + mu[:, 2, None] * onbody.EDGE
    variance = tau[:, None] ** 2 + DATA["own"] * ((mu[:, 0] ** 2 + mu[:, 1] ** 2) * sigma**2)[:, None]
    return total + (-0.5 * (DATA["loss"] - mean) ** 2 / variance - 0.5 * np.log(variance)).sum(axis=1)


def wrap_angle(curve: np.ndarray, z: np.ndarray) -> np.ndarray:
    """exp(a + b z - c z^2) of each walker at each z"""
    a, b, c = (curve[:, i, None] for i in range(3))
    return np.exp(a + b * z - c * z**2)


def starting_points(generator: np.random.Generator) -> np.ndarray:
    """Walkers around a rough guess: a parabola through the logarithms of each curve's detected angles."""
    guess = [0.12, 0.12, 0.12]
    for curve in DATA["curves"]:
        square, slope, level = np.polyfit(curve["z"], np.log(curve["angle"]), 2)
        guess += [level, slope, max(-square, 0.1)]
    guess += [np.deg2rad(2.0), 0.01]
    return np.array(guess) * (1 + 0.1 * generator.standard_normal((N_WALKERS, len(guess))))


def run(seed: int) -> np.ndarray:
    """Draws from the second half of every walker's path, once they are enough."""
    points = starting_points(np.random.default_rng(seed))
    sampler = emcee.EnsembleSampler(*points.shape, log_density, vectorize=True)
    state = emcee.State(points, random_state=np.random.RandomState(seed).get_state())
    steps = FIRST_LOOK
    while True:
        state = sampler.run_mcmc(state, steps)
        done = sampler.iteration
        draws = sampler.get_chain(discard=done // 2, thin=THIN).swapaxes(0, 1)
        if onbody.smallest_ess(draws) >= onbody.TARGET:
            return draws
        steps = done // 4


if __name__ == "__main__":
    onbody.report(run)
