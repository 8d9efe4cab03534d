"""Where friction depends on the load: at which force a number holds, what drag costs, and what lies outside measurements."""

import json

import numpy as np
import pytest
from hand_bench import BENDS, LENGTHS, pull, write

import bowdenfit as bf
from bowdenfit.questions.length.efficiency_figure import data, draw
from bowdenfit.questions.predict.measured_range import MeasuredRange, clip_to_tension
from bowdenfit.questions.recorded.friction_effects import compute_lost_force

pytestmark = pytest.mark.extended

LOSS = -np.log(0.75)
HIDDEN = 2.2
LOADS = (5.0, 10.0, 20.0, 40.0)
QUICK = ("sampler.n_walkers=64", "sampler.target_ess=300", "sampler.target_r_hat=1.05", "sampler.max_steps=4000")
SMALL = "[sampler]\nn_walkers = 32\nmax_steps = 1500\ntarget_ess = 100\ntarget_r_hat = 1.05\n"


@pytest.fixture(scope="module")
def drag(tmp_path_factory):
    """A fit of a cable with 2.2 N of hidden tension, which costs a quarter of that at half a turn; and its results folder."""
    folder = tmp_path_factory.mktemp("drag")
    rows = pull(
        np.random.default_rng(5),
        [180.0] * 4,
        [LOSS] * 4,
        LOADS,
        repeats=6,
        noise=(0.05, 0.05),
        drag=HIDDEN,
        scatter=0.005,
    )
    write(folder / "cable", rows, BENDS, more=SMALL)
    fit = bf.fit(folder / "cable", friction="drag", output=folder / "fit", figures=False, seed=1, settings=QUICK)
    return fit, folder / "fit"


@pytest.mark.slow
def test_drag_is_said_as_the_hidden_tension_and_as_the_force_that_it_costs(drag):
    lost_force = compute_lost_force(drag[0])
    assert abs(lost_force.hidden_tension.median - HIDDEN) < 4 * lost_force.hidden_tension.sd < 0.8
    assert abs(lost_force.lost.median - HIDDEN * 0.25) < 4 * lost_force.lost.sd < 0.2
    text = " ".join((drag[1] / "details.txt").read_text().split())
    assert "of the force is lost at any load, as if 2." in text and "of tension did not show at the cells" in text
    page = json.loads((drag[1] / "summary.json").read_text())
    assert page["drag"]["lost_force_N"]["median"] == pytest.approx(lost_force.lost.median)
    assert page["drag"]["hidden_tension_N"]["median"] == pytest.approx(lost_force.hidden_tension.median)
    assert "hidden tension" in page["parameters"]["drag"]["meaning"]


def test_the_force_lost_is_what_a_bench_without_hidden_tension_would_deliver_more():
    """At any load, by the simulator that shares no code with the model."""
    none, some = (
        pull(np.random.default_rng(0), [0.0], [LOSS], (1.0, 30.0, 5000.0), strokes=(1,), drag=d).force_out
        for d in (0.0, HIDDEN)
    )
    np.testing.assert_allclose(none - some, HIDDEN * (1 - np.exp(-LOSS)), rtol=1e-9)


def test_an_efficiency_that_depends_on_the_load_is_said_with_its_force(drag):
    rows = json.loads((drag[1] / "summary.json").read_text())["measured"]
    assert all(LOADS[0] < row["input_force_N"] <= 1.02 * LOADS[-1] for row in rows)
    text = " ".join((drag[1] / "details.txt").read_text().split())
    assert "at input" in text and "measured efficiencies hold at the force given with them" in text


def test_predictions_outside_the_loads_measured_are_marked_in_text_and_json(drag, accept):
    def notes(*request):
        rows = json.loads(accept("predict", drag[1], *request, "--json"))
        text = " ".join(accept("predict", drag[1], *request).split())
        assert all(row["note"] in text for row in rows)
        return rows

    (inside,) = notes("--input-force", "20N")
    assert inside["note"] == ""
    (above,) = notes("--input-force", "4kN")
    assert above["note"].startswith("outside the loads measured, ")
    (slack,) = notes("--input-force", "0.2N")
    assert slack["output_force_N"] == 0 and slack["q05"] == 0 and "slack" in slack["note"].split("; ")
    bent, far = notes("--wrap-angle", "180deg", "--wrap-angle", "400deg")
    assert bent["note"] == "" and far["note"] == "outside the wrap angles measured, 180 to 180 deg"
    (slack,) = notes("--wrap-angle", "180deg", "--input-force", "0.2N")
    assert slack["output_force_N"] == 0 and slack["note"].startswith("slack; outside the loads")
    (efficiency,) = notes()
    assert efficiency["at_input_force_N"] == drag[0].model.cable.friction.conditions.reference_force


def test_a_rope_pulls_or_is_slack():
    force, words = clip_to_tension(np.array([[1.0, -1.0, 3.0], [1.0, -2.0, -1.0]]), 10.0)
    np.testing.assert_array_equal(force, [[1.0, 0.0, 3.0], [1.0, 0.0, 0.0]])
    assert words == ["", "slack", "slack with 50 % probability"]


def test_what_was_measured_says_what_lies_outside():
    ranges = MeasuredRange((430.0, 550.0), (10.0, 60.0), "mm")
    assert ranges.notes(550.0, 60.0) == []
    assert ranges.notes(551.0, 9.0) == [
        "outside the lengths measured, 430 to 550 mm",
        "outside the loads measured, 10 to 60 N",
    ]
    assert MeasuredRange(None, None, "").notes(None, 5.0) == ["no table says at which loads"]


def test_the_figure_of_the_efficiency_says_at_which_force_its_curve_holds(tmp_path):
    lengths = (440.0, 480.0, 520.0, 540.0)
    rows = pull(np.random.default_rng(6), lengths, [0.5, 0.4, 0.3, 0.25], LOADS, noise=(0.05, 0.05), drag=HIDDEN)
    write(tmp_path, rows, LENGTHS.replace("gaussian", "line"), "cable_length_mm")
    angles = "\n".join(f"{length},{180 - (length - 440) * 0.9}" for length in range(440, 541, 10))
    (tmp_path / "angles.csv").write_text(f"cable_length_mm,sheath_angle_deg\n{angles}\n")
    for friction, says in (("drag", "curve at 14 N"), ("capstan", "")):
        figure = draw(data(bf.fit(tmp_path, friction=friction, mcmc=False)))
        label = figure.axes[0].get_ylabel()
        assert label.partition("\n")[2] == says, label
