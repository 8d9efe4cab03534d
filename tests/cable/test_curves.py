"""Curve families: their formulas, recovery of known truth, what results say of each, and the choice between them."""

import re
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from simulated_coverage import Laboratory

import bowdenfit as bf
from bowdenfit.cable.curves import LineCurve, LogisticCurve
from bowdenfit.cable.registry import CURVES
from bowdenfit.dataset import Dataset
from bowdenfit.description import Route
from bowdenfit.inference.least_squares import LeastSquares
from bowdenfit.kinds.descriptions import parse_description
from bowdenfit.kinds.rows import RowOrigin
from bowdenfit.kinds.tables import AngleTable, Measurements
from bowdenfit.physics.geometry import logistic_wrap_angle
from bowdenfit.questions.check.verb import check
from bowdenfit.questions.length.wrap_angles_figure import data, draw
from bowdenfit.questions.summary.details import details_text

ROUTE = Route(variable="cable_length", unit="mm", range=(400.0, 600.0))
LENGTHS = np.linspace(400.0, 600.0, 41)
LIMIT = 10.0  # deg

# Truths as the bench has them [deg, mm], and what the program reports of them.
LINES = {"rising": (20.0, 110.0), "falling": (95.0, 15.0)}
LOGISTICS = {"rising": (120.0, 510.0, 25.0), "falling": (80.0, 480.0, -30.0), "past its plateau": (60.0, 430.0, 12.0)}


def line(start: float, end: float) -> np.ndarray:
    """Angles [deg] along a straight line, without the package."""
    return start + (end - start) * (LENGTHS - 400.0) / 200.0


def logistic(A: float, B: float, C: float) -> np.ndarray:
    """Angles [deg] along a logistic curve, without the package."""
    return A / (1.0 + np.exp(-(LENGTHS - B) / C))


def bell(A: float, B: float, C: float) -> np.ndarray:
    """Angles [deg] along a Gaussian, without the package."""
    return A * np.exp(-(((LENGTHS - B) / C) ** 2))


SHAPES = {
    "line": line(*LINES["rising"]),
    "logistic": logistic(*LOGISTICS["rising"]),
    "gaussian": bell(90.0, 520.0, 80.0),
}


def described(curve: str, **more: Any):
    angle = {"curve": curve, "column": "sheath_angle", "departure": "none"}
    contact = {"name": "sheath", "friction": "mu", "wrap_angle": angle}
    tables = {"angles": {"file": "angles.csv", "detection_limit": {"value": LIMIT, "unit": "deg"}}}
    route = {"variable": "cable_length", "unit": "mm", "range": [400, 600]}
    return parse_description({"name": "one sheath", "route": route, "contact": [contact], "tables": tables} | more)


def read_off(curve: str, angle: np.ndarray, scatter: float = 0.0, least: float = LIMIT, seed: int = 5) -> Dataset:
    """A table of these angles [deg], those below the least too small to detect."""
    seen = angle + scatter * np.random.default_rng(seed).standard_normal(len(angle))
    hidden = seen < least
    reading, limit = np.where(hidden, np.nan, seen), np.where(hidden, least, np.nan)
    rows = np.arange(2, len(angle) + 2)
    origin = RowOrigin(("angles.csv",), np.zeros(len(angle), dtype=int), rows)
    table = AngleTable(LENGTHS, ("sheath_angle",), np.deg2rad(reading)[:, None], np.deg2rad(limit)[:, None], origin)
    return Dataset(described(curve), Measurements((table,)), {})


@pytest.fixture(scope="module")
def laboratory() -> Laboratory:
    return Laboratory()


# Formulas ---------------------------------------------------------------------------------------------------------


