"""The on-body posterior with blackjax: a log density of unbounded parameters in JAX, window adaptation, NUTS.

Positive parameters are sampled as their logarithms, with the logarithm of the Jacobian. The seed is the first argument.
"""

import sys

import blackjax
import jax
import jax.numpy as jnp
import numpy as np
import onbody
from jax.scipy.special import log_ndtr

N_CHAINS, N_WARMUP, N_DRAWS = 4, 1000, 1000
TARGET_ACCEPTANCE = 0.9
POSITIVE = np.array([True] * 3 + [False, False, True] * 2 + [True, True])
DATA = onbody.tables()

jax.config.update("jax_enable_x64", True)


def values(x: jax.Array) -> jax.Array:
    """Parameters in the order of `onbody.NAMES`."""
    return jnp.where(POSITIVE, jnp.exp(jnp.where(POSITIVE, x, 0.0)), x)


def log_density(x: jax.Array) -> jax.Array:
    """Log posterior density of the unbounded parameters, up to a constant."""
    p = values(x)
    mu, curves, sigma, tau = p[:3], p[3:9].reshape(2, 3), p[9], p[10]
    center, width = onbody.FRICTION
    levels = jnp.array([curve["level"] for curve in DATA["curves"]])
    total = -0.5 * jnp.sum(((x[:3] - center) / width) ** 2)  # the Jacobian cancels the density's 1 / mu
    total -= 0.5 * jnp.sum(((curves[:, 0] - levels) / onbody.LEVEL_SD) ** 2)
    total -= 0.5 * jnp.sum((curves[:, 1] / onbody.SLOPE_SD) ** 2)
    total += jnp.sum(0.5 * x[jnp.array([5, 8])] - jnp.log1p(curves[:, 2]))  # half-Cauchy roots, whose Jacobian is half of c's
    total -= jnp.log1p((sigma / onbody.ANGLE_NOISE) ** 2) + jnp.log1p((tau / onbody.SCATTER) ** 2)
    total += x[9] + x[10]
    angles = []
    for k, curve in enumerate(DATA["curves"]):
        a, b, c = curves[k]
        expected = jnp.exp(a + b * curve["z"] - c * curve["z"] ** 2)
        total += jnp.sum(-0.5 * ((curve["angle"] - expected) / sigma) ** 2 - jnp.log(sigma))
        hidden = jnp.exp(a + b * curve["z_undetected"] - c * curve["z_undetected"] ** 2)
        total += jnp.sum(log_ndtr((onbody.LIMIT - hidden) / sigma))
        along = jnp.exp(a + b * DATA["z"] - c * DATA["z"] ** 2)
        angles.append(jnp.where(DATA["own"], DATA["angles"][:, k], along))
    mean = mu[0] * angles[0] + mu[1] * angles[1] + mu[2] * onbody.EDGE
    variance = tau**2 + jnp.where(DATA["own"], (mu[0] ** 2 + mu[1] ** 2) * sigma**2, 0.0)
    return total + jnp.sum(-0.5 * (DATA["loss"] - mean) ** 2 / variance - 0.5 * jnp.log(variance))


def start() -> np.ndarray:
    """A rough guess: a parabola through the logarithms of each curve's detected angles."""
    guess = [np.log(0.12)] * 3
    for curve in DATA["curves"]:
        square, slope, level = np.polyfit(curve["z"], np.log(curve["angle"]), 2)
        guess += [level, slope, np.log(max(-square, 0.1))]
    return np.array([*guess, np.log(np.deg2rad(2.0)), np.log(0.01)])


@jax.jit
@jax.vmap
def warmed_up(key: jax.Array, x: jax.Array):
    """State and tuned parameters of one chain."""
    adaptation = blackjax.window_adaptation(blackjax.nuts, log_density, target_acceptance_rate=TARGET_ACCEPTANCE)
    (state, tuned), _ = adaptation.run(key, x, N_WARMUP)
    return state, tuned["step_size"], tuned["inverse_mass_matrix"]


@jax.jit
@jax.vmap
def draw_chain(key: jax.Array, state, step_size: jax.Array, inverse_mass_matrix: jax.Array):
    """The draws of one chain."""
    step = blackjax.nuts(log_density, step_size, inverse_mass_matrix).step

    def advance(state, key: jax.Array):
        state, _ = step(key, state)
        return state, state.position

    _, positions = jax.lax.scan(advance, state, jax.random.split(key, N_DRAWS))
    return jax.vmap(values)(positions)


def main() -> None:
    """Warm up, draw, and print means and standard deviations."""
    seed = int(sys.argv[1])
    key = jax.random.key(seed)
    first = start() + 0.1 * np.random.default_rng(seed).standard_normal((N_CHAINS, len(onbody.NAMES)))
    warm = warmed_up(jax.random.split(key, N_CHAINS), jnp.asarray(first))
    draws = np.asarray(draw_chain(jax.random.split(jax.random.fold_in(key, 1), N_CHAINS), *warm))
    for name, values_of_name in zip(onbody.NAMES, draws.reshape(-1, len(onbody.NAMES)).T, strict=True):
        print(f"{name} {values_of_name.mean():.4g} +- {values_of_name.std():.2g}")


if __name__ == "__main__":
    main()
