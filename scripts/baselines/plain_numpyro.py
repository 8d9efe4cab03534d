"""The on-body posterior with NumPyro: sample statements, a factor for what was too small to detect, and NUTS.

The settings are the quickest of those tried: chains in parallel beat sequential and vectorized ones, and a dense mass
matrix mixes worse in the funnel that tau makes.
"""

import jax
import jax.numpy as jnp
import numpy as np
import numpyro
import numpyro.distributions as dist
import onbody
from jax.scipy.special import log_ndtr
from numpyro.infer import MCMC, NUTS

N_CHAINS, N_WARMUP, N_DRAWS = 4, 1000, 500  # draws a chain between two looks at the effective sample size
TARGET_ACCEPTANCE = 0.9  # the default 0.8 diverges more and is no quicker
DATA = onbody.tables()

numpyro.set_host_device_count(N_CHAINS)
numpyro.enable_x64()


def model() -> None:
    """Priors and likelihood of 11 parameters."""
    mu = numpyro.sample("mu", dist.LogNormal(*onbody.FRICTION).expand([3]).to_event(1))
    sigma = numpyro.sample("sigma_theta", dist.HalfCauchy(onbody.ANGLE_NOISE))
    tau = numpyro.sample("tau", dist.HalfCauchy(onbody.SCATTER))
    angles = []
    for k, curve in enumerate(DATA["curves"]):
        a = numpyro.sample(f"a{k}", dist.Normal(curve["level"], onbody.LEVEL_SD))
        b = numpyro.sample(f"b{k}", dist.Normal(0.0, onbody.SLOPE_SD))
        c = numpyro.deterministic(f"c{k}", numpyro.sample(f"root{k}", dist.HalfCauchy(1.0)) ** 2)
        z, hidden = curve["z"], curve["z_undetected"]
        numpyro.sample(f"angle{k}", dist.Normal(jnp.exp(a + b * z - c * z**2), sigma), obs=curve["angle"])
        undetected = log_ndtr((onbody.LIMIT - jnp.exp(a + b * hidden - c * hidden**2)) / sigma)
        numpyro.factor(f"undetected{k}", undetected.sum())
        along = jnp.exp(a + b * DATA["z"] - c * DATA["z"] ** 2)
        angles.append(jnp.where(DATA["own"], DATA["angles"][:, k], along))
    mean = mu[0] * angles[0] + mu[1] * angles[1] + mu[2] * onbody.EDGE
    variance = tau**2 + jnp.where(DATA["own"], (mu[0] ** 2 + mu[1] ** 2) * sigma**2, 0.0)
    numpyro.sample("loss", dist.Normal(mean, jnp.sqrt(variance)), obs=DATA["loss"])


def parameters(sampler: MCMC) -> np.ndarray:
    """Draws of the last run, (chain, draw, parameter), in the order of `onbody.NAMES`."""
    draws = sampler.get_samples(group_by_chain=True)
    curves = [draws[f"{x}{k}"] for k in range(2) for x in "abc"]
    return np.stack([*np.moveaxis(draws["mu"], -1, 0), *curves, draws["sigma_theta"], draws["tau"]], axis=-1)


SAMPLER = MCMC(
    NUTS(model, target_accept_prob=TARGET_ACCEPTANCE),
    num_warmup=N_WARMUP,
    num_samples=N_DRAWS,
    num_chains=N_CHAINS,
    chain_method="parallel",
    progress_bar=False,
)


def run(seed: int) -> np.ndarray:
    """Draws after the warm-up, once they are enough."""
    SAMPLER.post_warmup_state = None
    SAMPLER.run(jax.random.key(seed))
    blocks = [parameters(SAMPLER)]
    while onbody.smallest_ess(np.concatenate(blocks, axis=1)) < onbody.TARGET:
        SAMPLER.post_warmup_state = SAMPLER.last_state
        SAMPLER.run(SAMPLER.last_state.rng_key)
        blocks.append(parameters(SAMPLER))
    return np.concatenate(blocks, axis=1)


if __name__ == "__main__":
    onbody.report(run)
