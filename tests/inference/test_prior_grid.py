"""Charts of values over z: one-to-one, with known slopes, for the parameters that they are meant for."""

import jax
import jax.numpy as jnp
import numpy as np

from bowdenfit.dataset import load_dataset
from bowdenfit.inference.coordinates import NODES, PriorGrid, make_prior_grid
from bowdenfit.models import build_model

DIMENSIONS = 5
CHART = PriorGrid(DIMENSIONS, np.array([1, 4]), np.stack([np.exp(0.5 * NODES), np.sinh(NODES)], axis=1))


def test_a_chart_leads_back_and_knows_its_slopes():
    """Between the nodes and far beyond them."""
    z, map_points = 5 * np.random.default_rng(4).standard_normal((21, DIMENSIONS)), jax.jit(CHART.map_points)
    computed, arguments, volume = map(np.asarray, map_points(z, True))
    kept_as_given, back, same = map_points(computed, False)
    np.testing.assert_array_equal(arguments, z)
    np.testing.assert_array_equal(kept_as_given, computed)
    np.testing.assert_allclose(back, z, rtol=1e-9)
    np.testing.assert_array_equal(same, volume)
    further = np.asarray(map_points(z + 1e-7, True)[0])
    np.testing.assert_allclose(np.log((further - computed) / 1e-7).sum(axis=-1), -volume, atol=1e-4)
    indices = [i for i in range(DIMENSIONS) if i not in CHART.indices]
    np.testing.assert_array_equal(computed[..., indices], z[..., indices])


def test_coefficients_curvatures_and_departures_are_charted_and_noise_scales_are_not(on_body):
    """Levels and slopes of curves are linear in z as they are."""
    space = build_model(load_dataset(on_body)).space
    chart = make_prior_grid(space)
    charted = {space.free[i].name for i in chart.indices}
    columns = ("free_sheath_angle", "squeezed_sheath_angle")
    of_curves = {f"{column}_{ending}" for column in columns for ending in ("c", "departure_1", "departure_2")}
    assert charted == {"mu1", "mu2", "mu3"} | of_curves
    z = np.repeat(np.asarray(NODES)[100:140:10, None], space.size, axis=1)
    values = jax.jit(lambda z: jnp.stack([p.prior.constrain(z[:, i]) for i, p in enumerate(space.free)], axis=1))(z)
    computed = jax.jit(chart.map_points)(z, True)[0]
    np.testing.assert_allclose(computed[:, chart.indices], values[:, chart.indices], rtol=1e-9, atol=1e-12)
