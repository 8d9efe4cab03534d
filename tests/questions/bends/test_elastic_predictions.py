"""Efficiency, friction felt, slack, position and stiffness of cables of known parameters, against plain NumPy and SciPy."""

import re
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import jax
import numpy as np
import pytest
from elastic_cables import CONSTANT, ELASTIC, TRUTH, bench, changed, elastic_cable
from scipy.integrate import quad
from scipy.optimize import brentq

from bowdenfit.description import Description
from bowdenfit.display import render_text
from bowdenfit.finished_fit import Fit
from bowdenfit.inference.least_squares import LeastSquares
from bowdenfit.questions.bends.words import describe_elastic
from bowdenfit.questions.check.data_set_words import describe_data_set
from bowdenfit.questions.error_budget import with_bench_errors
from bowdenfit.results.record import Draws, Provenance

BENDS = np.deg2rad([0.0, 30.0, 75.0, 120.0, 180.0, 270.0])
MU, DEGREE = TRUTH["mu"], np.deg2rad(1.0)
ROPE = (TRUTH["stiffness"], TRUTH["bedding_stretch"], TRUTH["bedding_load"])
LINEAR = {"bedding_stretch": {"fixed": 0.0}}
FEW = changed(
    ELASTIC, stretch={"loads": (1.0, 5.0, 20.0, 50.0), "wrap_angles": (0, 180)}, loop={"input_forces": (10.0, 60.0)}
)


def known_fit(description: Description, spread: float = 0.0, n: int = 1, **truth: float) -> Fit:
    """A fit that found the true values; with a spread, draws of a narrow posterior around them."""
    dataset, values = bench(description, TRUTH | truth, noise=False, design=FEW)
    nothing = LeastSquares({}, {}, {}, 1.0, 0.0, np.zeros(0), True, "")
    fit = Fit(dataset, nothing, None, True, (), Provenance(0, {}))
    z = np.asarray(fit.model.space.unconstrain(values))
    if not spread:
        return replace(fit, least_squares=replace(nothing, z=z))
    draws = z + spread * np.random.default_rng(5).standard_normal((1, n, len(z)))
    shown = [p.shown_scale * np.asarray(p.prior.constrain(draws[..., i])) for i, p in enumerate(fit.model.space.free)]
    named = {p.name: value for p, value in zip(fit.model.space.free, shown, strict=True)}
    return replace(fit, sampled=Draws(draws, named, {}, {}, {}, {}, {}, {}, 1, n, 0.3))


def extension(tension: Any, stiffness: float, bedding_stretch: float, bedding_load: float) -> Any:
    return tension / stiffness + bedding_stretch * (1 - np.exp(-np.asarray(tension) / bedding_load))


def tension(extended: float, rope: tuple[float, float, float]) -> float:
    """Tension that extends the rope so far [N]; 0 where it is slack."""
    if extended <= 0:
        return 0.0
    return float(brentq(lambda t: extension(t, *rope) - extended, 0.0, 1e6, xtol=1e-12, rtol=1e-14))


def extension_under(force: float, exponent: float, rope: tuple[float, float, float]) -> float:
    """Extension of a rope along which friction lets the tension fall from a force at its end [mm]."""
    return quad(lambda x: extension(force * np.exp(-exponent * x), *rope), 0.0, 1.0, epsabs=1e-13, epsrel=1e-12)[0]


def share(exponent: float) -> float:
    """Mean tension over the tension at the end that the rope slides toward."""
    return quad(lambda x: np.exp(-exponent * x), 0.0, 1.0, epsabs=1e-14, epsrel=1e-13)[0]


# What the capstan equation says is what remains without preload -----------------------------------------------------


