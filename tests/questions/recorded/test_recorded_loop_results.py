"""What is said and drawn of recordings of a pull-pull loop: posterior, report, traces and figures; and what is kept."""

import json
import math

import numpy as np
import pytest
from figure_words import assert_readable
from loop_benches import MU, PRELOAD, folder_of, recorded, several_in

import bowdenfit as bf
from bowdenfit.dataset import load_dataset
from bowdenfit.questions.check.data_set_words import describe_data_set
from bowdenfit.questions.figures import FIGURES, collect_figure_data
from bowdenfit.questions.recorded.traces import collect_loop_points, trace_recordings
from bowdenfit.recordings.recording import Recordings
from bowdenfit.results.store import _measurements, _measurements_page

pytestmark = pytest.mark.extended


@pytest.fixture(scope="module")
def several(tmp_path_factory):
    return several_in(tmp_path_factory.mktemp("several"))


@pytest.fixture(scope="module")
def sampled(tmp_path_factory):
    """A short posterior from two short recordings; the first of them never goes slack."""
    recordings = [recorded(amplitude=a, seconds=6.0, seed=i) for i, a in enumerate((30.0, 80.0))]
    settings = ("sampler.n_walkers=32", "sampler.n_ensembles=2", "sampler.max_steps=400", "sampler.target_ess=100")
    return bf.fit(folder_of(tmp_path_factory.mktemp("sampled"), recordings), seed=2, settings=settings)


@pytest.mark.slow
def test_a_short_posterior_holds_the_truth(sampled):
    posterior = sampled.posterior
    for name, truth in (("mu", MU), ("preload", PRELOAD)):
        draws = posterior.values[name]
        assert abs(draws.mean() - truth) < 3 * draws.std(), name
    assert posterior.values["mu"].std() < 0.02
    assert posterior.values["preload"].std() < 1.0
    assert posterior.expected["recorded_loss"].shape[-1] == 2


def test_recordings_of_a_loop_come_back_from_a_saved_fit(sampled):
    measurements = sampled.dataset.measurements
    page = json.loads(json.dumps(_measurements_page(measurements), allow_nan=False))
    again = _measurements(page).table(Recordings)
    assert again.loop
    for first, other in zip(again.items, measurements.table(Recordings).items, strict=True):
        assert first.strokes.drag == other.strokes.drag
        np.testing.assert_equal(first.strokes.exponent, other.strokes.exponent)
        assert np.array_equal(first.blocks.output_force, other.blocks.output_force)
    assert np.isnan(again.items[0].strokes.exponent)


def test_the_report_speaks_of_moving_forward_and_back(several):
    text = describe_data_set(load_dataset(several))
    for words in ("forward", "between", "back", "loss", "2 x preload x exponent", "not estimated for a loop"):
        assert words in " ".join(text.split())
    for words in ("pulling", "switching", "sliding"):
        assert words not in text
    line = [line for line in text.splitlines() if line.strip().startswith("r1 ")][-1]
    assert line.split()[-1] == "-"
    assert line.split()[-2] == "N"


def test_traces_follow_the_recorded_output(sampled):
    for trace in trace_recordings(sampled):
        assert np.median(np.abs(trace.fitted - trace.output_force)) < 0.2
        low, _, high = trace.predicted
        assert np.mean((trace.output_force > low - 0.5) & (trace.output_force < high + 0.5)) > 0.9
        assert trace.output_force.min() < -1
        assert trace.is_loop


def test_traces_show_what_load_cells_with_known_errors_read(tmp_path):
    columns = recorded("triangle", 60.0, noise=0.0, seconds=6.0)
    columns["input_force_N"] = columns["input_force_N"] + 2.0
    columns["output_force_N"] = columns["output_force_N"] * math.exp(-0.05) - 1.5
    expected = {"mu": MU, "preload": PRELOAD, "input_offset": 2.0, "output_offset": -1.5, "gain_error": 0.05}
    prior = "\n".join(f"{name}.fixed = {value}" for name, value in expected.items() if name != "mu")
    more = f"[prior]\n{prior}\n[friction.mu]\nfixed = {MU}\n"
    sensors = '[sensors]\ninput_gain_error_sd = 0\noutput_gain_error_sd = 0.1\noffset_sd = { value = 1, unit = "N" }'
    fit = bf.fit(folder_of(tmp_path, [columns], more=f"{sensors}\n{more}[tables]\nrecordings = {{}}"), mcmc=False)
    trace = trace_recordings(fit)[0]
    assert len(trace.predicted) == 1
    assert np.abs(trace.predicted[0] - trace.output_force).max() < 0.3
    assert np.median(np.abs(trace.predicted[0] - trace.output_force)) < 0.02


def test_only_the_figures_that_make_sense_for_a_loop_are_drawn(sampled):
    shown = dict(collect_figure_data(sampled))
    assert_readable(shown, sampled.name)
    assert {"recordings", "autocorrelation"} <= set(shown)
    assert not set(shown) & {"hysteresis", "sample_efficiency", "dependence"}
    figure = FIGURES["recordings"].draw(shown["recordings"])
    words = {text.get_text() for text in figure.legends[0].get_texts()}
    assert {"Moving forward", "Moving back", "Between"} <= words
    assert not words & {"Pulling", "Returning"}


def test_points_of_a_loop_s_plane_are_gathered_by_wrap_angle(several):
    fit = bf.fit(several, mcmc=False)
    angle, force_in, force_out, _ = collect_loop_points(fit)
    np.testing.assert_allclose(np.rad2deg(np.unique(angle)), [90, 180, 270])
    assert set(collect_loop_points(fit, contact=0)[0]) == set(angle)
    for of_one in np.unique(angle):
        mask = angle == of_one
        assert mask.sum() > 100
        exponent = MU * of_one
        widest = np.maximum(2 * PRELOAD * exponent, np.abs(force_in[mask]) * (math.exp(exponent) - 1))
        assert np.all(np.abs(force_in[mask] - force_out[mask]) < widest * 1.1 + 1)
