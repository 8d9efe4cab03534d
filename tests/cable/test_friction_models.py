"""Friction that depends on load and speed: its scale, its factor, the options, and held readings on such a scale."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from cables import cable
from scipy import stats

from bowdenfit.cable.conditions import Conditions
from bowdenfit.cable.friction import FrictionModel
from bowdenfit.cable.friction_options import friction_options
from bowdenfit.dataset import Dataset
from bowdenfit.errors import DescriptionError
from bowdenfit.kinds.forces.table import ForceTable
from bowdenfit.kinds.forces.term import HeldForcesTerm
from bowdenfit.kinds.rows import OwnAngles, RowOrigin
from bowdenfit.kinds.tables import Measurements
from bowdenfit.models import Model, build_model
from bowdenfit.physics.friction import force_from_scale, force_scale, force_scale_slope, play_operator, rate_factor
from bowdenfit.questions.simulate.bench import (
    BenchFriction,
    BenchSettings,
    LoadCellFaults,
    MotorProfile,
    simulate_recording,
)

REFERENCE = 50.0
FORCES = np.geomspace(0.5, 200.0, 60)
EXPONENTS = (0.0, 1e-12, 1e-8, 0.99e-6, 1.01e-6, 1e-5, 1e-3, 0.3, 1.0)  # on both sides of the switch of the series


@jax.jit
def _scale(force, p, drag):
    return force_scale(force, p, drag, REFERENCE)


@jax.jit
def _back(scaled, p, drag):
    return force_from_scale(scaled, p, drag, REFERENCE)


@jax.jit
def _slope(force, p, drag):
    return force_scale_slope(force, p, drag, REFERENCE)


# The scale --------------------------------------------------------------------------------------------------------


def test_without_load_exponent_and_drag_the_scale_is_the_logarithm():
    np.testing.assert_allclose(_scale(FORCES, 0.0, 0.0), np.log(FORCES / REFERENCE), rtol=1e-15, atol=1e-15)
    np.testing.assert_allclose(_scale(FORCES, 0.0, 3.0), np.log((FORCES + 3.0) / REFERENCE), rtol=1e-15, atol=1e-15)


def test_a_load_exponent_of_one_is_a_constant_friction_force():
    after = _back(_scale(FORCES[20:], 1.0, 0.0) - 0.01, 1.0, 0.0)
    np.testing.assert_allclose(FORCES[20:] - after, REFERENCE * 0.01, rtol=1e-10)


def test_friction_falls_with_the_load_as_the_exponent_says():
    """mu(F) = mu (F/F_ref)^-p: a short piece of wrap d takes F mu(F) d from the force."""
    p, d = 0.4, 1e-6
    lost = FORCES - _back(_scale(FORCES, p, 0.0) - d, p, 0.0)
    np.testing.assert_allclose(lost / d, FORCES * (FORCES / REFERENCE) ** -p, rtol=1e-5)


def test_with_drag_the_forces_plus_drag_keep_their_ratio():
    after = _back(_scale(FORCES, 0.0, 4.0) - 0.3, 0.0, 4.0)
    np.testing.assert_allclose((after + 4.0) / (FORCES + 4.0), np.exp(-0.3), rtol=1e-13)


@pytest.mark.parametrize("drag", [0.0, 3.0])
@pytest.mark.parametrize("p", EXPONENTS)
def test_the_scale_is_its_definition_and_its_inverse_leads_back(p, drag):
    log_u = np.log((FORCES + drag) / REFERENCE)
    expected = log_u * (1 + p * log_u / 2 + (p * log_u) ** 2 / 6) if p < 1e-4 else np.expm1(p * log_u) / p
    computed = _scale(FORCES, p, drag)
    np.testing.assert_allclose(computed, expected, rtol=0, atol=3e-11)
    np.testing.assert_allclose(_back(computed, p, drag), FORCES, rtol=1e-12)


def test_scale_and_inverse_run_on_through_the_switch_of_the_series():
    below, above = 1e-6 * (1 - 1e-12), 1e-6 * (1 + 1e-12)
    np.testing.assert_allclose(_scale(FORCES, below, 2.0), _scale(FORCES, above, 2.0), rtol=0, atol=2e-11)
    scaled = np.log((FORCES + 2.0) / REFERENCE)
    np.testing.assert_allclose(_back(scaled, below, 2.0), _back(scaled, above, 2.0), rtol=1e-9)


def test_the_derivative_by_the_load_exponent_runs_on_through_the_switch_of_the_series():
    below, above = jnp.asarray(1e-6 * (1 - 1e-9)), jnp.asarray(1e-6 * (1 + 1e-9))
    scaled = np.log((FORCES + 2.0) / REFERENCE)
    for function, points, tolerance in (
        (_scale, FORCES, 5e-5),
        (_back, scaled, 5e-4),
    ):  # what the series leaves out: p log(u)^3
        slope = jax.jit(jax.jacfwd(function, argnums=1))
        np.testing.assert_allclose(slope(points, below, 2.0), slope(points, above, 2.0), rtol=0, atol=tolerance)


@pytest.mark.parametrize("p", [0.0, 1e-3, 0.3, 1.0])
def test_the_slope_is_the_derivative_of_the_scale_by_the_force(p):
    h = 1e-5 * FORCES
    difference = (_scale(FORCES + h, p, 2.0) - _scale(FORCES - h, p, 2.0)) / (2 * h)
    np.testing.assert_allclose(_slope(FORCES, p, 2.0), difference, rtol=1e-7)


@pytest.mark.parametrize("function", [_scale, _back, _slope], ids=["scale", "inverse", "slope"])
def test_derivatives_at_a_load_exponent_of_exactly_zero_are_finite_and_right(function):
    """By the load exponent and the drag, at p = 0 and D = 0, where the sampler starts from in the limit."""
    points = np.linspace(-1.0, 1.0, 9) if function is _back else FORCES[10:]
    zero, h = jnp.asarray(0.0), 1e-4
    by_exponent, by_drag = jax.jit(jax.jacfwd(function, argnums=(1, 2)))(points, zero, zero)
    forward = (-3 * function(points, 0.0, 0.0) + 4 * function(points, h, 0.0) - function(points, 2 * h, 0.0)) / (2 * h)
    np.testing.assert_allclose(by_exponent, forward, rtol=1e-5, atol=1e-6)
    difference = (function(points, 0.0, h) - function(points, 0.0, -h)) / (2 * h)
    np.testing.assert_allclose(by_drag, difference, rtol=1e-6, atol=1e-6)
    reverse = jax.jit(jax.grad(lambda p, drag: function(points, p, drag).sum(), argnums=(0, 1)))(zero, zero)
    np.testing.assert_allclose(reverse, [by_exponent.sum(), by_drag.sum()], rtol=1e-10)


def test_where_friction_would_hold_more_than_the_force_next_to_nothing_is_left():
    left = _back(jnp.asarray([-3.0, -30.0]), 0.5, 2.0)
    np.testing.assert_allclose(left, -2.0, atol=1e-6)
    assert np.all(np.isfinite(jax.jacfwd(_back, argnums=1)(jnp.asarray([-3.0, -30.0]), jnp.asarray(0.5), 2.0)))


# The factor -------------------------------------------------------------------------------------------------------


def test_the_rate_factor_is_as_computed_by_hand_and_alike_both_ways():
    speed = np.array([0.0, 10.0, -10.0, 100.0])
    expected = [1.3, 1 + 0.3 / np.e + 0.02, 1 + 0.3 / np.e + 0.02, 1 + 0.3 * np.exp(-100.0) + 0.2]
    computed = jax.jit(rate_factor)(speed, 0.3, 10.0, 0.002)
    np.testing.assert_allclose(computed, expected, rtol=1e-14)
    by_speed = jax.jit(jax.grad(lambda v: rate_factor(v, jnp.asarray(0.3), jnp.asarray(10.0), jnp.asarray(0.002))))
    assert float(by_speed(jnp.asarray(10.0))) == pytest.approx(-0.3 * 2 / 10 / np.e + 0.002, rel=1e-12)


# Against the simulated bench --------------------------------------------------------------------------------------

LAMBDA = 0.25
LAWS = {
    "capstan": ((), {}, BenchFriction()),
    "drag": (("drag",), {"drag": 4.0}, BenchFriction(drag=4.0)),
    "load exponent": (("load-dependent",), {"load_exponent": 0.4}, BenchFriction(load_exponent=0.4)),
    "rate": (
        ("rate-dependent",),
        {"stribeck": 0.3, "stribeck_speed": 15.0, "viscous": 0.002},
        BenchFriction(stribeck=0.3, stribeck_speed=15.0, viscous=0.002),
    ),
    "all of them": (
        ("drag", "load-dependent", "rate-dependent"),
        {"drag": 2.0, "load_exponent": 0.3, "stribeck": 0.2, "stribeck_speed": 15.0, "viscous": -0.002},
        BenchFriction(0.3, REFERENCE, 2.0, 0.2, 15.0, -0.002),
    ),
}
PROFILE = MotorProfile(speed=2.0, lead_in=0.5, cycles=1, partial_reversals=((30.0, 12.0),))


def _law(name):
    """The friction model, its parameters, and a recording without any fault that obeys the same law."""
    options, values, friction = LAWS[name]
    model = FrictionModel(options, Conditions(REFERENCE, 20.0, (1.0, 40.0), "mm/s"))
    named = {key: jnp.asarray(value) for key, value in values.items()}
    bench = BenchSettings(rate=500.0)
    return model, named, simulate_recording(LAMBDA, friction, PROFILE, bench, LoadCellFaults(), np.random.default_rng(0))


@pytest.mark.parametrize("name", LAWS)
def test_sliding_samples_of_the_simulated_bench_obey_the_model(name):
    model, values, recording = _law(name)
    sliding = recording.stroke != 0
    force_in, stroke, speed = (getattr(recording, n)[sliding] for n in ("input_force", "stroke", "velocity"))

    @jax.jit
    def predicted(values):
        of_rate = [values[name] for name in ("stribeck", "stribeck_speed", "viscous") if name in values]
        at_reference = LAMBDA * (rate_factor(jnp.asarray(20.0), *of_rate) if of_rate else 1.0)
        exponent = at_reference * model.rate(values, jnp.asarray(speed))
        return model.output_force(values, jnp.asarray(force_in), exponent, jnp.asarray(stroke))

    assert {1, -1} == set(stroke)
    np.testing.assert_allclose(predicted(values), recording.output_force[sliding], rtol=1e-10)


@pytest.mark.parametrize("name", ["capstan", "drag", "load exponent"])
def test_all_samples_of_the_simulated_bench_follow_the_play_operator_on_the_model_s_scale(name):
    """Turns between two samples are missed by the operator: 12 mm/s^2 for 2 ms, some 1e-4 of the force."""
    model, values, recording = _law(name)

    @jax.jit
    def predicted(values):
        x = model.scaled(values, jnp.asarray(recording.input_force))
        start = model.scaled(values, jnp.asarray(recording.output_force[0]))
        return model.force(values, play_operator(x - LAMBDA, x + LAMBDA, start)[0])

    np.testing.assert_allclose(predicted(values), recording.output_force, rtol=2e-4)


# Options ----------------------------------------------------------------------------------------------------------


def test_capstan_adds_nothing_and_options_add_up():
    assert friction_options("capstan") == ()
    assert (
        friction_options("drag") == friction_options("capstan+drag") == friction_options(" capstan + drag") == ("drag",)
    )
    assert friction_options("drag+rate-dependent") == ("drag", "rate-dependent")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("drga", ["'drga'", "did you mean 'drag'?"]),
        ("capstan+load_dependent", ["'load_dependent'", "did you mean 'load-dependent'?"]),
        ("xyz", ["'xyz'", "known here: capstan, drag, load-dependent, rate-dependent, stroke-dependent, play, dahl, lugre,"]),
        ("drag+", ["''", "known here"]),
        ("drag+rate-dependent+drag", ["'drag+rate-dependent+drag'", "'drag' twice"]),
    ],
)
def test_an_unknown_or_doubled_option_is_refused_in_a_sentence(text, words):
    with pytest.raises(DescriptionError) as refusal:
        friction_options(text)
    assert all(word in str(refusal.value) for word in words)
    with pytest.raises(DescriptionError):
        _model(HELD, friction_model=text)


def _table(rows, velocity=float("nan"), unit="") -> ForceTable:
    """Rows (stroke, input force, output force), each a run of its own."""
    stroke, force_in, force_out = (np.array(column) for column in zip(*rows, strict=True))
    n = len(rows)
    origin = RowOrigin(("forces.csv",), np.zeros(n, dtype=int), np.arange(2, n + 2))
    own_angles = OwnAngles((), np.zeros((n, 0)), np.zeros((n, 0)))
    run, names = np.arange(n), tuple(str(i) for i in range(n))
    nowhere, speeds = np.full(n, np.nan), np.full(n, velocity)
    return ForceTable(nowhere, force_in * 1.0, force_out * 1.0, run, names, stroke, own_angles, origin, speeds, unit)


def _model(rows, velocity=float("nan"), unit="", **more) -> Model:
    contact = {"name": "sheath", "friction": "mu", "wrap_angle": {"value": 150, "unit": "deg"}}
    description = cable(1, ("forces",), contact=[contact], **more).model_copy(update={"route": None})
    return build_model(Dataset(description, Measurements((_table(rows, velocity, unit),)), {}))


HELD = [(0, 50.0, 50.0), (0, 50.0, 40.0), (0, 40.0, 50.0), (0, 50.0, 33.0), (0, 8.0, 4.0), (0, 90.0, 20.0)]


def test_rate_dependence_without_any_velocity_is_refused_in_a_sentence():
    with pytest.raises(DescriptionError, match="no force table or recording has a velocity; map a velocity channel"):
        _model([(1, 50.0, 40.0)], friction_model="rate-dependent")
    with pytest.raises(DescriptionError, match="has a velocity"):
        _model([(1, 50.0, 40.0)], velocity=0.0, unit="mm/s", friction_model="rate-dependent")


def test_each_option_adds_its_parameters_with_the_reference_in_words():
    rows = [(1, 30.0, 20.0), (-1, 20.0, 30.0)]
    model = _model(rows, 20.0, "mm/s", friction_model="drag+load-dependent+rate-dependent")
    names = {p.name: p for p in model.space.parameters if p.role == "friction_model"}
    assert set(names) == {"drag", "load_exponent", "stribeck", "stribeck_speed", "viscous"}
    assert model.cable.friction.conditions == Conditions(
        24.0, 20.0, (20.0, 20.0), "mm/s", median_load=25.0
    )  # sqrt(600) to two digits
    assert "24 N" in names["load_exponent"].meaning
    assert names["viscous"].prior_text == "Uniform(-0.025, 0.025)"
    assert not [p for p in _model(rows).space.parameters if p.role == "friction_model"]


def test_stated_reference_force_and_velocity_come_before_the_data_s():
    settings = {"reference_force": {"value": 60, "unit": "N"}, "reference_velocity": {"value": 30, "unit": "r/min"}}
    model = _model([(1, 30.0, 20.0)], 2.0, "rad/s", friction_model="drag+rate-dependent", **settings)
    conditions = model.cable.friction.conditions
    assert conditions.reference_force == 60.0 and conditions.reference_speed == pytest.approx(np.pi)
    values = {"drag": 5.0, "stribeck": 0.2, "stribeck_speed": 1.0, "viscous": 0.01}
    expected = (65.0 * np.exp(-0.4) - 5.0) / 60.0  # at the reference speed the exponent is as stated
    efficiency = jax.jit(model.cable.friction.efficiency)
    efficiencies = efficiency({k: jnp.asarray(v) for k, v in values.items()}, jnp.asarray(0.4))
    assert float(efficiencies) == pytest.approx(expected, rel=1e-12)


# Held readings ----------------------------------------------------------------------------------------------------

THETA = np.deg2rad(150)
VALUES = {"mu": 0.15, "tau": 0.03, "sigma_F": 0.7}
MORE = {"drag": 3.0, "input_offset": 0.8, "output_offset": -0.5, "gain_error": 0.012}
SENSORS = {"input_gain_error_sd": 0, "output_gain_error_sd": 0.01, "offset_sd": {"value": 1, "unit": "N"}}


def _held(values, case="log_likelihood", rows=HELD, extra=()):
    model = _model(rows, friction_model="drag", sensors=SENSORS)
    (term,) = model.terms
    assert isinstance(term, HeldForcesTerm)
    return np.asarray(jax.jit(getattr(term, case))({k: jnp.asarray(v) for k, v in values.items()}, term.data, *extra))


def _held_by_hand(values, rows=HELD):
    """Where each reading lies in the band, and its sd, on the scale log(F + D)."""
    _, force_in, force_out = (np.array(column) for column in zip(*rows, strict=True))
    u_in = force_in - values["input_offset"] + values["drag"]
    u_out = (force_out - values["output_offset"]) * np.exp(values["gain_error"]) + values["drag"]
    return np.log(u_in / u_out), np.sqrt(values["tau"] ** 2 + values["sigma_F"] ** 2 * (1 / u_in**2 + 1 / u_out**2))


def test_a_held_reading_has_the_probability_of_the_band_on_the_scale_of_drag_behind_the_load_cells_errors():
    values = VALUES | MORE
    place, sd = _held_by_hand(values)
    limit, side = values["mu"] * THETA, np.where(place > 0, -1.0, 1.0)
    band = stats.norm.cdf((side * place + limit) / sd) - stats.norm.cdf((side * place - limit) / sd)
    np.testing.assert_allclose(_held(values), np.log(band), rtol=1e-9, atol=1e-12)


def test_a_held_reading_is_certain_inside_the_band_a_coin_toss_at_its_edge_and_unlikely_beyond():
    values = VALUES | MORE | {"tau": 0.01, "sigma_F": 0.1}
    limit = values["mu"] * THETA
    points = np.array([0.0, 0.8, -0.8, 1.0, -1.0, 1.2, -1.2]) * limit
    u_in = 50.0 - values["input_offset"] + values["drag"]
    force_out = (u_in * np.exp(-points) - values["drag"]) * np.exp(-values["gain_error"]) + values["output_offset"]
    computed = np.exp(_held(values, rows=[(0, 50.0, f) for f in force_out]))
    np.testing.assert_allclose(computed[:3], 1.0, atol=1e-6)
    np.testing.assert_allclose(computed[3:5], 0.5, atol=1e-3)
    assert np.all(computed[5:] < 1e-6)


def test_readings_simulated_inside_the_band_are_inside_it_for_the_likelihood():
    """With hardly any noise every simulated reading is certain, whatever drag, offsets and gain error."""
    values = VALUES | MORE | {"tau": 1e-6, "sigma_F": 1e-6}
    rows = [(0, force, force) for force in np.linspace(5.0, 90.0, 40)]
    _, force_in, _ = (np.array(column) for column in zip(*rows, strict=True))
    ratio = _held(values, "simulate", rows, (jax.random.key(1),))
    place, _ = _held_by_hand(values, [(0, f, f / r) for f, r in zip(force_in, ratio, strict=True)])
    assert np.all(np.abs(place) <= values["mu"] * THETA + 1e-4)
    assert np.abs(place).max() > 0.9 * values["mu"] * THETA


@pytest.mark.parametrize("option", ["drag", "load-dependent"])
def test_a_dependence_on_load_is_refused_where_no_load_was_measured(option, on_body):
    import bowdenfit as bf
    from bowdenfit.models import build_model

    with pytest.raises(DescriptionError, match=f"{option}.*efficiencies alone say nothing about it"):
        build_model(bf.read(on_body, friction=option))