@pytest.mark.extended
@pytest.mark.parametrize("kind", ["loop", "single"])
def test_without_preload_and_lengthening_every_prediction_is_that_of_the_capstan_equation(kind):
    """To machine precision: efficiency, forces both ways, friction, slack, and the stretch of the one side that pulls."""
    tables = ("stretch", "preload", "loop")[: 3 if kind == "loop" else 2]
    no_preload = {"model": "stretch", "value": {"value": 0, "unit": "N"}}
    elastic = known_fit(elastic_cable(tables, kind=kind, preload=no_preload, prior={"lengthening": {"fixed": 0.0}})).elastic
    loss = np.exp(-MU * BENDS)
    if kind == "loop":
        for force in (0.5, 100.0, 3000.0):
            np.testing.assert_allclose(elastic.efficiency(BENDS, force)[0], loss, rtol=1e-15)
        np.testing.assert_allclose(elastic.slack_load(BENDS)[0], 0.0, atol=0)
    np.testing.assert_allclose(elastic.output_force(BENDS, 40.0)[0], 40 * loss, rtol=1e-15)
    np.testing.assert_allclose(elastic.output_force(BENDS, 40.0, -1)[0], 40 / loss, rtol=1e-15)
    np.testing.assert_array_equal(elastic.friction(BENDS)[0], 0.0)
    for answer in elastic.preload(BENDS):
        np.testing.assert_array_equal(answer[0], 0.0)
    forward, back = (np.array([extension_under(40.0, s * MU * bend, ROPE) for bend in BENDS]) for s in (1, -1))
    error, lost = elastic.position(BENDS, 40.0)
    np.testing.assert_allclose(error[0], forward, rtol=1e-8)
    np.testing.assert_allclose(lost[0], back - forward, rtol=1e-7, atol=1e-13)
    window = elastic.preload_window((0.0, np.pi), friction=1.0)
    assert (window.lowest.median, window.best, window.felt.median, window.possible) == (0.0, 0.0, 0.0, 1.0)


# Losses of a preloaded loop ------------------------------------------------------------------------------------------


def test_under_a_small_load_a_loop_loses_twice_its_preload_times_the_exponent():
    elastic = known_fit(elastic_cable(preload=CONSTANT), preload=100.0).elastic
    for force in (0.0, 5.0, 60.0):
        output, friction = elastic.output_force(BENDS, force)[0], elastic.friction(BENDS)[0]
        np.testing.assert_allclose(force - output, 200 * MU * BENDS, rtol=1e-13, atol=1e-12)
        np.testing.assert_allclose(elastic.output_force(BENDS, force, -1)[0] - force, 200 * MU * BENDS, atol=1e-12)
        np.testing.assert_allclose(friction, 200 * MU * BENDS, rtol=1e-13)


def test_efficiency_falls_faster_with_the_wrap_angle_than_the_capstan_equation_where_bending_tightens_the_loop():
    """The loss of log efficiency per radian exceeds mu everywhere, more so the more the cable is bent."""
    bends = np.deg2rad(np.arange(75.0, 155.0, 5.0))
    follows = known_fit(elastic_cable(), preload=10.0).elastic
    constant = known_fit(elastic_cable(preload=CONSTANT), preload=10.0).elastic
    taut = 0.9 * follows.slack_load(bends)[0].min()
    assert taut > 10
    slopes = [-np.diff(np.log(e.efficiency(bends, taut)[0])) / np.diff(bends) for e in (follows, constant)]
    assert np.all(slopes[0] > 1.2 * MU)
    assert np.all(np.diff(slopes[0]) > 0)
    assert np.all(slopes[0][bends[:-1] >= np.pi / 2] > slopes[1][bends[:-1] >= np.pi / 2])
    preload = follows.preload(bends)[0][0]
    assert np.all(follows.efficiency(bends, taut)[0] < 1 - 2 * preload * MU * bends / taut)  # as the rope beds in
    small = 0.9 * constant.slack_load(bends)[0].min()
    np.testing.assert_allclose(constant.efficiency(bends, small)[0], 1 - 20 * MU * bends / small, rtol=1e-13)


@pytest.mark.extended
def test_answers_do_not_depend_on_the_setting_of_float_size_where_they_are_asked():
    """A notebook has JAX's own setting, 32 bits."""
    elastic = known_fit(elastic_cable()).elastic
    wide = elastic.efficiency(BENDS, 33.3)[0], elastic.preload_window((0.1, 2.9)).lowest.median
    with jax.enable_x64(False):
        narrow = elastic.efficiency(BENDS, 33.3)[0], elastic.preload_window((0.1, 2.9)).lowest.median
    np.testing.assert_array_equal(wide[0], narrow[0])
    assert wide[1] == narrow[1]


