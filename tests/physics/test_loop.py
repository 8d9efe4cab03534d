"""The preloaded loop: against a numerical solution of both its sides, at its corners, and through any motion."""

from functools import cache

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from bowdenfit.inference.compilation import compile_program
from bowdenfit.physics.friction import capstan_output_force, play_operator
from bowdenfit.physics.loop import (
    free_motion_loss,
    loop_band,
    loop_input_force,
    loop_output_force,
    moving_preload,
    side_tensions,
    slack_load,
)

PRELOADS = (1.0, 7.0, 30.0, 100.0)
EXPONENTS = (0.01, 0.1, 0.5, 1.2, 3.0)
LOADS = (0.1, 1.0, 5.0, 20.0, 80.0, 500.0)
FORWARD = jnp.asarray(1.0)
CLOSE = 1e-10  # relative to the larger force

output_force = jax.jit(loop_output_force)
sides = jax.jit(side_tensions)
slack_at = jax.jit(slack_load)
band = jax.jit(loop_band)
gradient = jax.jit(jax.grad(loop_output_force, argnums=(0, 1, 2)))


@jax.jit
def through(force, preload, exponent, start):
    """Output force of a loop through any motion."""
    return play_operator(*loop_band(force, preload, exponent), start)[0]


def _both_strokes_and_signs():
    """Every combination of input force of either sign, preload, exponent and stroke, one flat array each."""
    axes = (*LOADS, *(-f for f in LOADS)), PRELOADS, EXPONENTS, (1.0, -1.0)
    return [a.ravel() for a in np.meshgrid(*axes, indexing="ij")]


@cache
def _profile(exponent):
    """Tension at the far end and integral of tension along a side, for a tension of 1 at the near end, by integration.

    The tension obeys dT/ds = exponent T, and so is proportional to the tension at the near end.
    """
    run = solve_ivp(
        lambda _, y: [exponent * y[0], y[0]], (0.0, 1.0), [1.0, 0.0], method="DOP853", rtol=1e-12, atol=1e-14
    )
    return run.y[:, -1]


def _solved(input_force, preload, exponent, stroke):
    """Output force and integrals of tension of both sides, from the tensions that make the loop as long as it is.

    Tension falls along a side in the direction away from the end that the rope slides toward. A side cannot push: where
    the loop would have the tension of a side below 0, that side hangs slack and the other carries the input alone.
    """
    pulling, returning = _profile(-stroke * exponent), _profile(stroke * exponent)  # both from the motor on

    def tensions(lower):
        """Both tensions at the motor, where the lower one is so much."""
        return max(input_force, 0.0) + lower, max(-input_force, 0.0) + lower

    def too_long(lower):
        first, other = tensions(lower)
        return first * pulling[1] + other * returning[1] - 2 * preload

    low, other = tensions(brentq(too_long, 0.0, 2 * preload / pulling[1], xtol=1e-14) if too_long(0.0) < 0 else 0.0)
    return low * pulling[0] - other * returning[0], low * pulling[1], other * returning[1]


def _taut_return(input_force, preload, exponent, stroke):
    """Tension of the return side at the motor, below 0 where only a rope that can push would close the loop."""
    pulling, returning = _profile(-stroke * exponent), _profile(stroke * exponent)
    return (2 * preload - input_force * pulling[1]) / (pulling[1] + returning[1])


# Steady motion ----------------------------------------------------------------------------------------------------


def test_the_output_force_is_that_of_the_loop_solved_numerically():
    rows = _both_strokes_and_signs()
    solved = np.array([_solved(*row) for row in zip(*rows, strict=True)])
    formula = np.asarray(output_force(*rows))
    scale = np.maximum(np.abs(rows[0]), np.abs(solved[:, 0]))
    np.testing.assert_array_less(np.abs(formula - solved[:, 0]), CLOSE * scale)
    slack = np.minimum(solved[:, 1], solved[:, 2]) == 0.0
    assert slack.sum() > 100 and (~slack).sum() > 100  # both branches were met


def test_the_mean_tensions_of_both_sides_are_those_of_the_loop_solved_numerically():
    force, preload, exponent, stroke = _both_strokes_and_signs()
    rows = [v[force > 0] for v in (force, preload, exponent, stroke)]
    solved = np.array([_solved(*row) for row in zip(*rows, strict=True)])
    pulling, returning = (np.asarray(v) for v in sides(*rows))
    np.testing.assert_allclose(pulling, solved[:, 1], rtol=CLOSE)
    np.testing.assert_allclose(returning, solved[:, 2], rtol=CLOSE, atol=CLOSE * rows[1].min())
    np.testing.assert_array_equal(returning == 0.0, solved[:, 2] == 0.0)


