"""Free vibration with damping and dry friction, against its textbook figures and against small steps."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from bowdenfit.physics.ring_down import compute_peaks, ring_down

J, K = 1e-3, 20.0
RING_DOWN = jax.jit(ring_down, static_argnums=7)


def swung(time, amplitude=0.2, b=0.0, friction=0.1, inertia=J, swings=200):
    with jax.enable_x64(True):
        terms = np.atleast_1d(inertia).astype(float)
        numbers = map(jnp.asarray, (np.full(len(terms), amplitude), terms, K, b, friction))
        run = jnp.zeros(len(time), dtype=int)
        return [np.asarray(x) for x in RING_DOWN(jnp.asarray(time), run, *numbers, swings)]


def test_mass_spring_and_dry_friction_lose_twice_the_friction_over_the_stiffness_a_half_swing():
    half = np.pi * np.sqrt(J / K)
    angle, speed = swung(np.arange(15) * half * (1 + 1e-12))
    np.testing.assert_allclose(-np.diff(np.abs(angle)), 2 * 0.1 / K, rtol=1e-9)
    np.testing.assert_allclose(speed, 0, atol=1e-6)


def test_it_stays_where_the_spring_cannot_overcome_friction():
    angle, speed = swung(np.linspace(0, 5, 4000))
    assert abs(angle[-1]) <= 0.1 / K
    assert speed[-1] == 0 and angle[-1] == angle[-500]
    held, still = swung(np.linspace(0, 1, 50), amplitude=0.9 * 0.1 / K)
    assert np.ptp(held) == 0 and np.all(still == 0)


def test_damping_alone_is_the_logarithmic_decrement():
    zeta = 0.05
    b = 2 * zeta * np.sqrt(K * J)
    half = np.pi / np.sqrt(K / J) / np.sqrt(1 - zeta**2)
    angle, _ = swung(np.arange(6) * half * (1 + 1e-12), b=b, friction=0.0)
    ratio = np.log(np.abs(angle[:-1] / angle[1:]))
    np.testing.assert_allclose(ratio, np.pi * zeta / np.sqrt(1 - zeta**2), rtol=1e-6)


def test_it_is_what_small_steps_give():
    """The last two are at and beyond critical damping, 0.283."""
    h, n, every = 1e-5, 40_000, 400
    b, friction = np.array([0.01, 0.1, 0.28, 0.5]), np.array([0.1, 0.3, 0.2, 0.2])
    x, v, seen = np.full(4, 0.2), np.zeros(4), []
    for i in range(n):
        if i % every == 0:
            seen.append(x.copy())
        v = v + h * (-K * x - b * v) / J
        v = np.sign(v) * np.maximum(np.abs(v) - h * friction / J, 0.0)
        x = x + h * v
    for k, expected in enumerate(np.transpose(seen)):
        computed, _ = swung(np.arange(0, n, every) * h, b=b[k], friction=friction[k])
        np.testing.assert_allclose(computed, expected, atol=1e-3 * 0.2)


@pytest.mark.extended
def test_nothing_moves_before_the_release_and_derivatives_are_finite():
    angle, speed = swung(np.linspace(-1, 0, 5))
    assert np.all(angle == 0.2) and np.all(speed == 0)
    time, run = jnp.linspace(-0.01, 0.6, 50), jnp.zeros(50, dtype=int)

    def last(of):
        return ring_down(time, run, of[:1], of[1:2], of[2], of[3], of[4], 50)[0].sum()

    cases = jnp.array([[0.2, J, K, b, 0.1] for b in (0.0, 0.01, 0.3, 0.6)])
    assert np.all(np.isfinite(jax.jit(jax.vmap(jax.grad(last)))(cases)))


def test_peaks_change_sides():
    peaks = compute_peaks(jnp.array([0.2]), jnp.array([1.0]), jnp.array([0.03]), 6)[:, 0]
    np.testing.assert_allclose(peaks, [0.2, -0.14, 0.08, -0.02, -0.02, -0.02], atol=1e-7)
