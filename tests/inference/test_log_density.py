"""The density of a whole model: one with its residuals, its gradient right, and finite however far out."""

from dataclasses import replace
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from cables import cable, measured
from densities import draws, over_rows

import bowdenfit as bf
from bowdenfit.dataset import load_dataset
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.models import Model, build_model


def _models() -> dict[str, Model]:
    censored = {
        "angles": {"file": "a.csv", "detection_limit": {"value": 12, "unit": "deg"}},
        "forces": {"file": "f.csv"},
    }
    with_efficiencies, _ = measured(cable(3, ("angles", "efficiencies")), 1, once=True)
    with_forces, _ = measured(cable(5, tables=censored), 2, once=True)
    sensors = {"input_gain_error_sd": 0, "output_gain_error_sd": 0.01}
    with_gain, _ = measured(cable(3, ("angles", "efficiencies", "forces"), sensors=sensors), 3, once=True)
    without_forces = {"angles": censored["angles"], "efficiencies": {"file": "e.csv"}}
    robust, _ = measured(cable(2, without_forces, noise="student"), 2, once=True)
    return {
        "efficiencies": build_model(with_efficiencies),
        "forces and undetected angles": build_model(with_forces),
        "everything with gain error": build_model(with_gain),
        "Student noise": build_model(robust),
    }


@pytest.fixture(scope="module")
def models() -> dict[str, Model]:
    return _models()


MODELS = pytest.mark.parametrize(
    "name", ["efficiencies", "forces and undetected angles", "everything with gain error", "Student noise"]
)


@MODELS
def test_half_the_squared_residuals_are_minus_the_log_likelihood_up_to_a_constant_at_given_noise(models, name):
    model = models[name]
    posterior = LogDensity(model)
    noise = np.array([p.role == "noise" for p in model.space.free])
    z = draws(model, 20, 5)
    z[:, noise] = z[0, noise]

    def both(z, data):
        likelihoods, residuals = posterior.log_likelihoods(z, data), posterior.residuals(z, data)
        return jax.tree.map(jnp.sum, likelihoods), jax.tree.map(lambda r: jnp.sum(r**2) / 2, residuals)

    likelihood, squares = over_rows(both, z, posterior.data)
    for term in model.terms:
        total = likelihood[term.name] + squares[term.name]
        scale = 1 + np.abs(squares[term.name]).max()
        np.testing.assert_allclose(total, total[0], rtol=0, atol=1e-12 * scale)


@MODELS
def test_gradients_agree_with_finite_differences_also_far_out(models, name):
    """Along random directions, at draws of the prior and where every |z| is 4; and nothing is NaN or infinite."""
    posterior = LogDensity(models[name])
    size, generator = posterior.model.space.size, np.random.default_rng(6)
    z = np.concatenate([generator.standard_normal((30, size)), 4.0 * generator.choice([-1.0, 1.0], (30, size))])
    direction = generator.standard_normal(z.shape)
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    h, shifts = 1e-4, np.array([-2, -1, 0, 1, 2])  # five-point rule: error h^4
    shifted = (z + h * shifts[:, None, None] * direction).reshape(-1, size)
    value, slope = over_rows(jax.value_and_grad(posterior.log_density), shifted, posterior.data)
    value, slope = value.reshape(len(shifts), -1), slope.reshape(len(shifts), *z.shape)
    assert np.all(np.isfinite(value))
    assert np.all(np.isfinite(slope))
    base, along = value[2], np.sum(slope[2] * direction, axis=1)
    difference = (8 * (value[3] - value[1]) - (value[4] - value[0])) / (12 * h)
    rounding = 1e-15 * np.abs(base) / h
    assert np.all(np.abs(difference - along) <= 1e-6 * np.abs(along) + 100 * rounding + 1e-8)


@pytest.mark.extended
@MODELS
def test_residuals_and_their_derivatives_are_finite_far_out(models, name):
    posterior = LogDensity(models[name])
    generator = np.random.default_rng(7)
    z = 6.0 * generator.choice([-1.0, 1.0], (60, posterior.model.space.size))
    z = np.concatenate([z, np.zeros((1, posterior.model.space.size))])
    jacobian, residuals = over_rows(
        jax.jacfwd(lambda z, data: (posterior.residuals(z, data),) * 2, has_aux=True), z, posterior.data
    )
    for computed in (residuals, jacobian):
        assert all(np.all(np.isfinite(x)) for x in computed.values())