# Which preload -------------------------------------------------------------------------------------------------------

REFERENCE = np.pi / 2
FINE = np.arange(0.0, 60.0, 0.002)  # preloads at the reference angle that are tried [N]


def preloads(bends: np.ndarray, lengthening: float = TRUTH["lengthening"] / DEGREE) -> np.ndarray:
    """Preload at each bend (columns) of every reference preload that is tried (rows) [N]; negative where slack."""
    tensions = np.linspace(0.0, 600.0, 600_001)
    extended = extension(FINE[:, None], *ROPE) + lengthening * (bends - REFERENCE)
    return np.where(extended < 0, -1.0, np.interp(extended, extension(tensions, *ROPE), tensions))


def returning(preload: np.ndarray, bends: np.ndarray, force: float) -> np.ndarray:
    """How far the returning side stays extended where the pulling one passes all of the force [mm]; below 0 it is slack."""
    return 2 * extension(preload, *ROPE) - np.array([extension_under(force, MU * bend, ROPE) for bend in bends])


@pytest.mark.extended
@pytest.mark.parametrize("force", [0.0, 20.0, 60.0])
@pytest.mark.parametrize("ends", [(0.0, 180.0), (45.0, 135.0), (100.0, 200.0)])
def test_the_lowest_preload_is_the_smallest_of_all_tried_at_which_no_side_is_slack(ends, force):
    elastic, bends = known_fit(elastic_cable()).elastic, np.linspace(*np.deg2rad(ends), 25)
    there = preloads(bends)
    taut = np.all((there >= 0) & (returning(there, bends, force) >= 0), axis=1)
    first = np.argmax(taut)
    assert taut[first:].all()
    limit_preload = elastic.preload_window((bends[0], bends[-1]), force).lowest.median
    assert FINE[first] - 0.002 <= limit_preload <= FINE[first] + 1e-6


@pytest.mark.extended
@pytest.mark.parametrize("limit", [2.0, 5.0, 12.0])
def test_the_highest_preload_is_the_largest_of_all_tried_that_is_felt_as_no_more_than_the_limit(limit):
    elastic, bends = known_fit(elastic_cable()).elastic, np.linspace(0.3, 2.0, 25)
    felt = np.max(2 * np.maximum(preloads(bends), 0.0) * MU * bends, axis=1)
    last = np.flatnonzero(felt <= limit)[-1]
    limit_preload = elastic.preload_window((bends[0], bends[-1]), friction=limit).highest
    assert limit_preload is not None
    assert FINE[last] - 1e-6 <= limit_preload.median <= FINE[last] + 0.002


@pytest.mark.extended
def test_a_limit_that_no_preload_meets_is_said_to_be_impossible():
    """At the far bend bending alone tightens the slackest loop to more than may be felt."""
    bends = np.linspace(REFERENCE, 3.0, 25)
    felt = np.max(2 * preloads(bends) * MU * bends, axis=1)
    limit = 0.5 * float(felt[0])
    assert limit > 1
    window = known_fit(elastic_cable()).elastic.preload_window((bends[0], bends[-1]), friction=limit)
    assert window.possible == 0.0


@pytest.mark.extended
def test_a_load_does_not_slacken_a_rope_that_has_no_other_side():
    elastic = known_fit(elastic_cable(("stretch", "preload"), kind="single")).elastic
    lowest = [elastic.preload_window((0.0, np.pi), force).lowest.median for force in (0.0, 60.0)]
    assert lowest[0] == lowest[1] > 1


