"""Default priors against truths that do not come from them: simulated, fitted and counted in NumPy, apart from the package.

Nothing but `PriorDefaults` is shared: the quantiles of the priors, the likelihoods, the integration and the sampler here are
written anew. A calibration whose truths come from the priors cannot see a bad prior; this one can.
"""

import numpy as np
import pytest
from scipy import stats
from scipy.special import log_ndtr

from bowdenfit.description import PriorDefaults

pytestmark = pytest.mark.extended

DEFAULTS = PriorDefaults()
LIMIT = np.deg2rad(10.0)
LENGTHS = np.linspace(-1.0, 1.0, 11)  # in half ranges
SOME = ((0.4, 3.0), 40)
MANY = ((0.3, 0.4, 0.5, 0.7, 1.0, 1.5, 2.0, 3.0), 400)


def half_cauchy(scale):
    return lambda z: scale * np.tan(np.pi / 2 * stats.norm.cdf(z))


def half_normal(sd):
    return lambda z: sd * stats.norm.isf(stats.norm.sf(z) / 2)


# Mountings --------------------------------------------------------------------------------------------------------

NOW = half_cauchy(DEFAULTS.run_scatter)
ONCE = half_normal(0.02)


def share_held(prior, runs: int, replications: int, seed: int = 0) -> float:
    """How often the 90 % interval of a coefficient holds, with mountings 0.2 to 30 % apart; posterior by quadrature.

    Each run is the log ratio of one mounting at half a turn, read to 0.2 %.
    """
    rng = np.random.default_rng(seed)
    z = np.linspace(-5.0, 6.0, 120)
    variance, weight = prior(z) ** 2 + 0.002**2, stats.norm.logpdf(z)
    log_mu = np.log(DEFAULTS.friction.median) + np.linspace(-5.0, 5.0, 1200)
    prior_mu = stats.norm.pdf(np.linspace(-5.0, 5.0, 1200) / DEFAULTS.friction.log_sd)
    held = 0
    for _ in range(replications):
        mu, tau = 0.12, np.exp(rng.uniform(np.log(0.002), np.log(0.3)))
        ratios = np.pi * mu + np.hypot(tau, 0.002) * rng.standard_normal(runs)
        squares = np.sum((ratios[:, None] - np.pi * np.exp(log_mu)) ** 2, axis=0)
        log_density = (weight - runs / 2 * np.log(variance))[:, None] - squares / (2 * variance[:, None])
        below = np.cumsum(np.exp(log_density - log_density.max()).sum(axis=0) * prior_mu)
        low, high = np.interp([0.05, 0.95], below / below[-1], np.exp(log_mu))
        held += low < mu < high
    return held / replications


@pytest.mark.parametrize("runs", [2, 4, 20])
def test_intervals_hold_whether_mountings_are_alike_or_thirty_percent_apart(runs):
    """90 % of 400, within 4 standard deviations (6 %): chance fails this once in ten thousand."""
    assert abs(share_held(NOW, runs, 400) - 0.9) < 0.06


@pytest.mark.parametrize("runs", [2, 4])
def test_a_half_normal_prior_of_two_percent_does_not_hold(runs):
    """The control: what the default once was."""
    assert share_held(ONCE, runs, 400) < 0.8


# Coefficients -----------------------------------------------------------------------------------------------------

PLACES = np.linspace(-0.9, 0.9, 8)
BENDS = np.exp(np.column_stack([PLACES - 0.8 * PLACES**2 - 0.5, -PLACES - 0.8 * PLACES**2 - 0.5, np.full(8, -0.25)]))


def log_normal(median, log_sd):
    return lambda log_mu: -(((log_mu - np.log(median)) / log_sd) ** 2) / 2 - log_mu