@pytest.mark.parametrize("stroke", [1.0, -1.0])
def test_both_sides_share_twice_the_preload_until_one_is_slack(stroke):
    force = np.linspace(0.0, 60.0, 200)
    pulling, returning = (
        np.asarray(v) for v in sides(force, np.full(200, 12.0), np.full(200, 0.8), np.full(200, stroke))
    )
    taut = returning > 0
    assert 20 < taut.sum() < 180
    np.testing.assert_allclose((pulling + returning)[taut], 24.0, rtol=1e-14)
    assert np.all((pulling + returning)[~taut] >= 24.0)
    assert np.all(np.diff(pulling) > 0) and np.all(np.diff(returning) <= 0)
    assert np.max(np.abs(np.diff(pulling))) < 1.0 and np.max(np.abs(np.diff(returning))) < 1.0  # neither jumps


def test_without_friction_the_sides_differ_by_the_load():
    pulling, returning = sides(np.asarray(8.0), np.asarray(12.0), np.asarray(0.0), np.asarray(1.0))
    assert (float(pulling), float(returning)) == (16.0, 8.0)
    assert output_force(np.asarray(8.0), 12.0, 0.0, 1.0) == 8.0


@pytest.mark.parametrize("stroke", [1.0, -1.0])
def test_exchanging_both_ends_and_sides_leaves_the_loop_as_it_is(stroke):
    force, preload, exponent, _ = _both_strokes_and_signs()
    there = np.asarray(output_force(force, preload, exponent, np.full(force.shape, stroke)))
    np.testing.assert_array_equal(
        output_force(-force, preload, exponent, np.full(force.shape, -stroke)), -there
    )  # sides
    back = output_force(there, preload, exponent, np.full(force.shape, -stroke))  # what was put in comes out
    np.testing.assert_allclose(back, force, rtol=1e-12, atol=1e-12 * np.max(np.abs(there)))


@pytest.mark.parametrize("exponent", EXPONENTS)
@pytest.mark.parametrize("preload", PRELOADS)
def test_the_branches_meet_where_the_return_side_goes_slack(preload, exponent):
    for stroke in (1.0, -1.0):
        slack_force = float(slack_at(preload, stroke * exponent))
        expected = 2 * preload * exponent / (stroke * -np.expm1(-stroke * exponent))
        np.testing.assert_allclose(slack_force, expected, rtol=1e-13)
        below, middle, above = (
            float(output_force(slack_force * (1 + by), preload, exponent, stroke)) for by in (-1e-9, 0.0, 1e-9)
        )
        slope = max(1.0, np.exp(-stroke * exponent))  # the larger one of both branches
        np.testing.assert_allclose([below, above], middle, rtol=0, atol=1.001e-9 * slope * slack_force)
        np.testing.assert_allclose(middle, slack_force - stroke * 2 * preload * exponent, rtol=1e-12)
        np.testing.assert_allclose(middle, slack_force * np.exp(-stroke * exponent), rtol=1e-12)
        loose = [float(sides(*map(np.asarray, (slack_force * by, preload, exponent, stroke)))[1]) for by in (0.999, 1.001)]
        assert loose[0] > 0.0 == loose[1]
        root = brentq(
            lambda f, s=stroke: _taut_return(f, preload, exponent, s), 0.01 * slack_force, 10 * slack_force, xtol=1e-13
        )
        np.testing.assert_allclose(slack_force, root, rtol=CLOSE)


def test_a_loop_without_preload_is_a_single_cable():
    force, _, exponent, stroke = _both_strokes_and_signs()
    rows = [jnp.asarray(v[force > 0]) for v in (force, exponent, stroke)]
    alone = capstan_output_force(*rows)
    np.testing.assert_array_equal(loop_output_force(rows[0], jnp.zeros_like(rows[0]), *rows[1:]), alone)


@pytest.mark.parametrize("stroke", [1.0, -1.0])
def test_under_a_large_preload_the_loss_is_the_same_at_every_load(stroke):
    for force in (0.0, 0.3, -0.3, 5.0, -5.0):
        # A product and a difference in one rounding, as processors do them, differ by the last bit.
        assert output_force(force, 100.0, 0.4, stroke) == pytest.approx(force - stroke * 80.0, rel=1e-15)


