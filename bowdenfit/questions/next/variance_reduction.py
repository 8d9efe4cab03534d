"""Expected reduction of an answer's variance by a reading that has not been taken yet, from draws of the posterior alone.

Every draw gives the answer and, with noise, the reading that a cable of these parameters would give. How far the answer can
be told from the reading is then a regression over the draws: by the law of total variance the variance of the answer that
is left once the reading is known is, on average over all that the reading may turn out to be,

    E[Var(answer | reading)] = Var(answer) - Var(E[answer | reading]) = (1 - share) Var(answer).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations_with_replacement
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float
from scipy.spatial import cKDTree
from scipy.special import ndtri

from bowdenfit.inference.draws import for_each_draw
from bowdenfit.kinds.candidate import Candidate
from bowdenfit.kinds.tables import Measurements
from bowdenfit.kinds.terms import candidate_kinds
from bowdenfit.models import Model
from bowdenfit.questions.next.candidates import build_situation

GROUPS = 64  # of draws: what is learned on all but one is judged on that one; a judgement
# Degrees of the polynomials, by the number of columns of a reading. Judgements, so that there are few terms beside the draws;
# `scripts/check_next_measurement.py` compares the ranking with refits.
_DEGREES = {1: 5, 2: 4, 3: 3}
_DEFAULT_DEGREE = 2
# Outcomes of a reading, and draws that stand for what is known after one; judgements: with fewer outcomes the ends of their
# range differ by a third instead of a sixth from seed to seed (`scripts/check_one_mounting.py`).
_OUTCOMES, _NEAREST = 10_000, 200
_MIN_REPEATS = 3  # readings whose scatter says something; a judgement
_NEGLIGIBLE_SPREAD = 1e-9  # relative spread below which readings are all the same


@dataclass(frozen=True)
class Explained:
    """Share of an answer's variance that a reading would take away, on average.

    Args:
        share: Share of the variance, at least 0 [1].
        error: Its Monte Carlo standard error, because the draws are so many and no more [1].
        without: The share with each group of draws left out, before it is cut off at 0 [1].
    """

    share: float
    error: float
    without: Float[np.ndarray, " groups"]


def explained_share(
    reading: Float[np.ndarray, "draws columns"], answer: Float[np.ndarray, " draws"], groups: int = GROUPS
) -> Explained:
    """Return the share of the variance of an answer that a reading explains.

    The answer is regressed on polynomials of the reading, so that dependence may be curved. The polynomials are fitted
    without one group of draws and judged on that group, in turn, so that noise does not look like information. Draws that
    are not independent must follow each other (walker after walker): then groups are nearly so, and the error is right.
    A regression that cannot follow the true dependence finds too small a share, never too large a one.

    Args:
        reading: The reading as each draw would give it; several columns are read together.
        answer: The answer of each draw.
        groups: Number of groups.
    """
    polynomials = _build_polynomials(reading)
    residual, total = _residual_squares(polynomials, answer, groups)
    sum_left, sum_total = float(np.sum(residual)), float(np.sum(total))
    without = 1 - (sum_left - residual) / (sum_total - total) if sum_total > 0 else np.zeros(len(residual))
    share = 1 - sum_left / sum_total if sum_total > 0 else 0.0
    return Explained(float(np.clip(share, 0.0, 1.0)), _jackknife_error(without), without)


def widths_after_outcomes(
    readings: Float[np.ndarray, "draws repeats columns"], answer: Float[np.ndarray, " draws"]
) -> Float[np.ndarray, " outcomes"]:
    """Return the width of the 90 % interval of an answer after each of many outcomes of a reading.

    After an outcome the draws that gave nearly the same reading are left, as in approximate Bayesian computation. Widths and no
    standard deviations: where the tail is long, these are those of a few draws, and differ by a factor from seed to seed.

    Args:
        readings: The reading as each draw would give it, taken several times; its columns are read together.
        answer: The answer of each draw.
    """
    of_each, repeats = readings.reshape(-1, readings.shape[2]), readings.shape[1]
    scores = np.column_stack([_compute_normal_scores(column) for column in of_each.T])
    outcomes = np.linspace(0, len(scores) - 1, min(_OUTCOMES, len(scores))).astype(int)
    _, nearest = cKDTree(scores).query(scores[outcomes], k=min(_NEAREST, len(scores)))
    return width_of_interval(np.repeat(answer, repeats)[nearest])


def width_of_interval(draws: np.ndarray) -> np.ndarray:
    """Return the width of the central 90 % of draws along the last axis."""
    low, high = np.quantile(draws, (0.05, 0.95), axis=-1)
    return np.asarray(high - low)


def error_of_difference(first: Explained, second: Explained) -> float:
    """Return the standard error of the difference of two shares from the same draws, which err together."""
    return _jackknife_error(first.without - second.without)


def _jackknife_error(without: np.ndarray) -> float:
    """Return the standard error from values with one group left out in turn."""
    n = len(without)
    return float(np.sqrt((n - 1) / n * np.sum((without - without.mean()) ** 2)))


def _residual_squares(x: np.ndarray, answer: np.ndarray, groups: int) -> tuple[np.ndarray, np.ndarray]:
    """Return of each group the squared deviations from the regression, and from the mean, that the other groups give."""
    scale = answer.std()
    y = (answer - answer.mean()) / (scale if scale > 0 else 1.0)
    parts = [(x[part], y[part]) for part in np.array_split(np.arange(len(y)), min(groups, len(y)))]
    products = np.array([a.T @ a for a, _ in parts])
    with_answer = np.array([a.T @ b for a, b in parts])
    squares = np.array([b @ b for _, b in parts])
    return _cross_validated_squares(products, with_answer, squares), _cross_validated_squares(
        products[:, :1, :1], with_answer[:, :1], squares
    )


def _cross_validated_squares(products: np.ndarray, with_answer: np.ndarray, squares: np.ndarray) -> np.ndarray:
    """Return the squared deviations of each group from what least squares of the others predicts."""
    squares_left = np.empty(len(squares))
    for g in range(len(squares)):
        remaining = products.sum(axis=0) - products[g], with_answer.sum(axis=0) - with_answer[g]
        coefficients = np.linalg.lstsq(*remaining, rcond=1e-12)[0]
        squares_left[g] = squares[g] - 2 * coefficients @ with_answer[g] + coefficients @ products[g] @ coefficients
    return squares_left


def _build_polynomials(reading: np.ndarray) -> np.ndarray:
    """Return products of powers of the columns, the constant first; columns that say nothing are left out."""
    columns = [
        _compute_normal_scores(column) for column in reading.T if np.ptp(column) > _NEGLIGIBLE_SPREAD * np.abs(column).max()
    ]
    degree = _DEGREES.get(len(columns), _DEFAULT_DEGREE)
    terms = [np.ones(len(reading))]
    for power in range(1, degree + 1):
        for factors in combinations_with_replacement(columns, power):
            terms.append(np.prod(factors, axis=0))
    return np.column_stack(terms)


def _compute_normal_scores(column: np.ndarray) -> np.ndarray:
    """Return the column brought to a normal distribution by its ranks, so that no far value rules a polynomial."""
    from scipy.stats import rankdata  # here, because a fit, whose report can rank, must not wait for it

    return np.asarray(ndtri((rankdata(column) - 0.5) / len(column)))


def mean_and_spread(readings: Float[np.ndarray, "draws repeats columns"]) -> Float[np.ndarray, "draws statistics"]:
    """Summarize several readings of one kind: mean and, from three on, the logarithm of their scatter.

    Args:
        readings: Readings of each draw.
    """
    mean = readings.mean(axis=1)
    if readings.shape[1] < _MIN_REPEATS:
        return mean
    return np.column_stack([mean, np.log(readings.std(axis=1) + 1e-12)])


def simulate_readings(
    model: Model,
    measurements: Measurements,
    candidates: Sequence[Candidate],
    z: np.ndarray,
    seed: int,
    repeats: int = 1,
) -> list[np.ndarray]:
    """Return the reading of each candidate as each draw would give it: arrays over draws, repeats and columns.

    Args:
        model: The fitted model; its parameters stay as they are.
        measurements: Measurements so far, whose angles hold outside the range of the curves.
        candidates: The candidates.
        z: Draws of the posterior, one a row.
        seed: Seed of the noise.
        repeats: How often each reading is taken, each time with a new mounting where it has one.
    """
    by_kind: dict[str, list[Candidate]] = {}
    for candidate in candidates:
        by_kind.setdefault(candidate.kind, []).append(candidate)
    situation, kinds = build_situation(model, measurements), candidate_kinds()
    parts = {name: kinds[name].simulation(situation, candidates_of_kind) for name, candidates_of_kind in by_kind.items()}
    data, key = {name: part.data for name, part in parts.items()}, jax.random.key(seed)

    def readings(z_and_number: Array, data: Any, key: Array) -> dict[str, Array]:
        values, number = model.space.constrain(z_and_number[:-1]), z_and_number[-1].astype(jnp.uint32)
        keys = jax.random.split(jax.random.fold_in(key, number), (len(parts), repeats))
        return {
            name: jax.vmap(lambda k, part=part, name=name: part.simulate(values, data[name], k))(keys[i])
            for i, (name, part) in enumerate(parts.items())
        }

    program = for_each_draw(readings, model.space.size + 1, data, key, run_once=True)
    simulated = program(np.column_stack([z, np.arange(len(z), dtype=float)]))
    columns = {name: iter(part.columns) for name, part in parts.items()}
    return [np.maximum(simulated[c.kind][:, :, list(next(columns[c.kind]))], parts[c.kind].lowest) for c in candidates]