def share_of_coefficients_held(log_prior, low: float, high: float, replications: int, seed: int = 0) -> float:
    """How often 90 % intervals of three coefficients hold, which eight mountings 3 % apart hardly tell from each other.

    Every doubling between low and high is as likely as the next, for each coefficient by itself. The likelihood is normal;
    draws of twice its standard deviation are weighted by it and the prior.
    """
    rng = np.random.default_rng(seed)
    root = 2 * np.linalg.cholesky(0.03**2 * np.linalg.inv(BENDS.T @ BENDS))
    held = []
    for _ in range(replications):
        truth = np.exp(rng.uniform(np.log(low), np.log(high), 3))
        middle = np.linalg.lstsq(BENDS, BENDS @ truth + 0.03 * rng.standard_normal(len(BENDS)))[0]
        draws = rng.standard_normal((30_000, 3))
        mu = middle + draws @ root.T
        positive = (mu > 0).all(axis=1)
        draws, mu = draws[positive], mu[positive]
        log_weight = log_prior(np.log(mu)).sum(axis=1) - (2**2 - 1) / 2 * np.sum(draws**2, axis=1)
        weight = np.exp(log_weight - log_weight.max())
        assert weight.sum() ** 2 > 30 * (weight @ weight)
        held.append(np.abs(weight @ (mu < truth) / weight.sum() - 0.5) < 0.45)
    return float(np.mean(held))


NOW_MU = log_normal(DEFAULTS.friction.median, DEFAULTS.friction.log_sd)


@pytest.mark.parametrize(("low", "high"), [(0.015, 0.8), (0.05, 0.3)])
def test_intervals_of_coefficients_hold_whether_they_are_usual_or_not(low, high):
    """Of 600, with an sd of about 1.4 %. The middle has more than 90 %, which is what the ends cost that have no less."""
    assert 0.87 < share_of_coefficients_held(NOW_MU, low, high, 200) < 0.985


def test_a_prior_of_a_factor_of_two_does_not_hold_unusual_coefficients():
    """The control: what the default once was."""
    assert share_of_coefficients_held(log_normal(0.12, 0.7), 0.015, 0.8, 200) < 0.8


# Bells ------------------------------------------------------------------------------------------------------------


class Bells:
    """Bells of one width: angles read to 2 deg at 11 lengths, those below 10 deg not detected.

    Args:
        width: C in half ranges; the middle of the bell is anywhere up to 1.2 half ranges from that of the lengths.
        n: How many.
    """

    def __init__(self, width: float, n: int, seed: int = 0):
        rng = np.random.default_rng(seed)
        readings, truth = [], []
        while len(readings) < n:
            middle, top, noise = rng.uniform(-1.2, 1.2), np.deg2rad(rng.uniform(60, 150)), np.deg2rad(2.0)
            angles = top * np.exp(-(((LENGTHS - middle) / width) ** 2)) + noise * rng.standard_normal(len(LENGTHS))
            if np.sum(angles >= LIMIT) >= 4:
                c = width**-2
                readings.append(angles)
                truth.append((np.log(top) - c * middle**2, 2 * c * middle, c, noise))
        self.angles, self.truth = np.array(readings), np.array(truth)
        self.undetected = self.angles < LIMIT
        self.level = np.log([np.median(a[~below]) for a, below in zip(self.angles, self.undetected, strict=True)])

    def log_density(self, a, b, c, noise):
        """Log likelihood of every walker."""
        theta = np.exp(np.minimum(a[..., None] + b[..., None] * LENGTHS - c[..., None] * LENGTHS**2, 20.0))
        deviation = (self.angles[:, None, :] - theta) / noise[..., None]
        detected = -(deviation**2) / 2 - np.log(noise)[..., None]
        below = log_ndtr((LIMIT - theta) / noise[..., None])
        return np.where(self.undetected[:, None, :], below, detected).sum(axis=-1)


def values_of(z, bells: Bells, priors):
    level_sd, slope_sd, curvature, noise = priors
    return bells.level[:, None] + level_sd * z[..., 0], slope_sd * z[..., 1], curvature(z[..., 2]), noise(z[..., 3])