@pytest.mark.parametrize("which", ["on-body", "bench"])
def test_ten_thousand_draws_of_the_prior_give_finite_densities_and_plausible_efficiencies(which, on_body, bench):
    """Finite always; plausible along most of the range.

    The slope of a log angle is wide open a priori (sd 6 over half the range), so that at the ends of the range nearly
    half of all draws have so much wrap that nothing passes; in the middle one in seven has, because
    coefficients may be those of rubber, and at the best length few.
    """
    dataset = load_dataset(on_body) if which == "on-body" else bf.simulate(bench, seed=1)
    posterior = LogDensity(build_model(dataset))
    model = posterior.model
    low, high = model.description.route.range
    points = jnp.linspace(low, high, 21)

    def of(z, data):
        return posterior.log_density(z, data), jnp.exp(-model.cable.exponent_at(model.space.constrain(z), points))

    sample = draws(model, 10_000, 8)
    density, efficiency = over_rows(of, np.concatenate([np.zeros((1, model.space.size)), sample]), posterior.data)
    assert np.all(np.isfinite(density))
    assert np.all((efficiency >= 0) & (efficiency < 1))
    assert np.all((efficiency[0] > 0.3) & (efficiency[0] < 0.95))  # z = 0, the medians of all priors
    sample = efficiency[1:]
    assert np.mean(sample.max(axis=1) > 0.05) > 0.96
    assert np.mean(sample[:, 10] > 0.05) > 0.84  # in the middle of the range
    assert np.mean(sample[:, [0, -1]] > 0.05) > 0.5  # at its ends


DATA = Path(__file__).parents[2] / "datasets"
DATA_SETS = sorted(path.parent.name for path in DATA.glob("*/cable.toml"))


def _measured_elsewhere(model: Model) -> Model:
    """The same terms with a cable that was measured at other loads and speeds."""
    friction, conditions = model.cable.friction, model.cable.friction.conditions
    load, (slow, fast) = conditions.median_load, conditions.speeds
    elsewhere = replace(
        conditions,
        reference_force=1.4 * conditions.reference_force,
        reference_speed=1.4 * conditions.reference_speed,
        speeds=(slow / 2, 2 * fast),
        median_load=None if load is None else 1.4 * load,
    )
    cable = replace(model.cable, friction=replace(friction, conditions=elsewhere))
    return Model(cable, model.space, tuple(replace(term, cable=cable) for term in model.terms))


def _here_and_elsewhere(name: str, *settings: str) -> tuple[Model, dict[str, np.ndarray], dict[str, np.ndarray]]:
    """A model, and the log likelihoods of its terms for cables measured at its own and at other loads and speeds."""
    model = build_model(load_dataset(DATA / name, settings))
    z, posterior, elsewhere = draws(model, 5, 7), LogDensity(model), LogDensity(_measured_elsewhere(model))
    return model, *(over_rows(item.log_likelihoods, z, item.data) for item in (posterior, elsewhere))


@pytest.mark.extended
@pytest.mark.parametrize("name", DATA_SETS)
def test_terms_that_do_not_depend_on_conditions_are_the_same_elsewhere(name):
    """So that one compiled program may serve them all."""
    model, original, there = _here_and_elsewhere(name)
    for term in model.terms:
        if not getattr(term, "depends_on_conditions", True):
            np.testing.assert_array_equal(original[term.name], there[term.name])


@pytest.mark.extended
@pytest.mark.parametrize("setting", ["friction_model=load-dependent", 'sensors.offset_sd={value=1,unit="N"}'])
def test_runs_depend_on_conditions_where_friction_or_load_cells_do(setting):
    model, original, there = _here_and_elsewhere("synthetic-bench", setting)
    runs = next(term for term in model.terms if term.name == "run_efficiency")
    assert runs.depends_on_conditions
    assert not np.array_equal(original[runs.name], there[runs.name])