def test_a_line_has_its_angles_at_the_ends_of_the_range_and_is_nowhere_negative():
    curve = LineCurve("sheath_angle", ROUTE)
    values = {"sheath_angle_start": jnp.asarray(1.0), "sheath_angle_end": jnp.asarray(0.2)}
    points = jnp.asarray([400.0, 500.0, 600.0, 700.0])
    np.testing.assert_allclose(curve.wrap_angle(values, points), [1.0, 0.6, 0.2, 0.0], atol=1e-15)
    derived = curve.derived(values)
    np.testing.assert_allclose(derived["sheath_angle_middle"], np.rad2deg(0.6))
    np.testing.assert_allclose(derived["sheath_angle_slope"], np.rad2deg(-0.8 / 200.0))
    assert curve.derived_units()["sheath_angle_slope"][0] == "deg/mm"


@pytest.mark.parametrize(("k", "s"), [(1.5, 0.1), (-2.0, 0.4), (8.0, 0.97)])
def test_the_logistic_curve_that_is_reported_is_the_one_that_is_fitted(k, s):
    curve = LogisticCurve("sheath_angle", ROUTE)
    values = {name: jnp.asarray(value) for name, value in zip(curve.names, (-0.5, k, s), strict=True)}
    A, B, C = (float(x) for x in curve.derived(values).values())
    np.testing.assert_allclose(
        np.rad2deg(curve.wrap_angle(values, jnp.asarray(LENGTHS))), logistic(A, B, C), rtol=1e-12
    )


def test_a_logistic_curve_without_a_plateau_is_an_exponential():
    z = jnp.linspace(-1.0, 1.0, 9)
    computed = logistic_wrap_angle(z, jnp.asarray(0.2), jnp.asarray(1.3), jnp.asarray(0.0))
    np.testing.assert_allclose(computed, np.exp(0.2 + 1.3 * np.asarray(z)), rtol=1e-14)


@pytest.mark.parametrize("s", [0.0, 1e-12, 0.5, 1.0])
@pytest.mark.parametrize("k", [-30.0, 0.0, 30.0])
def test_derivatives_of_a_logistic_curve_are_finite_however_steep_it_is(k, s):
    slopes = jax.jacfwd(logistic_wrap_angle, argnums=(1, 2, 3))
    for z in (-1.0, 0.0, 1.0):
        assert np.all(np.isfinite(slopes(*(jnp.asarray(x) for x in (z, -0.5, k, s)))))


# Recovery ---------------------------------------------------------------------------------------------------------


def reported(solution: LeastSquares, names: tuple[str, ...]) -> list[float]:
    return [solution.estimates[f"sheath_angle_{name}"].value for name in names]


@pytest.mark.parametrize("truth", LINES.values(), ids=LINES)
def test_a_line_is_recovered_exactly_without_noise_and_within_its_errors_with_it(laboratory, truth):
    exact = laboratory.least_squares(read_off("line", line(*truth)))
    np.testing.assert_allclose(reported(exact, ("start", "end")), truth, rtol=1e-8)
    solution = laboratory.least_squares(read_off("line", line(*truth), scatter=2.0))
    for name, true in zip(("start", "end"), truth, strict=True):
        estimate = solution.estimates[f"sheath_angle_{name}"]
        assert abs(estimate.value - true) < 3 * estimate.standard_error < 4.0


@pytest.mark.parametrize("truth", LOGISTICS.values(), ids=LOGISTICS)
def test_a_logistic_curve_is_recovered_exactly_without_noise_and_within_its_errors_with_it(laboratory, truth):
    A, B, C = truth
    k, s = 100.0 / C, 1 / (1 + np.exp((B - 500.0) / C))
    true = {"a": np.log(np.deg2rad(A * s)), "k": k, "s": s}
    exact = laboratory.least_squares(read_off("logistic", logistic(*truth), least=0.0))
    np.testing.assert_allclose(reported(exact, tuple(true)), list(true.values()), rtol=1e-6, atol=1e-7)
    solution = laboratory.least_squares(read_off("logistic", logistic(*truth), scatter=2.0))
    for name, value in true.items():
        estimate = solution.estimates[f"sheath_angle_{name}"]
        assert abs(estimate.value - value) < 3 * estimate.standard_error < 1.5 * max(abs(value), 0.5)