@pytest.mark.extended
@pytest.mark.parametrize(("force", "limit"), [(0.0, 8.0), (30.0, 18.0)])
def test_the_best_preload_keeps_the_cable_taut_in_95_of_100_draws(force, limit):
    fit = known_fit(elastic_cable(), spread=0.1, n=400)
    window = fit.elastic.preload_window((0.0, np.pi), force, friction=limit)
    bends, lowest, felt = np.linspace(0.0, np.pi, 25), [], []
    values = jax.jit(jax.vmap(fit.model.space.constrain))(with_bench_errors(fit).draws().flat_z)
    for draws in zip(*(np.asarray(value) for value in values.values()), strict=True):
        v = dict(zip(values, map(float, draws), strict=True))
        rope = (v["stiffness"], v["bedding_stretch"], v["bedding_load"])
        alone = np.array([extension_under(force, v["mu"] * bend, rope) for bend in bends])
        shift = v["lengthening"] * (bends - REFERENCE)
        lowest.append(max(tension(x, rope) for x in alone / 2 - shift))
        there = [tension(x, rope) for x in extension(window.best, *rope) + shift]
        felt.append(np.max(2 * v["mu"] * bends * there))
    assert np.mean(np.array(lowest) <= window.best) == pytest.approx(0.95, abs=1 / 400)
    assert window.lowest.median == pytest.approx(np.median(lowest), rel=1e-9)
    assert (window.lowest.q05, window.lowest.q95) == pytest.approx(np.quantile(lowest, [0.05, 0.95]), rel=1e-9)
    assert window.felt.median == pytest.approx(np.median(felt), rel=1e-9)
    assert window.highest is not None
    assert 0 < window.possible < 1
    assert (window.possible > 0.5) == (window.lowest.median < window.highest.median)


# Position and stiffness ----------------------------------------------------------------------------------------------


def displacement(force: float, exponent: float, preload: float | None, rope: tuple[float, float, float]) -> float:
    """How far the load end moves under a force against friction, motor locked [mm], by quadrature along the rope.

    A single rope is stretched from its load end; of a loop one side is stretched and the other one let go, each with the
    tension that friction leaves along it.
    """
    if preload is None:
        return float(extension_under(force, exponent, rope))
    at_rest = extension(preload, *rope)

    def end_force(extended: float, exponent: float) -> float:
        if extended <= 0:
            return 0.0
        return float(brentq(lambda f: extension_under(f, exponent, rope) - extended, 0.0, 1e5, xtol=1e-11, rtol=1e-13))

    def resisting(moved: float) -> float:
        return end_force(at_rest + moved, exponent) - end_force(at_rest - moved, -exponent)

    return float(brentq(lambda moved: resisting(moved) - force, -at_rest, 1e3, xtol=1e-13))


def numerical_stiffness(move: Callable[[float], float], force: float) -> float:
    step = 1e-3 * force
    return 2 * step / (move(force + step) - move(force - step))


@pytest.mark.parametrize("load", [1.0, 10.0, 60.0])
def test_the_stiffness_of_a_single_rope_is_the_slope_of_its_stretch(load):
    elastic = known_fit(elastic_cable(("stretch",), kind="single")).elastic
    expected = [numerical_stiffness(lambda f, x=MU * b: displacement(f, x, None, ROPE), load) for b in BENDS]
    np.testing.assert_allclose(elastic.stiffness(BENDS, load)[0], expected, rtol=1e-6)


@pytest.mark.parametrize(("load", "side"), [(5.0, "taut"), (15.0, "taut"), (40.0, "slack"), (80.0, "slack")])
def test_the_stiffness_of_a_loop_is_the_slope_of_its_displacement(load, side):
    """Of a linear rope; while the return side is taut, its two sides are about twice as stiff as one."""
    elastic = known_fit(elastic_cable(preload=CONSTANT, prior=LINEAR)).elastic
    rope = (ROPE[0], 0.0, 1.0)
    assert np.all((elastic.slack_load(BENDS)[0] > load) == (side == "taut"))
    expected = [numerical_stiffness(lambda f, x=MU * b: displacement(f, x, 10.0, rope), load) for b in BENDS]
    computed = elastic.stiffness(BENDS, load)[0]
    np.testing.assert_allclose(computed, expected, rtol=1e-6)
    assert computed[0] == pytest.approx(ROPE[0] * (2 if side == "taut" else 1))


@pytest.mark.parametrize("load", [2.0, 10.0, 60.0])
def test_the_stiffness_of_a_loop_that_beds_in_is_that_slope_within_two_percent(load):
    """Its sides' mean tensions do not quite add up to twice the preload, as the formula has it; see physics.loop."""
    elastic = known_fit(elastic_cable(preload=CONSTANT)).elastic
    expected = [numerical_stiffness(lambda f, x=MU * b: displacement(f, x, 10.0, ROPE), load) for b in BENDS]
    np.testing.assert_allclose(elastic.stiffness(BENDS, load)[0], expected, rtol=0.02)


