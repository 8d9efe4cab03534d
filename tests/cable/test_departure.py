"""Smooth departures from a family's curve: their functions, what a model has of them, and angles that no family follows."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import bowdenfit as bf
from bowdenfit.cable.departure import DEPARTURE_SHARES, SMOOTH_SHARES, smooth_functions
from bowdenfit.kinds.descriptions import parse_description
from bowdenfit.models import build_model
from bowdenfit.questions.summary.brief import summary_text
from bowdenfit.questions.summary.details import details_text
from bowdenfit.questions.summary.page import summarize

NODES, WEIGHTS = np.polynomial.legendre.leggauss(200)
CABLE = """
name = "power"
geometry = "continuous"
[route]
variable = "cable_length"
unit = "mm"
range = [1800, 2500]
[tables.angles]
file = "angles.csv"
[tables.forces]
file = "forces.csv"
[[contact]]
name = "rising"
friction = "mu1"
wrap_angle = { curve = "gaussian", column = "rising", departure = "DEPARTURE" }
[[contact]]
name = "falling"
friction = "mu2"
wrap_angle = { curve = "gaussian", column = "falling", departure = "DEPARTURE" }
[[contact]]
name = "edge"
friction = "mu3"
wrap_angle = { value = 45, unit = "deg" }
"""
TRUTH = {"mu1": 0.083, "mu2": 0.327, "mu3": 0.129}


@pytest.fixture(autouse=True)
def x64():
    with jax.enable_x64(True):
        yield


def power(x):
    """Angle [rad] of a power law at x from 0 to 1."""
    return 0.03 + 0.95 * x**1.4


def hyperbola(x):
    """Angle [rad] that rises ever faster to the end of the range."""
    return 0.4 / (1.4 - x)


def write_bench(folder, departure, seed, rising=power, noise_deg=2.4, tau=0.011, mountings=8):
    """A bench whose angles follow a curve that is no bell, as a data set; made without the package."""
    rng, x = np.random.default_rng(seed), np.linspace(0, 1, 21)
    lines = ["cable_length_mm,rising_deg,falling_deg"]
    for place in x:
        angles = np.rad2deg([rising(place), rising(1 - place)]) + noise_deg * rng.standard_normal(2)
        lines.append(f"{1800 + 700 * place:.0f},{max(angles[0], 0.1):.2f},{max(angles[1], 0.1):.2f}")
    (folder / "angles.csv").write_text("\n".join(lines) + "\n")
    lines = ["run,cable_length_mm,stroke,input_force_N,output_force_N"]
    for run, place in enumerate(np.linspace(0.03, 0.97, mountings)):
        exponent = TRUTH["mu1"] * rising(place) + TRUTH["mu2"] * rising(1 - place) + TRUTH["mu3"] * np.pi / 4
        exponent += tau * rng.standard_normal()
        for force in (40, 80, 120):
            scatter = 1 + 0.004 * rng.standard_normal(2)
            forces = force * scatter * np.exp([0.0, -exponent])
            lines.append(f"{run},{1800 + 700 * place:.0f},pull,{forces[0]:.3f},{forces[1]:.3f}")
    (folder / "forces.csv").write_text("\n".join(lines) + "\n")
    (folder / "cable.toml").write_text(CABLE.replace("DEPARTURE", departure))
    return folder


def test_functions_are_orthogonal_to_each_other_and_to_straight_lines():
    functions = np.asarray(smooth_functions(jnp.asarray(NODES), SMOOTH_SHARES))
    np.testing.assert_allclose((functions.T * WEIGHTS / 2) @ functions, np.eye(len(SMOOTH_SHARES)), atol=1e-12)
    np.testing.assert_allclose((WEIGHTS / 2) @ functions, 0.0, atol=1e-12)
    departures = smooth_functions(jnp.asarray(NODES), DEPARTURE_SHARES)
    np.testing.assert_allclose(departures, functions[:, [1, 2]], rtol=1e-12)
    np.testing.assert_allclose((WEIGHTS * NODES / 2) @ departures, 0.0, atol=1e-12)


def test_shares_are_those_of_the_process_and_what_is_left_out_is_small():
    distance = np.sqrt(5) * np.abs(NODES[:, None] - NODES) / 0.6
    covariance = (1 + distance + distance**2 / 3) * np.exp(-distance)

    def variances(shares):
        functions = np.asarray(smooth_functions(jnp.asarray(NODES), shares)) * WEIGHTS[:, None] / 2
        return np.diag(functions.T @ covariance @ functions)

    of_departure, of_curve = variances(DEPARTURE_SHARES), variances(SMOOTH_SHARES)
    np.testing.assert_allclose(list(DEPARTURE_SHARES.values()), of_departure / of_departure.sum(), atol=0.01)
    np.testing.assert_allclose(list(SMOOTH_SHARES.values()), of_curve, rtol=0.04)
    lines = np.stack([np.ones_like(NODES), np.sqrt(3) * NODES]) * WEIGHTS / 2
    whole = np.sum(WEIGHTS / 2) - np.trace(lines @ covariance @ lines.T)
    assert of_departure.sum() > 0.8 * whole


def test_a_departure_is_smooth_and_constant_outside_the_range():
    z = jnp.linspace(-0.99, 0.99, 101)
    slopes = jax.vmap(jax.jacfwd(lambda z: smooth_functions(z[None], SMOOTH_SHARES)[0]))(z)
    by_differences = (smooth_functions(z + 1e-6, SMOOTH_SHARES) - smooth_functions(z - 1e-6, SMOOTH_SHARES)) / 2e-6
    np.testing.assert_allclose(slopes, by_differences, atol=1e-6)
    ends = [smooth_functions(jnp.array(z), SMOOTH_SHARES) for z in ([1.5, 9.0], [1.0, 1.0])]
    np.testing.assert_allclose(*ends, rtol=1e-12)


@pytest.mark.parametrize("family", ["gaussian", "line", "logistic"])
def test_each_family_departs_and_is_itself_at_weights_of_0(family, tmp_path):
    def build(departure):
        write_bench(tmp_path, departure, 1)
        file = tmp_path / "cable.toml"
        file.write_text(file.read_text().replace("gaussian", family))
        return build_model(bf.read(tmp_path))

    plain, smooth = build("none"), build("smooth")
    names = [p.name for p in plain.space.parameters]
    assert [name for name in (p.name for p in smooth.space.parameters) if "departure" not in name] == names
    further = [p for p in smooth.space.parameters if "departure" in p.name]
    assert len(further) == 2 * len(DEPARTURE_SHARES)
    values = smooth.space.constrain(jnp.zeros(smooth.space.size))
    route = jnp.linspace(1800.0, 2500.0, 9)
    np.testing.assert_allclose(smooth.cable.wrap_angles(values, route), plain.cable.wrap_angles(values, route), rtol=1e-12)
    departed = values | {"rising_departure_1": jnp.asarray(-50.0)}
    assert np.min(smooth.cable.wrap_angles(departed, route)) == 0.0, "no negative angles"


def test_angles_depart_unless_stated_otherwise_and_not_in_the_published_geometry(on_body):
    def departing(*settings):
        return [curve.departs for curve in build_model(bf.read(on_body, settings=settings)).cable.curves.values()]

    assert departing() == [True, True]
    assert departing("contact.1.wrap_angle.departure=none") == [True, False]
    assert departing("geometry=published") == [False, False]
    assert departing("geometry=published", "contact.0.wrap_angle.departure=smooth") == [True, False]


def test_a_smooth_curve_follows_angles_of_no_known_family(tmp_path):
    def two_bells(x):
        return 0.05 + np.exp(-((x - 0.15) ** 2) / 0.06) + 0.7 * np.exp(-((x - 0.9) ** 2) / 0.05)

    def rms(curve):
        file = write_bench(tmp_path, "none", 4, rising=two_bells, noise_deg=1.0) / "cable.toml"
        departure = '"gaussian", column = "rising", departure = "none"'
        file.write_text(file.read_text().replace(departure, f'"{curve}", column = "rising"'))
        fit = bf.fit(tmp_path, mcmc=False, seed=1, figures=False)
        x = np.linspace(0, 1, 101)
        values = fit.model.space.constrain(jnp.asarray(fit.least_squares.z))
        angle = fit.model.cable.curves["rising"].wrap_angle(values, jnp.asarray(1800 + 700 * x))
        return np.sqrt(np.mean((np.rad2deg(np.asarray(angle)) - np.rad2deg(two_bells(x))) ** 2))

    assert rms("smooth") < 3.0 < rms("gaussian")


def test_a_smooth_curve_has_no_family_to_depart_from():
    angle = {"curve": "smooth", "column": "a", "departure": "none"}
    with pytest.raises(bf.DescriptionError, match="no family to depart from"):
        parse_description({"name": "x", "contact": [{"name": "a", "friction": "mu", "wrap_angle": angle}]})


def test_a_departure_needs_a_curve():
    contact = {"name": "c", "friction": "mu", "wrap_angle": {"column": "angle", "departure": "smooth"}}
    with pytest.raises(bf.BowdenfitError, match="belongs to a curve"):
        parse_description({"name": "c", "contact": [contact], "tables": {"forces": {"file": "f.csv"}}})


def test_a_departure_is_named_that_makes_the_model_describe_angles_which_no_family_follows(tmp_path):
    reasons = bf.fit(write_bench(tmp_path, "none", 2, hyperbola, 0.8, 0.004), mcmc=False).verdict().reasons
    assert "wrap_angle.departure=smooth" in " ".join(reasons)
    assert not bf.fit(write_bench(tmp_path, "smooth", 2, hyperbola, 0.8, 0.004), mcmc=False).verdict().troubles


@pytest.mark.extended
def test_with_departures_a_power_law_is_trusted_and_its_coefficients_are_held(tmp_path):
    fit = bf.fit(write_bench(tmp_path, "smooth", 3), seed=1, figures=False)
    assert fit.verdict().trusted
    for name, mu in TRUTH.items():
        interval = fit.parameter(name)
        assert interval.q05 < mu < interval.q95, name
    assert "Rising departs from its curve by" in details_text(fit)
    assert "rising_departure_rms" in summarize(fit)["curves"]


@pytest.mark.extended
def test_a_bell_that_is_refuted_is_said_to_be_wrong_on_the_first_page(tmp_path):
    fit = bf.fit(write_bench(tmp_path, "smooth", 2, hyperbola, 0.8, 0.004), seed=1, figures=False)
    assert fit.verdict().trusted
    assert "A gaussian curve alone would be wrong for rising" in summary_text(fit)