@pytest.mark.parametrize("exponent", EXPONENTS)
def test_the_loss_of_free_motion_is_the_input_that_leaves_no_output(exponent):
    for preload in PRELOADS:
        loss = float(free_motion_loss(*map(jnp.asarray, (preload, exponent))))
        solved = brentq(lambda f, p=preload: _solved(f, p, exponent, 1.0)[0], 0.0, 10 * loss, xtol=1e-12, rtol=1e-13)
        np.testing.assert_allclose(loss, solved, rtol=CLOSE)
        assert output_force(loss, preload, exponent, 1.0) == pytest.approx(0.0, abs=1e-15 * loss)
        assert loss < slack_at(preload, exponent)  # so the loop is still taut


@settings(max_examples=60, deadline=None, derandomize=True)
@given(st.floats(-500, 500), st.floats(0, 100), st.floats(0, 3))
def test_motion_forward_and_back_leave_a_band_around_the_input(force, preload, exponent):
    lower, upper = (float(v) for v in band(force, preload, exponent))
    assert lower <= force <= upper
    assert upper - lower >= 4 * preload * exponent - 1e-12 * (abs(force) + preload)
    np.testing.assert_allclose(output_force(force, preload, exponent, 1.0), lower, rtol=1e-14)
    np.testing.assert_allclose(output_force(force, preload, exponent, -1.0), upper, rtol=1e-14)


@pytest.mark.parametrize("force", [-30.0, -1.0, 0.0, 1.0, 30.0])
@pytest.mark.parametrize("preload", [0.0, 10.0])
@pytest.mark.parametrize("exponent", [0.0, 0.4])
def test_the_output_force_has_a_finite_gradient_at_every_corner(force, preload, exponent):
    for stroke in (1.0, -1.0):
        assert np.all(np.isfinite(gradient(force, preload, exponent, stroke)))


# Any motion -------------------------------------------------------------------------------------------------------


def _plainly(force, preload, exponent, start):
    """The play of the loop as one would write it on paper."""
    y, rows = float(start), []
    for f, p, x in zip(
        force, np.broadcast_to(preload, force.shape), np.broadcast_to(exponent, force.shape), strict=True
    ):
        forward = min(f - 2 * p * x, f * np.exp(-x), f * np.exp(x))
        back = max(f + 2 * p * x, f * np.exp(-x), f * np.exp(x))
        if y < forward:
            y = forward
        elif y > back:
            y = back
        rows.append(y)
    return np.array(rows)


