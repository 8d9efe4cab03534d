"""Errors in wrap angles as well as in forces: the effective variance against latent true angles as unknowns.

The effective variance of a row is that of its loss and mu squared times that of its angle. Its weights follow the coefficient
without being differentiated, so that the estimate solves sum w theta (loss - mu theta) = 0; with the true angles as unknowns
the same sum is -mu sigma^2 sum w^2 (loss - mu theta)^2. The estimates thus differ by the share sigma^2 / theta^2 of the
coefficient: about a hundredth for 5 deg in 50 deg, and below a standard error until there are hundreds of rows.
"""

from dataclasses import replace

import jax.numpy as jnp
import numpy as np
import pytest
from cables import DESIGN, cable, measured
from own_angle_tables import of_rows
from scipy import optimize

from bowdenfit.dataset import Dataset
from bowdenfit.inference.least_squares import LeastSquares, fit_least_squares
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.inference.objective import make_objective
from bowdenfit.kinds.forces.table import ForceTable
from bowdenfit.models import build_model

pytestmark = pytest.mark.extended

MU, TAU = 0.14, 0.01


def fitted(dataset: Dataset, start: float = 0.0) -> LeastSquares:
    posterior = LogDensity(build_model(dataset))
    return fit_least_squares(posterior, make_objective(posterior), np.full(posterior.model.space.size, start))


def _misread(seed: int, sd: float, n: int = 14) -> tuple[np.ndarray, np.ndarray]:
    """Losses of rows, and their wrap angles as read with an error [rad]."""
    rng = np.random.default_rng(seed)
    true = np.deg2rad(np.linspace(25.0, 150.0, n))
    return MU * true + TAU * rng.standard_normal(n), true + sd * rng.standard_normal(n)


def _with_latent_angles(
    loss: np.ndarray, angle: np.ndarray, sd: float | np.ndarray, loss_sd: float | np.ndarray = TAU
) -> tuple[float, float]:
    """Coefficient and standard error with every true angle an unknown, residuals of losses and of angles."""

    def residuals(unknown: np.ndarray) -> np.ndarray:
        return np.concatenate([(loss - unknown[0] * unknown[1:]) / loss_sd, (angle - unknown[1:]) / sd])

    solution = optimize.least_squares(residuals, np.concatenate([[0.1], angle]), xtol=1e-14, ftol=1e-14, gtol=1e-14)
    scatter = 2 * solution.cost / (len(loss) - 1)
    return float(solution.x[0]), float(np.sqrt(scatter * np.linalg.inv(solution.jac.T @ solution.jac)[0, 0]))


@pytest.mark.parametrize("degrees", [2.0, 5.0])
def test_the_effective_variance_agrees_with_unknown_true_angles(degrees):
    sd = np.deg2rad(degrees)
    for seed in range(4):
        loss, angle = _misread(seed, sd)
        estimate = fitted(of_rows(loss, angle[:, None], sd, prior={"tau": {"fixed": TAU}})).estimates["mu1"]
        mu, error = _with_latent_angles(loss, angle, sd)
        assert abs(estimate.value - mu) < 0.25 * error
        assert estimate.standard_error == pytest.approx(error, rel=0.05)
        assert estimate.lower < mu < estimate.upper


def test_the_difference_to_unknown_true_angles_is_the_share_that_is_known():
    """Of a whole hundred rows of 8 deg: nearly two hundredths, more than half a standard error."""
    sd = np.deg2rad(8.0)
    loss, angle = _misread(11, sd, n=100)
    solution = fitted(of_rows(loss, angle[:, None], sd, prior={"tau": {"fixed": TAU}})).estimates["mu1"]
    mu, error = _with_latent_angles(loss, angle, sd)

    def share(value: float) -> float:
        weight = 1 / (TAU**2 + value**2 * sd**2)
        return value * sd**2 * np.sum(weight**2 * (loss - value * angle) ** 2) / np.sum(weight * angle**2)

    assert mu - solution.value == pytest.approx(share(mu), rel=0.1)
    assert 0.005 < (mu - solution.value) / mu < 0.03
    assert error / mu < 0.03


def test_the_weighted_gradient_is_zero_wherever_the_solver_starts():
    """A method that compares sums of squares alone stops short: weights that follow the coefficient change them too."""
    sd = np.deg2rad(12.0)
    loss, angle = _misread(3, sd)
    dataset = of_rows(loss, angle[:, None], sd, prior={"tau": {"fixed": TAU}})
    values = [fitted(dataset, start).estimates["mu1"].value for start in (-2.0, 0.0, 2.5)]
    for mu in values:
        weight = 1 / (TAU**2 + mu**2 * sd**2)
        assert abs(np.sum(weight * angle * (loss - mu * angle))) < 1e-8 * np.sum(weight * angle * loss)
    assert values == pytest.approx([values[0]] * 3, rel=1e-9)


def test_force_runs_agree_with_unknown_true_angles():
    """The error of an angle is that of its run, however many its samples are; four runs have rough angles, four good ones."""
    source = {"column": "clamp_angle", "nominal": {"value": 30, "unit": "deg"}}
    contact = {"name": "clamp", "friction": "mu_clamp", "wrap_angle": source}
    exact, _ = measured(cable(1, ("forces",), contact=[contact]), seed=5, design=DESIGN)
    sd = np.deg2rad(np.tile([2.0, 10.0], 4))
    misread = sd * np.random.default_rng(2).standard_normal(8)
    dataset = _with_angle_errors(exact, misread, sd)
    estimate = fitted(dataset).estimates["mu_clamp"]
    angle, loss, loss_sd = _runs(dataset)
    mu, error = _with_latent_angles(loss, angle, sd, loss_sd)
    assert abs(estimate.value - mu) < 0.25 * error
    assert estimate.standard_error == pytest.approx(error, rel=0.05)
    told_exact = fitted(_with_angle_errors(exact, misread, 0 * sd)).estimates["mu_clamp"]
    assert abs(told_exact.value - mu) > 0.25 * error  # the errors of the angles do matter here


def _with_angle_errors(dataset: Dataset, misread: np.ndarray, sd: np.ndarray) -> Dataset:
    """Force runs whose angles were misread, with their standard deviations as the table states them [rad]."""
    forces = dataset.measurements.table(ForceTable)
    angle = np.maximum(forces.own.angle[:, 0] + misread[forces.run], 0.01)
    own_angles = replace(forces.own, angle=angle[:, None], sd=sd[forces.run][:, None])
    return replace(dataset, measurements=dataset.measurements.with_tables(replace(forces, own=own_angles)))


def _runs(dataset: Dataset) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Wrap angle of each run, its loss, and the standard deviation of that without the angle's error."""
    model, forces = build_model(dataset), dataset.measurements.table(ForceTable)
    (term,) = model.terms
    values = model.space.constrain(jnp.zeros(model.space.size))
    loss_sd = np.sqrt(float(values["tau"]) ** 2 + float(values["sigma_F"]) ** 2 / term.data.run_weight)
    first = np.unique(forces.run, return_index=True)[1]
    return forces.own.angle[first, 0], term.data.run_mean, loss_sd
