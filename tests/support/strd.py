"""NIST's certified nonlinear regressions (StRD): their 27 models; data and certified values are in nist/*.toml."""

import tomllib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from bowdenfit.inference.compilation import compile_program
from bowdenfit.inference.solver import minimize, orthogonalize

FOLDER = Path(__file__).parents[1] / "inference" / "nist"
MOST_DIGITS = 11.0  # certified values have no more


@dataclass(frozen=True)
class Problem:
    """Readings, model, starts and certified answers."""

    name: str
    x: np.ndarray
    y: np.ndarray
    model: Callable[[Array, Array], Array]
    starts: tuple[np.ndarray, np.ndarray]
    certified: np.ndarray
    standard_deviation: np.ndarray
    residual_sum_of_squares: float

    def evaluate(self) -> Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]:
        """Residuals and their Jacobian, compiled."""

        def residuals(b: Array) -> tuple[Array, Array]:
            deviation = self.model(b, jnp.asarray(self.x)) - self.y
            return deviation, deviation

        def both(b: Array) -> tuple[Array, Array]:
            slopes, deviation = jax.jacfwd(residuals, has_aux=True)(b)
            return deviation, slopes

        program = compile_program(both, self.certified, run_once=True)
        return lambda b: tuple(np.asarray(part) for part in program(b))  # type: ignore[return-value]


@dataclass(frozen=True)
class Certification:
    """Digits that agree with the certified values: the worst parameter, the worst standard error, the sum of squares."""

    succeeded: bool
    parameters: float
    standard_errors: float
    sum_of_squares: float
    evaluations: int


def problem(name: str) -> Problem:
    """A problem by its name, in lower case."""
    raw = tomllib.loads((FOLDER / f"{name}.toml").read_text())
    x = np.array([raw["x1"], raw["x2"]] if "x1" in raw else raw["x"])
    y = np.log(raw["y"]) if name == "nelson" else np.array(raw["y"])
    starts = np.array(raw["start_1"]), np.array(raw["start_2"])
    certified, sd = np.array(raw["certified"]), np.array(raw["standard_deviation"])
    return Problem(raw["name"], x, y, MODELS[name], starts, certified, sd, raw["residual_sum_of_squares"])


def certify(regression: Problem) -> tuple[Certification, Certification]:
    """The package's solver on a problem, from both starts."""
    evaluate, calls = regression.evaluate(), []

    def counted(b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        calls.append(1)
        return evaluate(b)

    results = []
    for start in regression.starts:
        calls.clear()
        minimum = minimize(counted, start)
        residual_sd = np.sqrt(minimum.sum_of_squares / (len(regression.y) - len(start)))
        errors = residual_sd * np.linalg.norm(orthogonalize(minimum.jacobian)[1], axis=1)
        digits = [
            digits_alike(minimum.x, regression.certified),
            digits_alike(errors, regression.standard_deviation),
            digits_alike(np.array([minimum.sum_of_squares]), np.array([regression.residual_sum_of_squares])),
        ]
        results.append(Certification(minimum.succeeded, *digits, len(calls)))
    return results[0], results[1]


def digits_alike(estimates: np.ndarray, certified: np.ndarray) -> float:
    """Log relative error: decimal digits in which the worst of several numbers agrees."""
    error = np.max(np.abs(estimates - certified) / np.abs(certified))
    return float(np.clip(-np.log10(max(error, 1e-300)), 0.0, MOST_DIGITS)) if np.isfinite(error) else 0.0


def _saturation(b: Array, x: Array) -> Array:
    return b[0] * (1 - jnp.exp(-b[1] * x))


def _decay_over_line(b: Array, x: Array) -> Array:
    return jnp.exp(-b[0] * x) / (b[1] + b[2] * x)


def _three_decays(b: Array, x: Array) -> Array:
    return b[0] * jnp.exp(-b[1] * x) + b[2] * jnp.exp(-b[3] * x) + b[4] * jnp.exp(-b[5] * x)


def _two_peaks(b: Array, x: Array) -> Array:
    peaks = b[2] * jnp.exp(-(((x - b[3]) / b[4]) ** 2)) + b[5] * jnp.exp(-(((x - b[6]) / b[7]) ** 2))
    return b[0] * jnp.exp(-b[1] * x) + peaks


def _cubic_over_cubic(b: Array, x: Array) -> Array:
    return (b[0] + b[1] * x + b[2] * x**2 + b[3] * x**3) / (1 + b[4] * x + b[5] * x**2 + b[6] * x**3)


def _cycles(b: Array, x: Array) -> Array:
    year, second, third = (2 * jnp.pi * x / period for period in (12.0, b[3], b[6]))
    total = b[0] + b[1] * jnp.cos(year) + b[2] * jnp.sin(year)
    total += b[4] * jnp.cos(second) + b[5] * jnp.sin(second)
    return total + b[7] * jnp.cos(third) + b[8] * jnp.sin(third)


MODELS: dict[str, Callable[[Array, Array], Array]] = {
    "bennett5": lambda b, x: b[0] * (b[1] + x) ** (-1 / b[2]),
    "boxbod": _saturation,
    "chwirut1": _decay_over_line,
    "chwirut2": _decay_over_line,
    "danwood": lambda b, x: b[0] * x ** b[1],
    "eckerle4": lambda b, x: b[0] / b[1] * jnp.exp(-0.5 * ((x - b[2]) / b[1]) ** 2),
    "enso": _cycles,
    "gauss1": _two_peaks,
    "gauss2": _two_peaks,
    "gauss3": _two_peaks,
    "hahn1": _cubic_over_cubic,
    "kirby2": lambda b, x: (b[0] + b[1] * x + b[2] * x**2) / (1 + b[3] * x + b[4] * x**2),
    "lanczos1": _three_decays,
    "lanczos2": _three_decays,
    "lanczos3": _three_decays,
    "mgh09": lambda b, x: b[0] * (x**2 + x * b[1]) / (x**2 + x * b[2] + b[3]),
    "mgh10": lambda b, x: b[0] * jnp.exp(b[1] / (x + b[2])),
    "mgh17": lambda b, x: b[0] + b[1] * jnp.exp(-x * b[3]) + b[2] * jnp.exp(-x * b[4]),
    "misra1a": _saturation,
    "misra1b": lambda b, x: b[0] * (1 - (1 + b[1] * x / 2) ** -2),
    "misra1c": lambda b, x: b[0] * (1 - (1 + 2 * b[1] * x) ** -0.5),
    "misra1d": lambda b, x: b[0] * b[1] * x / (1 + b[1] * x),
    "nelson": lambda b, x: b[0] - b[1] * x[0] * jnp.exp(-b[2] * x[1]),
    "rat42": lambda b, x: b[0] / (1 + jnp.exp(b[1] - b[2] * x)),
    "rat43": lambda b, x: b[0] / (1 + jnp.exp(b[1] - b[2] * x)) ** (1 / b[3]),
    "roszman1": lambda b, x: b[0] - b[1] * x - jnp.arctan(b[2] / (x - b[3])) / jnp.pi,
    "thurber": _cubic_over_cubic,
}
