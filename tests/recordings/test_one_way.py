"""Recordings without a reversal: where their rope slides, and words that name what is missing, not a tare."""

import numpy as np
import pytest
from swinging_rope import swing

from bowdenfit.description import Preparation
from bowdenfit.recordings.preparation import prepare
from bowdenfit.recordings.recording import RawRecording
from bowdenfit.recordings.strokes import find_strokes

pytestmark = pytest.mark.extended

TIME = np.arange(0.0, 20.0, 0.01)
RISING = 5.0 + 3.0 * TIME
EXPONENT = 0.4


def noise(seed, sd=0.1):
    return sd * np.random.default_rng(seed).standard_normal(len(TIME))


@pytest.fixture
def recorded(tmp_path):
    """Writes a recording, and gives the arguments that name it."""

    def write(force_in, force_out, velocity=None):
        columns = [TIME, force_in + noise(1), force_out + noise(2)] + ([] if velocity is None else [velocity])
        heads = "time_s,input_force_N,output_force_N" + ("" if velocity is None else ",velocity_mm_per_s")
        path = tmp_path / "pull.csv"
        np.savetxt(path, np.column_stack(columns), "%.4f", ",", header=heads, comments="")
        return path, "--wrap-angle", "180deg"

    return write


def used(text):
    """Blocks that slide and the exponent, of the line of the recording."""
    *_, line = [line for line in text.splitlines() if line.strip().startswith("pull ")]  # the last columns stand below
    return int(line.split()[-2]), float(line.split()[-1])


def test_a_pull_in_which_both_forces_rise_throughout_slides_throughout(recorded, accept):
    text = accept("check", *recorded(RISING, RISING * np.exp(-EXPONENT)))
    blocks, exponent = used(text)
    assert blocks > 150 and exponent == pytest.approx(EXPONENT, abs=0.01)
    assert "has no loop" in " ".join(text.split())


def test_a_slow_pull_in_much_noise_slides_too(recorded, accept):
    rising = 20.0 + 0.5 * TIME
    blocks, exponent = used(accept("check", *recorded(rising + noise(3, 0.4), rising * np.exp(-EXPONENT) + noise(4, 0.4))))
    assert blocks > 50 and exponent == pytest.approx(EXPONENT, abs=0.02)


def test_a_rope_that_the_motor_moves_slides_even_if_its_forces_stay_the_same(recorded, accept):
    same = np.full(len(TIME), 40.0)
    moving = recorded(same, same * np.exp(-EXPONENT), np.full(len(TIME), 5.0))
    blocks, exponent = used(accept("check", *moving))
    assert blocks > 100 and exponent == pytest.approx(EXPONENT, abs=0.01)


def test_where_the_motor_has_stopped_it_does_not_slide(recorded, accept):
    force = np.minimum(5.0 + 6.0 * TIME, 60.0)
    moving = np.where(TIME < 55.0 / 6.0, 5.0, 0.0)
    assert 50 < used(accept("check", *recorded(force, force * np.exp(-EXPONENT), moving)))[0] < 100


def test_the_same_forces_without_a_moving_motor_show_no_sliding_and_no_tare_is_blamed(recorded, refuse):
    same = np.full(len(TIME), 40.0)
    sentence = refuse("check", *recorded(same, same * np.exp(-EXPONENT)))
    assert "nothing shows that the rope slides" in sentence
    assert "tare" not in sentence
    assert 'stroke = "pull"' in sentence


DEAD = {
    "on a pull": (RISING, np.full(len(TIME), 5.0)),
    "on loops": (30.0 + 20.0 * np.sin(TIME), np.full(len(TIME), 5.0)),
    "about 0": (30.0 + 20.0 * np.sin(TIME), np.full(len(TIME), 0.02)),
    "that drifts": (RISING, 10.0 + 0.5 * np.sin(3 * TIME)),
}


@pytest.mark.parametrize("how", DEAD)
def test_a_dead_cell_is_called_that(recorded, refuse, how):
    sentence = refuse("check", *recorded(*DEAD[how]))
    assert "the output does not follow the input" in sentence
    assert "correlation" in sentence and "dead load cell" in sentence


@pytest.mark.parametrize("exponent", [0.2, 1.0, 2.0])
def test_an_output_that_much_friction_holds_most_of_the_time_is_not_called_dead(recorded, accept, exponent):
    force = 60.0 + 57.0 * np.sin(TIME)
    y, output = np.log(force[0]), []
    for x in np.log(force):
        y = min(max(y, x - exponent), x + exponent)
        output.append(y)
    blocks, computed = used(accept("check", *recorded(force, np.exp(output))))
    assert blocks > 5 and computed == pytest.approx(exponent, rel=0.1)


def strokes_of(force, output, sd, seed):
    """Blocks and strokes of forces with noise, of which the standard deviation is a share of the largest input."""
    forces = force + noise(seed, sd * force.max()), output + noise(seed + 10, sd * force.max())
    blocks, _ = prepare(RawRecording("s", "s.csv", TIME, forces[0], TIME, forces[1]), Preparation())
    return blocks, find_strokes(blocks, "s.csv", "s")


SWINGS = [(1.5, 0.3, 5.0), (2.0, 0.5, 5.0), (3.0, 0.8, 20.0)]  # highest over lowest input, exponent, period [s]


@pytest.mark.parametrize(("highest", "exponent", "period"), SWINGS)
@pytest.mark.parametrize("seed", [3, 4, 8, 9])
def test_a_rope_that_pulls_once_and_then_sticks_is_not_pulling_while_it_sticks(seed, highest, exponent, period):
    """Its input swings too little for a return: the band of friction is wider than the swing."""
    force, output = swing(TIME, highest, exponent, period)
    blocks, strokes = strokes_of(force, output, 0.005, seed)
    slides = np.interp(blocks.time, TIME, np.gradient(output, TIME)) != 0
    used = strokes.used_sliding
    assert used.any() and np.mean(slides[used]) > 0.85
    assert strokes.exponent == pytest.approx(exponent, rel=0.02)


@pytest.mark.parametrize(("highest", "exponent", "seed"), [(1.5, 0.3, 7), (2.0, 0.37, 5), (1.5, 0.25, 12)])
def test_a_rope_that_all_but_returns_is_not_off_center(seed, highest, exponent):
    """A loop that is narrower, and off center by what that leaves, touches the same two forces."""
    strokes = strokes_of(*swing(TIME, highest, exponent, 20.0), 0.003, seed)[1]
    assert strokes.center == pytest.approx(0, abs=0.01)
    assert strokes.exponent == pytest.approx(exponent, rel=0.02)
