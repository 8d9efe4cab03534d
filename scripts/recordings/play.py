"""The play operator in JAX, numba and Python."""

import sys
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from benchmark_tables import Table, say

from bowdenfit.physics.friction import play_operator
from bowdenfit.recordings.preparation.hysteresis import play
from recordings.simulated import SEED, Simulated
from recordings.timing import milliseconds

BAND = 0.3  # friction exponent
PLAIN_SHARE = 10
AGREEMENT = 1e-9


def play_tables(simulated: Simulated) -> list[Table]:
    """The play operator in JAX, numba and Python."""
    samples = simulated.size.samples
    say(f"play operator, {samples} samples")
    x = np.log(50 + 30 * np.sin(np.arange(samples) * 2 * np.pi / 1000))
    x += 0.01 * np.random.default_rng(SEED).standard_normal(samples)
    times: dict[str, float] = {}
    with jax.enable_x64(True):
        for name, function in jax_operators().items():
            times[f"JAX, {name}"] = milliseconds(jax.jit(function), jnp.asarray(x), BAND, x[0])
        expected = np.asarray(jax.jit(output)(x, BAND, x[0]))
    loop = numba_loop()
    if loop is not None:
        warn_if_apart("numba", loop(x, BAND, x[0]), expected)
        times["numba, value"] = milliseconds(loop, x, BAND, x[0])
    part = x[: samples // PLAIN_SHARE]
    warn_if_apart("plain Python", python_loop(part, BAND, x[0]), expected[: len(part)])
    for name, plain in {"plain Python": python_loop, "bowdenfit's preparation, with contacts": play}.items():
        times[f"{name}, value (x{PLAIN_SHARE})"] = PLAIN_SHARE * milliseconds(plain, part, BAND, float(x[0]))
    fastest = min(times.values())
    rows = [[f"play operator, {samples} samples", "[ms]", "ns a sample", "ratio"]]
    rows += [[name, f"{t:.2f}", f"{1e6 * t / samples:.1f}", f"{t / fastest:.2f}"] for name, t in times.items()]
    return [rows if loop is not None else [*rows, ["numba is not installed", "-", "-", "-"]]]


def output(x: jax.Array, band: float, start: float) -> jax.Array:
    """What the operator gives, without its slope."""
    return play_operator(x - band, x + band, start)[0]


def jax_operators() -> dict[str, Callable[..., Any]]:
    """The operator, with three ways to its derivative by the friction exponent."""

    def with_slope(x: jax.Array, band: float, start: float) -> Any:
        return play_operator(x - band, x + band, start)

    def forward(x: jax.Array, band: float, start: float) -> Any:
        return jax.jvp(lambda b: output(x, b, start), (band,), (1.0,))

    def reverse(x: jax.Array, band: float, start: float) -> Any:
        return jax.value_and_grad(lambda b: jnp.sum(output(x, b, start) * x))(band)

    return {
        "value": output,
        "value with its slope": with_slope,
        "value, forward derivative": forward,
        "weighted sum, reverse derivative": reverse,
    }


def numba_loop() -> Callable[..., np.ndarray] | None:
    """The same loop by numba; None where it is not installed."""
    try:
        from numba import njit
    except ImportError:
        return None

    @njit
    def loop(x, band, start):
        y, path = start, np.empty_like(x)
        for i in range(len(x)):
            y = min(max(y, x[i] - band), x[i] + band)
            path[i] = y
        return path

    return loop


def python_loop(x: np.ndarray, band: float, start: float) -> np.ndarray:
    """The same loop in Python."""
    y, path = float(start), []
    for low, high in zip((x - band).tolist(), (x + band).tolist(), strict=True):
        y = low if y < low else high if y > high else y
        path.append(y)
    return np.array(path)


def warn_if_apart(name: str, path: np.ndarray, expected: np.ndarray) -> None:
    """Say when two ways to the same thing differ, which would make this a comparison of unequal things."""
    apart = float(np.max(np.abs(path - expected)))
    if not apart < AGREEMENT:
        print(f"Warning: the play operator by {name} is off by {apart:g}.", file=sys.stderr)