@pytest.mark.extended
def test_a_line_is_recovered_where_half_of_its_angles_are_too_small_to_detect(laboratory):
    """Each of them says that the line lies below 30 deg there; taken as zeros they would bend it far down."""
    readings = read_off("line", line(56.0, 4.0), scatter=3.0, least=30.0)
    zeros = Dataset(
        described("line", tables={"angles": {"file": "angles.csv", "undetected": "zero"}}), readings.measurements, {}
    )
    assert np.isnan(readings.measurements.tables[0].angle).sum() > 15
    end, bent = (laboratory.least_squares(d).estimates["sheath_angle_end"] for d in (readings, zeros))
    assert abs(end.value - 4.0) < 3 * end.standard_error < 10.0
    assert bent.at_bound


@pytest.mark.extended
def test_a_line_that_ends_at_zero_is_at_its_bound_and_its_interval_is_short(laboratory):
    end = laboratory.least_squares(read_off("line", line(60.0, 0.0), scatter=1.0)).estimates["sheath_angle_end"]
    assert end.at_bound
    assert 0.0 < end.upper < 2.0


@pytest.mark.extended
def test_the_interval_of_a_plateau_that_angles_do_not_reach_follows_the_valley_of_the_minimum(on_body):
    """The printed angles of the squeezed sheath: with 5 % of the plateau reached the sum of squares is as good as at 0 %."""
    data = bf.read(on_body, settings=["contact.1.wrap_angle.curve=logistic"])
    share = bf.fit(data, mcmc=False, seed=1).least_squares.estimates["squeezed_sheath_angle_s"]
    assert share.at_bound
    assert 0.05 < share.upper < 0.15


# What results say -------------------------------------------------------------------------------------------------


QUICK = ("sampler.n_walkers=64", "sampler.target_ess=300", "sampler.target_r_hat=1.05", "sampler.max_steps=4000")


@pytest.fixture(scope="module")
def fits(tmp_path_factory) -> dict[str, bf.Fit]:
    """A bell-shaped route fitted by every family, sampled briefly, by --set alone."""
    folder = tmp_path_factory.mktemp("curves")
    (folder / "cable.toml").write_text(
        'name = "One sheath"\n[route]\nrange = [400, 600]\n[[contact]]\nname = "sheath"\nfriction = "mu"\n'
        'wrap_angle = { curve = "gaussian", column = "sheath_angle", departure = "none" }\n[tables]\n'
        'angles = { file = "angles.csv", detection_limit = { value = 10, unit = "deg" } }\n'
        'efficiencies = { file = "efficiencies.csv" }\n'
        "[sampler]\nn_walkers = 48\nmax_steps = 1200\ntarget_ess = 200\ntarget_r_hat = 1.05\n"
    )
    angle = SHAPES["gaussian"]
    rng = np.random.default_rng(2)
    readings = [
        f"{length:g},{a:.2f}" if a >= LIMIT else f"{length:g},<10"
        for length, a in zip(LENGTHS, angle + 2 * rng.standard_normal(41), strict=True)
    ]
    efficiency = np.exp(-0.12 * np.deg2rad(angle[::5]) + 0.003 * rng.standard_normal(9))
    rows = [f"{length:g},{e:.5f}" for length, e in zip(LENGTHS[::5], efficiency, strict=True)]
    (folder / "angles.csv").write_text("\n".join(["cable_length_mm,sheath_angle_deg", *readings]))
    (folder / "efficiencies.csv").write_text("\n".join(["cable_length_mm,efficiency", *rows]))
    description = (folder / "cable.toml").read_text()
    fits = {}
    for name in CURVES:
        departure = "" if name == "smooth" else ', departure = "none"'  # a smooth curve has no family to depart from
        angle = f'curve = "{name}", column = "sheath_angle"{departure} }}'
        (folder / "cable.toml").write_text(re.sub(r"curve = .*", angle, description, count=1))
        fits[name] = bf.fit(folder, settings=QUICK, seed=3, output=folder / name, figures=False)
    return fits