@pytest.mark.parametrize("load", [0.0, 10.0, 60.0])
def test_the_position_error_of_a_loop_is_how_far_its_pulling_side_stretches(load):
    """The load side driving, forward and back; with backlash added, and never less than no lost motion."""
    settings = {"kind": "loop", "backlash": {"value": 50, "unit": "um"}}
    elastic = known_fit(elastic_cable(preload=CONSTANT, prior=LINEAR, cable=settings)).elastic
    rope = (ROPE[0], 0.0, 1.0)
    forward = np.array([displacement(load, MU * b, 10.0, rope) for b in BENDS])
    back = np.array([displacement(load, -MU * b, 10.0, rope) for b in BENDS])
    error, lost = elastic.position(BENDS, load)
    np.testing.assert_allclose(error[0], forward + 0.05, rtol=1e-9)
    np.testing.assert_allclose(lost[0], back - forward + 0.05, rtol=1e-9)
    assert np.all(lost[0] >= 0.05)
    assert np.all(np.diff(lost[0]) > 0)
    assert lost[0][0] == pytest.approx(0.05)


def test_the_position_error_of_a_preloaded_rope_counts_from_its_preload_and_its_slack():
    """One rope between fixed ends whose preload follows the stretch: slack where bent least, so that it must be taken up."""
    elastic = known_fit(elastic_cable(("stretch", "preload"), kind="single"), preload=8.0).elastic
    preload, slack = (answer[0] for answer in elastic.preload(BENDS))
    assert slack[0] > 0
    assert preload[-1] > 25
    np.testing.assert_allclose(elastic.friction(BENDS)[0], preload * MU * BENDS, rtol=1e-13)  # one side to drag
    error, lost = elastic.position(BENDS, 25.0)
    for i, bend in enumerate(BENDS):
        at_rest = extension(8.0, *ROPE) + TRUTH["lengthening"] / DEGREE * (bend - REFERENCE)
        pulled = max(25.0, tension(at_rest, ROPE))
        forward, back = (extension_under(pulled, s * MU * bend, ROPE) for s in (1, -1))
        assert error[0][i] == pytest.approx(forward - at_rest, rel=1e-8, abs=1e-12)
        assert lost[0][i] == pytest.approx(back - forward + max(-at_rest, 0.0), rel=1e-7, abs=1e-12)


def test_a_rope_of_which_only_the_preload_was_read_still_has_its_answers():
    """No table says with which friction it is stretched; then it is the one that it slides with."""
    elastic = known_fit(elastic_cable(("preload",), kind="single", stretch={})).elastic
    error, lost = elastic.position(BENDS, 25.0)
    assert np.all(np.isfinite(error))
    assert np.all(lost >= 0)
    assert np.all(elastic.stiffness(BENDS, 25.0) > 0)


# Sharp bends ---------------------------------------------------------------------------------------------------------


@pytest.mark.extended
@pytest.mark.parametrize(
    ("diameter", "radius", "sharp"),
    [
        ({"value": 1.5, "unit": "mm"}, {"value": 3, "unit": "cm"}, False),
        ({"value": 1.0, "unit": "mm"}, {"value": 0.02, "unit": "m"}, False),
        ({"value": 1.5, "unit": "mm"}, {"value": 29.9, "unit": "mm"}, True),
        ({"value": 2.0, "unit": "mm"}, {"value": 3, "unit": "cm"}, True),
    ],
)
def test_a_bend_below_twenty_rope_diameters_is_warned_of_in_check_and_summary(diameter, radius, sharp):
    """And none at twenty, which is what makers recommend."""
    sizes = {"kind": "single", "rope_diameter": diameter, "bend_radius": radius}
    fit = known_fit(elastic_cable(("stretch",), cable=sizes), spread=0.01, n=4)
    says = re.compile(r"bend radius is [\d.]+ rope diameters")
    assert bool(says.search(describe_data_set(fit.dataset))) == sharp
    assert bool(says.search(" ".join(render_text(describe_elastic(fit)).split()))) == sharp