def _reversals(seed, size=400):
    """A random walk through zero, with partial reversals nested in one another on top."""
    generator = np.random.default_rng(seed)
    walk = np.cumsum(generator.standard_normal(size)) * 3.0
    turns = np.repeat(np.array([30.0, -30.0, 20.0, -12.0, 8.0, -4.0, 2.0, -1.0, 25.0, -28.0]), size // 10)
    return walk - walk.mean() + turns


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("varying", [False, True], ids=["constant", "changing with time"])
def test_any_motion_is_a_plain_loop(seed, varying):
    force = _reversals(seed)
    generator = np.random.default_rng(10 + seed)
    change = np.exp(0.2 * generator.standard_normal((2, force.size))) if varying else np.ones(2)
    preload, exponent = 4.0 * change[0], 0.35 * change[1]
    computed = np.asarray(through(force, preload, exponent, np.asarray(200.0)))
    np.testing.assert_allclose(computed, _plainly(force, preload, exponent, 200.0), rtol=1e-12, atol=1e-12)
    assert force.min() < -8.0 and force.max() > 8.0
    stands = np.diff(computed) == 0.0
    assert 10 < stands.sum() < 390 or varying  # it stood still in places and moved in others


def test_loops_side_by_side_do_not_touch_each_other():
    force = np.stack([_reversals(seed) for seed in (5, 6, 7)], axis=1)
    preload, exponent, start = np.array([0.0, 3.0, 9.0]), np.array([0.5, 0.3, 0.1]), np.array([0.0, 50.0, -50.0])
    computed = np.asarray(through(force, preload, exponent, start))
    for i in range(3):
        expected = _plainly(force[:, i], preload[i], exponent[i], start[i])
        np.testing.assert_allclose(computed[:, i], expected, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("stroke", [1.0, -1.0])
def test_steady_motion_is_the_formula_for_steady_motion(stroke):
    force = stroke * np.linspace(-70.0, 70.0, 141)  # through both slack branches and the taut one between
    steady = np.asarray(output_force(force, 6.0, 0.5, stroke))
    np.testing.assert_array_equal(through(force, 6.0, 0.5, -stroke * 1e4), steady)  # from beyond the band
    turned = np.asarray(through(force, 6.0, 0.5, stroke * 1e4))  # just turned: it still stands where it stopped
    assert turned[0] == output_force(force[0], 6.0, 0.5, -stroke)
    moves = stroke * steady >= stroke * turned[0]
    np.testing.assert_array_equal(turned[moves], steady[moves])
    np.testing.assert_array_equal(turned[~moves], turned[0])
    assert 10 < moves.sum() < 140


def test_without_preload_any_motion_is_the_play_of_a_single_cable_on_the_log_of_force():
    force = 20.0 * np.exp(_reversals(8) / 40.0)
    single = jnp.exp(play_operator(jnp.log(force) - 0.35, jnp.log(force) + 0.35, jnp.log(20.0))[0])
    np.testing.assert_allclose(through(force, 0.0, 0.35, 20.0), single, rtol=1e-12)
    assert np.ptp(np.log(force)) > 4 * 0.35


def test_a_loop_that_turns_inside_its_band_holds_the_output_force():
    force = np.r_[np.arange(0.0, 15.0), np.arange(13.0, 1.0, -1), np.arange(1.0, -15.0, -1), np.arange(-13.0, -2.0)]
    computed = np.asarray(through(force, 6.0, 0.5, 0.0))
    np.testing.assert_array_equal(computed[14:27], 8.0)  # from 14 N, less 2 P Lambda, down to 2 N
    np.testing.assert_array_equal(computed[27:43], force[27:43] + 6.0)
    np.testing.assert_array_equal(computed[42:], -8.0)


# A rope that beds in ------------------------------------------------------------------------------------------------


NODES, WEIGHTS = np.polynomial.legendre.leggauss(60)


def _extended_along(mean, exponent, rope):
    """Extension averaged along a rope by 60 places, where the program takes 4; linear below 0."""
    places = (NODES[:, None] + 1) / 2
    shares = np.exp(-exponent * places) / (-np.expm1(-exponent) / exponent)
    tension = mean * shares
    bedded = np.where(tension > 0, rope[1] * -np.expm1(-np.maximum(tension, 0) / rope[2]), tension * rope[1] / rope[2])
    return WEIGHTS / 2 @ (tension / rope[0] + bedded)


def _random_loops(n, seed=3, most=1.0):
    """Loops from far stiffer to far softer at low load than the preload, and forces past where a side goes slack."""
    draw = np.random.default_rng(seed)
    preload, exponent = (np.exp(draw.uniform(*limits, n)) for limits in ((-1, 5), (-4, most)))
    rope = np.exp(draw.uniform(1, 6, n)), np.exp(draw.uniform(-4, 1.5, n)), np.exp(draw.uniform(0, 4, n))
    along = draw.uniform(-1.5, 1.5, n) * 2 * preload * exponent / -np.expm1(-exponent)
    return jax.tree.map(jnp.asarray, (along, preload, exponent, rope))


def _bedded(input_force, preload, exponent, stroke, rope):
    """Output force from the tensions that make the loop as long as it was at rest; 0 for those that would push."""
    pulling, returning = _profile(-stroke * exponent), _profile(stroke * exponent)

    def extended(tension):
        return float(_extended_along(tension, exponent, rope)[0])

    def tensions(lower):
        return max(input_force, 0.0) + lower, max(-input_force, 0.0) + lower

    def too_long(lower):
        first, other = tensions(lower)
        at_rest = preload / rope[0] - rope[1] * np.expm1(-preload / rope[2])
        return extended(first * pulling[1]) + extended(other * returning[1]) - 2 * at_rest

    low, other = tensions(brentq(too_long, 0.0, 1e4 * preload, xtol=1e-13) if too_long(0.0) < 0 else 0.0)
    return low * pulling[0] - other * returning[0]


@pytest.mark.parametrize("stroke", [1.0, -1.0])
def test_a_loop_whose_rope_beds_in_is_the_loop_solved_numerically(stroke):
    along, preload, exponent, rope = _random_loops(60, most=0.4)
    loops = zip(*map(np.asarray, (along, preload, exponent)), np.array(rope).T, strict=True)
    expected = [_bedded(f, p, x, stroke, r) for f, p, x, r in loops]
    output = loop_output_force(along, preload, exponent, jnp.asarray(stroke), rope)
    np.testing.assert_allclose(output, expected, rtol=0, atol=2e-6 * np.max(np.abs(along)))


def test_of_many_loops_whose_ropes_bed_in_each_is_as_long_as_at_rest():
    along, preload, exponent, rope = _random_loops(20_000, most=-0.5)
    mean = np.asarray(moving_preload(along, preload, exponent, rope))
    shares = -np.expm1(-exponent) / exponent, np.expm1(exponent) / exponent
    pulling = shares[0] * (2 * mean + shares[1] * along) / sum(shares)
    extended = [_extended_along(np.asarray(side), np.asarray(exponent), rope) for side in (pulling, 2 * mean - pulling)]
    at_rest = 2 * (preload / rope[0] - rope[1] * np.expm1(-preload / rope[2]))
    np.testing.assert_allclose(sum(extended), at_rest, rtol=1e-8)
    assert np.all(mean >= preload * (1 - 1e-12))


def test_a_rope_that_hardly_beds_in_is_a_linear_one():
    along, preload, exponent, (stiffness, _, load) = _random_loops(1000)
    rope = (stiffness, 1e-12 * load / stiffness, load)
    output = loop_output_force(along, preload, exponent, FORWARD, rope)
    np.testing.assert_allclose(output, loop_output_force(along, preload, exponent, FORWARD), atol=1e-9 * np.max(along))


@pytest.mark.parametrize("options", [{}, {"run_once": True}, {"run_often": True}])
def test_a_compiled_loop_has_its_slope_on_every_branch(options):
    """At no optimization XLA rounds a branch and the smaller of both in two ways, so that neither seems to be the smaller."""
    force, exponents = jnp.linspace(-60, 60, 2001)[:, None] * jnp.ones((1, 4)), jnp.asarray([0.18, 0.37, 0.38, 0.57])
    preload = jnp.full(4, 20.006)

    def band_and_slopes(exponents):
        return jax.jvp(lambda e: loop_band(force, preload, e), (exponents,), (jnp.ones_like(exponents),))

    compiled = compile_program(band_and_slopes, jax.ShapeDtypeStruct((4,), float), **options)(exponents)
    np.testing.assert_allclose(compiled[1], band_and_slopes(exponents)[1], atol=1e-9)


@pytest.mark.parametrize("stroke", [1.0, -1.0])
def test_the_input_force_of_a_loop_whose_rope_beds_in_is_the_inverse(stroke):
    force, preload, exponent, rope = _random_loops(2000)
    output = loop_output_force(force, preload, exponent, jnp.asarray(stroke), rope)
    again = loop_input_force(output, preload, exponent, jnp.asarray(stroke), rope)
    np.testing.assert_allclose(again, force, rtol=1e-7, atol=1e-9)


def test_the_return_side_of_a_rope_that_beds_in_goes_slack_where_the_branches_meet():
    _, preload, exponent, rope = _random_loops(2000)
    load = slack_load(preload, exponent, rope)
    output = loop_output_force(load, preload, exponent, FORWARD, rope)
    np.testing.assert_allclose(output, load * jnp.exp(-exponent), rtol=1e-9)
    below = loop_output_force(0.9 * load, preload, exponent, FORWARD, rope)
    assert np.all(below < 0.9 * load * jnp.exp(-exponent))
    _, returning = side_tensions(load * jnp.array([[0.9], [1.1]]), preload, exponent, FORWARD, rope)
    assert np.all(returning[0] > 0)
    assert np.all(returning[1] == 0)


def test_the_gradient_of_a_loop_whose_rope_beds_in_is_that_of_differences():
    along, preload, exponent, rope = _random_loops(30, seed=5)
    parts = (along, preload, exponent, *rope)

    def outputs(parts):
        return loop_output_force(*parts[:3], FORWARD, parts[3:])

    slopes = jax.jit(jax.grad(lambda *parts: jnp.sum(outputs(parts)), argnums=tuple(range(6))))(*parts)
    for i, part in enumerate(parts):
        step = 1e-6 * jnp.abs(part)
        above, below = (outputs((*parts[:i], part + sign * step, *parts[i + 1 :])) for sign in (1, -1))
        largest = float(jnp.max(jnp.abs(slopes[i])))
        np.testing.assert_allclose(slopes[i], (above - below) / (2 * step), rtol=1e-4, atol=1e-5 * largest)


def test_the_gradient_is_finite_where_a_rope_that_beds_in_at_nothing_is_far_from_taut():
    rope = jnp.asarray(10.0), jnp.asarray(1e-3), jnp.asarray(1e-5)  # the slack side is at a thousand bedding loads below 0
    loop = jnp.asarray(80.0), jnp.asarray(1.0), jnp.asarray(0.5)
    slopes = jax.grad(loop_output_force, argnums=(0, 1, 2))(*loop, FORWARD, rope)
    assert np.all(np.isfinite(slopes))
