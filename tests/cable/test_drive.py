"""A rope and a loop through any motion: against the operator in plain Python, and on the scale that friction asks for."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from cables import cable
from elastic_cables import CONSTANT, HOUSING, elastic_cable

from bowdenfit.cable.conditions import LEAST_SHARE, Conditions
from bowdenfit.cable.drive import LEAST_EXPONENT, LoopDrive, RopeDrive, make_drive
from bowdenfit.cable.friction import FrictionModel
from bowdenfit.cable.sensors import LoadCells
from bowdenfit.kinds.tables import Measurements
from bowdenfit.kinds.terms import make_measured_cable as cable_of
from bowdenfit.physics.friction import force_from_scale, force_scale
from bowdenfit.recordings.preparation.hysteresis import play

N, EXPONENT, MOUNTING = 300, np.array([0.25, 0.4]), np.array([0.02, -0.03])
ERRORS = {"input_offset": 0.7, "output_offset": -0.4, "gain_error": 0.03}


def _forces(level: float) -> np.ndarray:
    """Input forces of two recordings that go up and down, about a level [N]."""
    return level + np.cumsum(np.random.default_rng(3).standard_normal((N, 2)), axis=0) * 3.0


def _rope(options=(), **values) -> RopeDrive:
    friction = FrictionModel(options, Conditions(50.0, 20.0, (10.0, 40.0), "mm/s"))
    values = {name: jnp.asarray(value) for name, value in values.items()}
    return RopeDrive(friction, values, jnp.asarray(EXPONENT), jnp.ones((N, 2)))


@pytest.mark.parametrize(
    ("options", "values", "scale"),
    [
        ((), {}, (0.0, 0.0, 50.0)),
        (("drag",), {"drag": 3.0}, (0.0, 3.0, 50.0)),
        (("load-dependent",), {"load_exponent": 0.3}, (0.3, 0.0, 50.0)),
    ],
)
def test_a_rope_is_the_play_of_the_preparation_on_the_scale_on_which_friction_is_a_shift(options, values, scale):
    drive, force = _rope(options, **values), np.abs(_forces(60.0)) + 1.0
    start = drive.scaled(jnp.asarray(force[0])) + 0.1
    output, slope = drive.follow(jnp.asarray(force), jnp.asarray(MOUNTING), start)
    for i in range(2):
        x = np.asarray(force_scale(jnp.asarray(force[:, i]), *map(jnp.asarray, scale)))
        y, state = play(x, EXPONENT[i] + MOUNTING[i], float(start[i]))
        expected = force_from_scale(jnp.asarray(y), *map(jnp.asarray, scale))
        np.testing.assert_allclose(output[:, i], expected, rtol=1e-12)
        np.testing.assert_array_equal(np.asarray(slope)[state != 0, i], -state[state != 0])


def test_a_loop_stands_still_between_its_two_ways():
    preload, force, start = np.array([5.0, 20.0]), _forces(0.0), np.array([0.0, 3.0])
    computed = LoopDrive(jnp.asarray(preload), jnp.asarray(EXPONENT)).follow(
        jnp.asarray(force), jnp.asarray(MOUNTING), jnp.asarray(start)
    )[0]
    for i in range(2):
        exponent, y = EXPONENT[i] + MOUNTING[i], start[i]
        lost, growth = 2 * preload[i] * exponent, np.exp(exponent)
        for t, x in enumerate(force[:, i].tolist()):
            y = min(max(y, min(x - lost, x / growth, x * growth)), max(x + lost, x / growth, x * growth))
            assert computed[t, i] == pytest.approx(y, abs=1e-11)


@pytest.mark.parametrize("drive", [_rope(), LoopDrive(jnp.array([5.0, 20.0]), jnp.asarray(EXPONENT))], ids=["rope", "loop"])
def test_what_a_cell_shows_changes_with_the_exponent_as_the_slope_says(drive):
    force, cells, step = jnp.asarray(np.abs(_forces(60.0)) + 1.0), LoadCells.of(ERRORS), 1e-6
    start = drive.scaled(force[0])

    @jax.jit
    def shown(mounting):
        return drive.shown(cells, *drive.follow(force, mounting, start))

    reading, slope = shown(jnp.asarray(MOUNTING))
    more, less = (shown(jnp.asarray(MOUNTING) + s)[0] for s in (step, -step))
    same = np.isclose((more + less) / 2, reading, atol=1e-9)
    assert same.mean() > 0.95 and np.any(slope)
    np.testing.assert_allclose(np.asarray(slope)[same], np.asarray((more - less) / (2 * step))[same], atol=1e-5)
    np.testing.assert_allclose(drive.reading(np.asarray(cells.shown_output(force))), _reading(drive, cells, force))


def _reading(drive, cells, force):
    return drive.shown(cells, force, jnp.zeros_like(force))[0]


@pytest.mark.parametrize("drive", [_rope(), LoopDrive(jnp.array([5.0, 20.0]), jnp.asarray(EXPONENT))], ids=["rope", "loop"])
def test_a_delay_is_taken_out_of_the_reading_that_it_was_added_to(drive):
    force = np.abs(_forces(60.0)) + 1.0
    late = np.full_like(force, 0.01)
    np.testing.assert_allclose(
        drive.reading(np.asarray(drive.without_delay(jnp.asarray(force), jnp.asarray(late)))),
        drive.reading(force) - late,
        rtol=1e-12,
    )


def test_friction_never_pushes_whatever_the_mounting_did():
    none = -jnp.asarray(EXPONENT) - 1.0
    assert np.all(_rope().band(none) == LEAST_EXPONENT)
    assert np.all(LoopDrive(jnp.ones(2), jnp.asarray(EXPONENT)).band(none) == LEAST_EXPONENT)
    force = jnp.asarray(np.abs(_forces(60.0)) + 1.0)
    np.testing.assert_allclose(_rope().follow(force, none, jnp.log(force[0]))[0], force, rtol=1e-8)
    assert _rope().least_force == LEAST_SHARE * 50.0 and LoopDrive(jnp.ones(2), jnp.ones(2)).least_force == -np.inf


def test_a_cable_says_what_it_is():
    angles, velocity, none = jnp.array([[1.0], [2.0]]), jnp.full((5, 2), jnp.nan), Measurements()
    alone = cable_of(cable(1, ("forces",), contact=[HOUSING | {"friction": "mu"}]), none)
    rope = make_drive(alone, {"mu": jnp.asarray(0.1)}, angles, velocity)
    assert isinstance(rope, RopeDrive)
    np.testing.assert_allclose(rope.exponent, [0.1, 0.2])
    np.testing.assert_array_equal(rope.rate, np.ones((5, 2)))
    pair = cable_of(elastic_cable(("loop",), preload=CONSTANT), none)
    loop = make_drive(pair, {"mu": jnp.asarray(0.1), "preload": jnp.asarray(12.0)}, angles, velocity, jnp.array([0.3, 0.4]))
    assert isinstance(loop, LoopDrive)
    np.testing.assert_allclose(loop.preload, [12.0, 12.0])
    np.testing.assert_allclose(loop.exponent, [0.3, 0.4])