def draws_of(bells: Bells, priors, steps: int = 1500, walkers: int = 32, seed: int = 1):
    """Draws of a, b, c and the noise of every bell: differential evolution of all ensembles at once, from the truth on."""
    rng, n = np.random.default_rng(seed), len(bells.angles)
    grid, (level_sd, slope_sd, curvature, noise) = np.linspace(-5.0, 5.0, 2001), priors
    a, b, c, scatter = bells.truth.T
    start = np.stack([
        (a - bells.level) / level_sd, b / slope_sd, np.interp(c, curvature(grid), grid), np.interp(scatter, noise(grid), grid)
    ], axis=-1)  # fmt: skip
    z = start[:, None, :] + 0.05 * rng.standard_normal((n, walkers, 4))

    def density(point):
        with np.errstate(all="ignore"):
            total = bells.log_density(*values_of(point, bells, priors)) - np.sum(point**2, axis=-1) / 2
        return np.where(np.isfinite(total), total, -np.inf)

    log_density, half, history = density(z), walkers // 2, []
    for step in range(steps):
        for rows, other in ((slice(0, half), slice(half, walkers)), (slice(half, walkers), slice(0, half))):
            first = rng.integers(0, half, (n, half))
            second = (first + rng.integers(1, half, (n, half))) % half
            apart = [np.take_along_axis(z[:, other], i[..., None], axis=1) for i in (first, second)]
            reach = 1.0 if rng.uniform() < 0.1 else 2.38 / np.sqrt(8)
            trial = z[:, rows] + reach * (apart[0] - apart[1]) + 1e-5 * rng.standard_normal((n, half, 4))
            computed = density(trial)
            better = np.log(rng.uniform(size=(n, half))) < computed - log_density[:, rows]
            z[:, rows] = np.where(better[..., None], trial, z[:, rows])
            log_density[:, rows] = np.where(better, computed, log_density[:, rows])
        if step >= steps // 3 and step % 5 == 0:
            history.append(z.copy())
    return values_of(np.concatenate(history, axis=1), bells, priors)


def held_of_bells(width: float, n: int, priors) -> dict[str, float]:
    """How often 90 % intervals hold: of slope, curvature, noise, and of the angle near the middle and near an end."""
    bells = Bells(width, n)
    true, drawn_values = bells.truth.T, draws_of(bells, priors)

    def quantities(a, b, c, noise):
        logs = {f"angle at {x:g}": a + b * x - c * x**2 for x in (-0.9, 0.45)}
        return {"slope": b, "curvature": c, "noise": noise} | logs

    held = {}
    for name, draws in quantities(*drawn_values).items():
        low, high = np.quantile(draws, (0.05, 0.95), axis=1)
        truth = quantities(*true)[name]
        held[name] = float(np.mean((low < truth) & (truth < high)))
    return held


BELLS_NOW = (
    DEFAULTS.curve_level_sd,
    DEFAULTS.curve_slope_sd,
    lambda z: half_cauchy(DEFAULTS.curve_half_ranges)(z) ** 2,
    half_cauchy(np.deg2rad(DEFAULTS.angle_noise_degrees)),
)
BELLS_ONCE = (1.5, 3.0, half_normal(0.5), half_normal(np.deg2rad(5.0)))


@pytest.mark.parametrize(
    ("width", "n"),
    [*((width, SOME[1]) for width in SOME[0]), *(pytest.param(w, MANY[1], marks=pytest.mark.slow) for w in MANY[0])],
)
def test_intervals_of_narrow_and_wide_bells_hold(width, n):
    """90 % of n within 4 standard deviations below: of five quantities chance fails one in 500 of 40, one in 1600 of 400."""
    held = held_of_bells(width, n, BELLS_NOW)
    assert min(held.values()) > 0.9 - 4 * np.sqrt(0.09 / n), held


def test_a_prior_that_knows_the_range_does_not_hold_narrow_bells():
    """The control: what the defaults once were."""
    assert held_of_bells(0.4, 40, BELLS_ONCE)["curvature"] < 0.2
