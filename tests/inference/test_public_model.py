"""`bf.model`: the same density, predictions and priors as a fit has, as functions that JAX differentiates and vectorizes."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import bowdenfit as bf
from bowdenfit.inference.log_density import LogDensity

TABLE = "wrap_angle_deg,input_force_N,output_force_N\n" + "".join(
    f"{angle},{force},{force * np.exp(-0.12 * np.deg2rad(angle)) * (1 + 0.01 * wave):.4f}\n"
    for angle, force, wave in zip(np.repeat([45, 90, 180], 3), np.tile([20, 40, 60], 3), np.cos(np.arange(9.0)), strict=True)
)


@pytest.fixture(autouse=True)
def _in_64_bits():
    with jax.enable_x64(True):
        yield


@pytest.fixture(scope="module")
def model(tmp_path_factory):
    (folder := tmp_path_factory.mktemp("model")).joinpath("t.csv").write_text(TABLE)
    with jax.enable_x64(True):
        return bf.model(folder / "t.csv")


@pytest.fixture(scope="module")
def z(model):
    return jnp.asarray(0.3 * np.random.default_rng(1).standard_normal(len(model.names)))


def test_the_density_is_that_of_a_fit_and_the_sum_of_its_parts(model, z):
    density = LogDensity(model._model)

    def add_up(value):
        """The density of the parameters is that of z times the slope of z, which is one over what log_prior divides by."""
        parameters = model.constrain(value)
        slope = jax.jacfwd(lambda point: jnp.stack(list(model.constrain(point).values())))(value)
        volume = jnp.log(jnp.abs(jnp.linalg.det(slope)))
        return model.log_likelihood(parameters) + model.log_prior(parameters) + volume, model.unconstrain(parameters)

    of_fit = float(jax.jit(density.log_density)(z, density.data))
    parts, back = jax.jit(add_up)(z)
    assert float(jax.jit(model.log_density)(z)) == pytest.approx(of_fit, rel=1e-12)
    assert float(parts) == pytest.approx(of_fit, rel=1e-9)
    np.testing.assert_allclose(back, z, atol=1e-9)


def test_a_prior_in_its_units_integrates_to_one(tmp_path):
    (tmp_path / "t.csv").write_text(TABLE)
    model = bf.model(tmp_path / "t.csv", settings=["prior.tau.fixed=0.01", "prior.sigma_F.fixed=0.2"])
    assert model.names == ("mu",)
    grid = jnp.exp(jnp.linspace(-14.0, 9.0, 4001))
    density = jnp.exp(jax.vmap(lambda mu: model.log_prior({"mu": mu}))(grid))
    assert float(jnp.trapezoid(density, grid)) == pytest.approx(1.0, abs=1e-3)


def test_gradients_are_differences_and_functions_are_vectorized(model, z):
    density, gradient, step = jax.jit(model.log_density), jax.jit(jax.grad(model.log_density))(z), 1e-6
    for i in range(len(z)):
        up, down = (float(density(z.at[i].add(sign * step))) for sign in (1, -1))
        assert float(gradient[i]) == pytest.approx((up - down) / (2 * step), rel=1e-4, abs=1e-5)
    hessian = jax.jit(jax.hessian(model.log_density))(z)
    np.testing.assert_allclose(hessian, hessian.T, rtol=1e-8, atol=1e-8)
    assert jax.jit(jax.vmap(model.log_density))(jnp.stack([z, z + 0.1])).shape == (2,)


@pytest.mark.extended
def test_the_efficiency_along_a_route_is_that_of_a_fit_and_has_derivatives(on_body):
    model, fit = bf.model(on_body), bf.fit(on_body, mcmc=False, seed=1)
    z = jnp.full(len(model.names), 0.2)
    parameters = model.constrain(z)
    expected = fit.model.cable.efficiency_at(fit.model.space.constrain(z), jnp.array([440.0, 470.0]))
    np.testing.assert_allclose(model.efficiency(parameters, [440.0, 470.0]), expected, rtol=1e-9)
    slope = jax.grad(lambda point: model.efficiency(point, 470.0)[0])(parameters)
    assert float(slope["mu3"]) == pytest.approx(-np.deg2rad(45) * float(expected[1]), rel=1e-9)


def test_readings_expectations_and_residuals_belong_together(model, z):
    parameters = model.constrain(z)
    assert {name: part.shape for name, part in model.expected(parameters).items()} == {
        name: part.shape for name, part in model.readings.items()
    }
    assert np.isfinite(model.residuals(parameters)).all()


def test_least_squares_of_ones_own_finds_the_coefficient(tmp_path):
    from scipy.optimize import least_squares

    (tmp_path / "t.csv").write_text(TABLE)
    model = bf.model(tmp_path / "t.csv", settings=["prior.tau.fixed=0.01", "prior.sigma_F.fixed=0.2"])
    solution = least_squares(lambda point: np.asarray(model.residuals({"mu": point[0]})), [0.3])
    fit = bf.fit(tmp_path / "t.csv", mcmc=False, settings=["prior.tau.fixed=0.01", "prior.sigma_F.fixed=0.2"])
    assert solution.x[0] == pytest.approx(fit.least_squares.estimates["mu"].value, rel=1e-4)


def test_what_cannot_be_is_refused_in_sentences(model, tmp_path):
    with pytest.raises(bf.UsageError, match=r"there is no free parameter mu_.*did you mean 'mu'"):
        model.log_prior({"mu_": 0.1})
    with pytest.raises(bf.UsageError, match="missing; the free parameters are mu"):
        model.expected({})
    (tmp_path / "t.csv").write_text(TABLE)
    with pytest.raises(bf.UsageError, match="has no route"):
        lone = bf.model(tmp_path / "t.csv")
        lone.efficiency(lone.constrain(jnp.zeros(len(lone.names))), 450.0)
    with jax.enable_x64(False), pytest.raises(bf.UsageError, match="jax_enable_x64"):
        bf.model(tmp_path / "t.csv")


@pytest.mark.extended
def test_a_sampler_of_ones_own_agrees_with_the_fit(tmp_path):
    """Metropolis steps by NumPy. With some 2000 effective draws of each, medians differ by 0.05 sd; five times that fails."""
    (tmp_path / "t.csv").write_text(TABLE)
    model = bf.model(tmp_path / "t.csv")
    density, rng = jax.jit(jax.vmap(model.log_density)), np.random.default_rng(5)
    z = 0.1 * rng.standard_normal((400, len(model.names)))
    point, history = np.asarray(density(z)), []
    for step in range(3000):
        moved = z + rng.choice([0.1, 0.4, 1.2]) * rng.standard_normal(z.shape)
        there = np.asarray(density(moved))
        accepted = np.log(rng.random(len(z))) < there - point
        z, point = np.where(accepted[:, None], moved, z), np.where(accepted, there, point)
        if step >= 1500 and step % 15 == 0:
            history.append(z)
    mu = np.asarray(jax.vmap(model.constrain)(jnp.asarray(np.concatenate(history)))["mu"])
    interval = bf.fit(tmp_path / "t.csv", seed=2).parameter_of_draws("mu")
    assert np.median(mu) == pytest.approx(interval.median, abs=0.25 * interval.sd)
    assert np.quantile(mu, 0.05) == pytest.approx(interval.q05, abs=0.5 * interval.sd)
