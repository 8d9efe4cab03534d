"""Where losses of force depart from the model, the verdict names the settings with which they do not."""

from itertools import product

import numpy as np
import pytest

import bowdenfit as bf
from bowdenfit.kinds.sliding_rows import OFFSET

ANGLES, LOADS, MOUNTINGS = (45, 90, 135, 180, 270, 360), (20.0, 40.0, 60.0), 2
ZEROS, GAINS, DRAG, LOAD = "zeros of the load cells", "gains of the load cells", "hidden tension", "falls with the load"
SPEED, SPEEDS = "changes with the speed", (1.0, 2.0, 5.0, 10.0, 20.0, 50.0)  # mm/s


def write_bench(path, fault, scale=1.0, strokes=(1,)):
    """Write pairs of forces of a cable of mu = 0.12, read with one fault at a time; forces in newtons times `scale`."""
    generator, run = np.random.default_rng(7), 0
    rows = ["run,wrap_angle_deg,stroke,velocity_mm/s,input_force_N,output_force_N"]
    for angle in np.repeat(ANGLES, MOUNTINGS):
        run, scatter = run + 1, generator.normal(0, 0.01)
        bend = np.deg2rad(angle + (30 if fault == "bend" else 0))
        for load, speed, stroke in product(LOADS, SPEEDS if fault == "speed" else (10.0,), strokes):
            mu = 0.12 * (1 + 0.5 * np.exp(-speed / 5) if fault == "speed" else 1.0)
            hidden, true_in = 6.0 if fault == "drag" else 0.0, load * generator.normal(1, 0.01)
            if fault == "load":  # dF/dangle = -0.12 F (F / 60 N)^-0.4, integrated
                true_out = (true_in**0.4 - stroke * 0.4 * 0.12 * LOADS[-1] ** 0.4 * bend) ** 2.5 * np.exp(-stroke * scatter)
            else:
                true_out = (true_in + hidden) * np.exp(-stroke * (mu * bend + scatter)) - hidden
            read_in, read_out = np.array([true_in, true_out]) + generator.normal(0, 0.15, 2)
            read_out = read_out * (1.08 if fault == "gain" else 1.0) + (4.0 if fault == "zero" else 0.0)
            name = "pull" if stroke > 0 else "return"
            rows.append(f"{run},{angle},{name},{speed},{scale * read_in:.7g},{scale * read_out:.7g}")
    path.write_text("\n".join(rows) + "\n")
    return path


def describe(path):
    """The verdict on a bench, in one text."""
    fit = bf.fit(path, mcmc=False, seed=1)
    return fit.verdict().trusted, " ".join(fit.verdict().reasons)


def test_an_output_that_was_not_tared_is_named_and_told_from_others(tmp_path):
    trusted, text = describe(write_bench(tmp_path / "bench.csv", "zero"))
    assert not trusted
    assert ZEROS in text
    assert not any(words in text for words in (GAINS, DRAG, LOAD, SPEED, "Something drifted"))


GAINED = ("sensors.input_gain_error_sd=0.1", "sensors.output_gain_error_sd=0.1")


def test_a_gain_does_not_stand_in_for_a_zero_where_both_strokes_were_read(tmp_path):
    """This fit was trusted, with the coefficient 7 % off and the truth outside its interval."""
    fit = bf.fit(write_bench(tmp_path / "bench.csv", "zero", strokes=(1, -1)), mcmc=False, seed=1, settings=GAINED)
    (offset,) = (departure for departure in fit.least_squares.departures if departure.against == OFFSET)
    assert offset.high == pytest.approx(4.0, rel=0.15)
    assert "whose zero is off by about" in " ".join(fit.verdict().reasons)


def test_a_zero_that_is_fitted_leaves_no_offset(tmp_path):
    path = write_bench(tmp_path / "bench.csv", "zero", strokes=(1, -1))
    fit = bf.fit(path, mcmc=False, seed=1, settings=['sensors.offset_sd={value=10,unit="N"}'])
    assert fit.verdict().trusted
    assert fit.least_squares.estimates["output_offset"].value == pytest.approx(4.0, abs=1.0)


NAMED = [("zero", ZEROS), ("gain", GAINS), ("drag", DRAG), ("load", LOAD), ("speed", SPEED)]


@pytest.mark.extended
@pytest.mark.parametrize("scale", [0.02, 100])
@pytest.mark.parametrize(
    ("fault", "words", "strokes"), [("bend", GAINS, (1,)), *((*named, s) for named in NAMED for s in ((1,), (1, -1)))]
)
def test_the_fault_is_among_those_that_are_named(tmp_path, fault, words, scale, strokes):
    trusted, text = describe(write_bench(tmp_path / "bench.csv", fault, scale, strokes))
    assert not trusted
    assert words in text


@pytest.mark.extended
def test_the_printed_option_gives_the_true_coefficient(tmp_path):
    path = write_bench(tmp_path / "bench.csv", "zero")
    fit = bf.fit(path, mcmc=False, seed=1, settings=['sensors.offset_sd={value=10,unit="N"}'])
    mu = fit.least_squares.estimates["mu"]
    assert 'sensors.offset_sd={value=10,unit="N"}' in describe(path)[1]
    assert fit.verdict().trusted
    assert mu.lower < 0.12 < mu.upper


@pytest.mark.parametrize("strokes", [(1,), (1, -1)])
def test_a_healthy_bench_is_trusted(tmp_path, strokes):
    assert describe(write_bench(tmp_path / "bench.csv", "", strokes=strokes)) == (True, "")