@pytest.mark.extended
@pytest.mark.parametrize(
    ("name", "heading", "rows"),
    [
        ("line", "Straight lines: angle in the middle of the range, and slope, median (90 % interval):", 2),
        pytest.param(
            "gaussian", "Gaussian curves A exp(-((l - B)/C)^2), median (90 % interval):", 3, marks=pytest.mark.slow
        ),
        pytest.param(
            "logistic", "Logistic curves A / (1 + exp(-(l - B)/C)), median (90 % interval):", 3, marks=pytest.mark.slow
        ),
    ],
)
def test_the_summary_heads_a_family_s_table_with_its_own_name(fits, name, heading, rows):
    lines = details_text(fits[name]).splitlines()
    index = lines.index(heading)
    assert all(line.startswith("  sheath_angle_") for line in lines[index + 1 : index + 1 + rows])
    assert sum("median (90 % interval):" in line for line in lines) == 1


@pytest.mark.extended
def test_comparing_the_families_finds_the_shape_of_the_route(fits):
    comparison = bf.compare(fits)
    assert comparison.best == "gaussian"
    assert comparison.verdict("line") == comparison.verdict("logistic") == "clear"
    assert comparison.verdict("smooth") != "clear", "it follows a bell as well"
    assert len(comparison.readings) == len(LENGTHS) + 9
    assert [comparison.descriptions[name].rpartition(", ")[2] for name in CURVES] == [f"{name} curves" for name in CURVES]
    assert "The data prefer gaussian over" in str(comparison)


@pytest.mark.extended
def test_the_curves_of_every_draw_have_the_shape_of_their_family(fits):
    for name, fit in fits.items():
        angle = fit.along_route.curves["sheath_angle"]
        assert np.all(angle > 0), name
        assert (np.max(np.abs(np.diff(angle, 2, axis=1))) < 1e-9) == (name == "line")
        rises = np.diff(angle, axis=1) > 0
        assert np.all(np.all(rises, axis=1) | np.all(~rises, axis=1)) == (name in ("line", "logistic"))


@pytest.mark.extended
def test_the_figure_of_wrap_angles_draws_the_curve_of_each_family(fits):
    readings = [shown.curves[0].angle for fit in fits.values() if (shown := data(fit)) is not None]
    assert len(readings) == len(CURVES)
    for fit in fits.values():
        axes, _ = draw(data(fit)).axes  # and the strip of residuals
        lines = {line.get_label(): line.get_ydata() for line in axes.lines}
        np.testing.assert_allclose(lines["Reading"], readings[0])
        assert axes.get_title() == "sheath"


def test_too_few_angles_are_counted_against_the_coefficients_of_the_family(tmp_path, run):
    (tmp_path / "cable.toml").write_text(
        'name = "One sheath"\n[route]\nrange = [400, 600]\n[[contact]]\nname = "sheath"\nfriction = "mu"\n'
        'wrap_angle = { curve = "line", column = "sheath_angle" }\n[tables]\nangles = { file = "angles.csv" }\n'
    )
    (tmp_path / "angles.csv").write_text("cable_length_mm,sheath_angle_deg\n410,20\n590,60\n")
    assert "coefficients and" not in run("check", tmp_path)[1]
    assert (
        "has three coefficients and 2 detected angles"
        in run("check", tmp_path, "--set", "contact.0.wrap_angle.curve=logistic")[1]
    )


def test_an_unknown_family_is_refused_with_the_known_ones(on_body):
    with pytest.raises(
        bf.DescriptionError, match="the curve 'parabola' is unknown; known here: gaussian, line, logistic, smooth"
    ):
        check(on_body, settings=["contact.0.wrap_angle.curve=parabola"])
