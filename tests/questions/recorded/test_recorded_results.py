"""From recordings to answers: what a fit of recordings keeps, prints and compares, on a small cable with known truth."""

import json
from dataclasses import replace

import numpy as np
import pytest
from cables import cable, measured
from figure_words import assert_readable
from terminal_pages import faults

import bowdenfit as bf
from bowdenfit.errors import UsageError
from bowdenfit.inference.comparison import ElpdDifference, LooPrediction, compare_predictions
from bowdenfit.inference.interval import Interval
from bowdenfit.kinds.descriptions import make_design
from bowdenfit.kinds.forces.table import ForceTable
from bowdenfit.questions.check.data_set_words import describe_data_set
from bowdenfit.questions.figures import collect_figure_data
from bowdenfit.questions.identify.judgment import confounded_pairs
from bowdenfit.questions.recorded import dependence_figure
from bowdenfit.questions.recorded.friction_effects import RateEffect, compare_speeds
from bowdenfit.questions.recorded.traces import trace_recordings
from bowdenfit.questions.summary.brief import summary_sentences, summary_text
from bowdenfit.questions.summary.details import details_text
from bowdenfit.recordings.recording import Recordings

pytestmark = pytest.mark.extended

QUICK = ("sampler.n_walkers=64", "sampler.target_ess=200", "sampler.target_r_hat=1.05", "sampler.max_steps=2000")
SHORT = ("sampler.n_walkers=64", "sampler.target_ess=100", "sampler.target_r_hat=1.01", "sampler.max_steps=600")


@pytest.fixture(scope="session")
def recorded(on_body):
    """The folder of the synthetic recordings."""
    return on_body.parent / "synthetic-recordings"


@pytest.fixture(scope="session")
def plain(recorded, tmp_path_factory):
    folder = tmp_path_factory.mktemp("recorded") / "plain"
    return bf.fit(recorded, output=folder, seed=3, settings=QUICK, figures=False), folder


@pytest.fixture(scope="session")
def with_rate(recorded, tmp_path_factory):
    folder = tmp_path_factory.mktemp("recorded") / "rate"
    return bf.fit(recorded, output=folder, seed=3, settings=SHORT, figures=False, friction="rate-dependent"), folder


@pytest.fixture(scope="session")
def truth(recorded):
    return json.loads((recorded / "truth.json").read_text())


def test_the_summary_of_recordings_is_one_page(plain, with_rate):
    assert faults(summary_text(plain[0])) == []
    assert faults(summary_text(with_rate[0])) == []  # so short that it is not trusted, and begins with that
    assert "no dependence on speed" in " ".join(summary_sentences(with_rate[0]))


def test_figures_of_recordings_can_be_read(plain, with_rate):
    assert_readable(dict(collect_figure_data(plain[0])), plain[0].name)
    shown = dict(collect_figure_data(with_rate[0], ["dependence", "efficiency", "recordings"]))
    assert_readable(shown, with_rate[0].name)


def test_the_coefficients_of_the_synthetic_recordings_lie_in_their_intervals(plain, truth):
    """One cable, so that an interval of 99.9 % is asked for: it fails by chance for one seed of the data in 300."""
    fit, _ = plain
    for name in ("mu1", "mu2", "mu3"):
        low, high = np.quantile(fit.posterior.values[name], (0.0005, 0.9995))
        assert low < truth["truth"][name] < high, name


def test_every_run_s_own_exponent_is_found_to_a_thousandth(plain, truth):
    """What the cable and the mounting have together: no noise latch, no corner is left.

    The bench has no delay, so all that the output was shifted by is known to be an error.
    """
    fit, _ = plain
    term = next(t for t in fit.model.terms if t.name == "recorded_efficiency")
    delay = -fit.dataset.measurements.table(Recordings).items[0].account.delay
    for i, recording in enumerate(truth["recordings"]):
        cells = term.data.cells.select(term.data.cells.run == i)
        computed = np.sum(cells.weight * (cells.mean - delay * cells.drift)) / cells.weight.sum()
        assert computed == pytest.approx(recording["exponent"] + recording["run_effect"], abs=0.001)


def test_both_likelihoods_ask_for_the_same_coefficients(recorded, plain):
    whole = bf.fit(recorded, mcmc=False, settings=("tables.recordings.likelihood=whole",))
    runs, _ = plain
    for name in ("mu1", "mu2", "mu3"):
        a, b = whole.least_squares.estimates[name], runs.least_squares.estimates[name]
        assert a.value == pytest.approx(b.value, abs=0.3 * b.standard_error)


def test_a_saved_fit_of_recordings_comes_back_bit_for_bit(plain):
    fit, folder = plain
    again = bf.load(folder)
    assert details_text(again) == details_text(fit)
    for initial, after in zip(
        fit.dataset.measurements.table(Recordings).items, again.dataset.measurements.table(Recordings).items, strict=True
    ):
        np.testing.assert_array_equal(initial.blocks.input_force, after.blocks.input_force)
        np.testing.assert_array_equal(initial.strokes.stroke, after.strokes.stroke)
        assert initial.account.counts == after.account.counts
        assert initial.strokes.used_sliding.dtype == after.strokes.used_sliding.dtype == bool
    np.testing.assert_array_equal(again.posterior.z, fit.posterior.z)


def test_no_sample_disappears_without_being_counted(plain):
    fit, folder = plain
    page = json.loads((folder / "summary.json").read_text())
    lengths = {r.file: r.account.samples for r in fit.dataset.measurements.table(Recordings).items}
    for row in page["recordings"]:
        assert sum(row["counts"].values()) == row["samples"] == lengths[row["file"]]


def test_the_summary_says_where_the_samples_went_and_how_much_mountings_differ(plain):
    text = " ".join(details_text(plain[0]).split())
    samples = sum(r.account.samples for r in plain[0].dataset.measurements.table(Recordings).items)
    assert f"{samples} samples of 7 recordings in 7 runs" in text
    assert "From one mounting of the cable to the next the efficiency scatters by" in text
    assert "% of itself" in text
    assert "The output channel was shifted back by a delay of" in text
    assert "recording samples used left out" in text


def test_check_shows_the_recordings_and_has_no_false_warning(recorded):
    text = describe_data_set(bf.check(recorded))
    assert "470 mm, 60 r/min" in text
    assert "Warning" not in text
    assert "Nothing is wrong" in text


def test_figures_of_a_fit_show_every_recording_with_a_band_that_holds_most_of_it(plain):
    traces = trace_recordings(plain[0])
    assert len(traces) == 7
    for trace in traces:
        low, _, high = trace.predicted[:, trace.used]
        inside = (trace.output_force[trace.used] > low - 1.0) & (trace.output_force[trace.used] < high + 1.0)
        assert inside.mean() > 0.85  # a 90 % band of mountings, give or take the noise of a block
        off = np.abs(trace.fitted - trace.output_force)[trace.used] / trace.output_force[trace.used]
        assert np.median(off) < 0.01


def test_speed_is_answered_with_its_difference_and_interval(with_rate):
    fit, folder = with_rate
    effect = compare_speeds(fit)
    assert (round(effect.slow), round(effect.fast), effect.unit, effect.place) == (20, 60, "r/min", "at 470 mm")
    assert effect.difference.q05 < effect.difference.median < effect.difference.q95
    assert abs(effect.difference.median) < 0.01  # the truth is 0, mountings differ by 1 %
    page = json.loads((folder / "summary.json").read_text())
    assert page["rate_effect"]["difference"]["median"] == pytest.approx(effect.difference.median)
    assert "Efficiency at 470 mm at 60 r/min minus that at 20 r/min" in " ".join(details_text(fit).split())
    (dependence,) = dependence_figure.data(fit)
    assert (dependence.what, dependence.label) == ("speed", "Speed (r/min)")
    assert len(dependence.points_x) == 4


@pytest.mark.parametrize(
    ("q05", "q95", "probability_lower", "words"),
    [
        (-0.004, 0.003, 0.6, "show no dependence"),
        (-0.009, -0.001, 0.97, "a hint that efficiency falls"),
        (-0.02, -0.01, 0.9999, "so efficiency falls"),
        (0.01, 0.02, 0.0, "so efficiency rises"),
    ],
)
def test_the_sentence_on_speed_says_no_more_than_the_interval(q05, q95, probability_lower, words):
    interval = Interval((q05 + q95) / 2, 0.001, (q05 + q95) / 2, q05, q95)
    effect = RateEffect(20.0, 60.0, "r/min", "at 470 mm", interval, probability_lower)
    assert words in effect.sentence()


@pytest.mark.extended
def test_compare_answers_whether_speed_matters_on_the_command_line(plain, with_rate, tmp_path, run):
    folder = tmp_path / "comparison"
    code, out, err = run("compare", "--json", "-o", folder, plain[1], with_rate[1])
    assert code == 3, err  # both fits are too short to have converged
    words = " ".join((folder / "comparison.txt").read_text().split())
    assert "The data cannot distinguish" in words
    assert "Letting friction depend on speed (rate) predicts no better than not (plain)." in words
    assert "viscous" in words
    page = json.loads(out)
    assert {row["name"]: row["troubles"] for row in page["fits"]} == {"plain": "not converged", "rate": "not converged"}
    assert page["fits"][0]["elpd_difference"] == 0.0


def test_compare_refuses_fits_of_different_readings_one_fit_and_fits_without_draws(plain, recorded):
    fit, _ = plain
    recordings = fit.dataset.measurements.table(Recordings)
    fewer = fit.dataset.measurements.with_tables(replace(recordings, items=recordings.items[:5]))
    other = replace(fit, dataset=replace(fit.dataset, measurements=fewer))
    with pytest.raises(UsageError, match="same readings"):
        bf.compare({"a": fit, "b": other})
    with pytest.raises(UsageError, match="at least two"):
        bf.compare({"a": fit})
    with pytest.raises(UsageError, match="without --no-mcmc"):
        bf.compare({"a": fit, "b": replace(fit, sampled=None)})


def test_the_better_model_is_seen_only_beyond_two_standard_errors():
    good, k = np.array([1.0, 2.0, 3.0, 4.0]), np.zeros(4)
    comparison = compare_predictions({"worse": LooPrediction(good - [5, 5.1, 4.9, 5], k), "best": LooPrediction(good, k)})
    assert list(comparison) == ["best", "worse"]
    assert comparison["worse"].elpd == pytest.approx(20.0)
    assert comparison["worse"].is_distinguishable
    assert not ElpdDifference(20.0, 15.0, 0).is_distinguishable
    assert not ElpdDifference(1.0, 0.1, 0).is_distinguishable


def test_leave_one_out_of_a_normal_mean_is_what_leaving_one_out_gives():
    """Conjugate: readings Normal(mu, 1), flat prior; leaving y_i out its density is Normal(mean of others, 1 + 1/(n - 1))."""
    from scipy import stats

    from bowdenfit.inference.comparison import psis_loo

    generator = np.random.default_rng(5)
    readings = generator.normal(size=12)
    draws = generator.normal(readings.mean(), 1 / np.sqrt(12), size=(8, 4000))
    log_likelihood = stats.norm.logpdf(readings, draws[..., None], 1.0)
    loo = psis_loo({"readings": log_likelihood}, draws.size)
    remaining = [np.delete(readings, i).mean() for i in range(12)]
    expected = stats.norm.logpdf(readings, remaining, np.sqrt(1 + 1 / 11))
    np.testing.assert_allclose(loo.elpd, expected, atol=0.02)
    assert loo.unreliable == 0


@pytest.fixture(scope="session")
def pulls_only():
    """One constant angle, pulling strokes alone, and load cells that may differ in gain."""
    contact = {"name": "edge", "friction": "mu_edge", "wrap_angle": {"value": 45, "unit": "deg"}}
    description = cable(
        1, ("forces",), contact=[contact], sensors={"input_gain_error_sd": 0, "output_gain_error_sd": 0.05}
    )
    design = make_design(runs=(400.0,) * 8, input_forces=(20.0, 40.0, 60.0), strokes=("pull",))
    dataset, values = measured(description, 4, design=design)
    return bf.fit(dataset, seed=2), values


def test_a_gain_error_and_a_constant_angle_are_said_to_be_confounded_with_what_is_known_of_them(pulls_only):
    fit, values = pulls_only
    (pair,) = confounded_pairs(fit)
    assert {pair.first, pair.second} == {"mu_edge", "gain_error"}
    assert pair.factor == pytest.approx(1 / np.deg2rad(45), rel=0.1)
    truth = values["mu_edge"] + pair.factor * values["gain_error"]
    assert pair.mean == pytest.approx(truth, abs=4 * pair.sd)  # fails by chance for one seed in 10^4
    assert pair.sd < 0.4 * pair.first_sd
    text = " ".join(details_text(fit).split())
    assert "barely separate mu_edge from gain_error" in text
    assert fit.summary()["confounded"][0]["combination"] == pair.combination
    assert not fit.least_squares.estimates["mu_edge"].identified


def test_parameters_that_the_data_tell_apart_are_not_called_confounded(plain):
    assert confounded_pairs(plain[0]) == []


def _csv(path, columns, rows):
    path.write_text("\n".join([",".join(columns), *(",".join(f"{x:.6g}" for x in row) for row in rows)]) + "\n")


def test_recordings_one_below_the_other_in_one_file_are_told_apart_by_a_column(recorded, tmp_path):
    parts = []
    for run, name in enumerate(("440mm_20rpm", "470mm_20rpm"), start=1):
        rows = np.loadtxt(recorded / "recordings" / f"{name}.csv", delimiter=",", skiprows=1)
        parts.append(np.column_stack([np.full(len(rows), run), rows[:, :3]]))
    _csv(tmp_path / "all.csv", ("run", "time_s", "input_force_N", "output_force_N"), np.concatenate(parts))
    entries = "".join(
        f'[[recording]]\nfile = "all.csv"\nname = "{name}"\nwhere = {{ run = {run} }}\n'
        for run, name in ((1, "a"), (2, "b"))
    )
    contact = '[[contact]]\nname = "c"\nfriction = "mu"\nwrap_angle = { value = 90, unit = "deg" }\n'
    (tmp_path / "cable.toml").write_text(f'name = "two"\n{contact}[tables]\nrecordings = {{}}\n{entries}')
    first, second = bf.read(tmp_path).measurements.table(Recordings).items
    assert (first.name, second.name) == ("a", "b")
    assert first.account.samples == second.account.samples == 1200
    assert first.strokes.exponent == pytest.approx(0.2746, abs=0.004)
    assert second.strokes.exponent == pytest.approx(0.2341, abs=0.004)


def test_a_short_table_with_a_clock_and_no_runs_is_a_recording_and_one_with_strokes_is_not(recorded, tmp_path):
    rows = np.loadtxt(recorded / "recordings" / "470mm_60rpm.csv", delimiter=",", skiprows=1)[100:290]
    _csv(tmp_path / "clock.csv", ("time_s", "input_force_N", "output_force_N"), rows[:, :3])
    measurements = bf.read(tmp_path / "clock.csv", wrap_angle=(180.0, "deg")).measurements
    assert measurements.table(Recordings) is not None
    assert measurements.table(ForceTable) is None
    _csv(
        tmp_path / "strokes.csv",
        ("stroke", "input_force_N", "output_force_N"),
        np.abs(rows[:5, [3, 1, 2]]) * [0, 1, 1] + [1, 0, 0],
    )
    measurements = bf.read(tmp_path / "strokes.csv", wrap_angle=(180.0, "deg")).measurements
    assert measurements.table(Recordings) is None
    assert len(measurements.table(ForceTable).run) == 5


def test_check_of_a_file_alone_lists_channels_and_what_it_is_as_a_recording(recorded, run):
    code, out, _ = run("check", recorded / "recordings" / "440mm_20rpm.csv")
    words = " ".join(out.split())
    assert code == 0
    assert "input_force_N N 1200 100 Hz 11.99 s 14.18 134.6 time_s" in words
    assert "440mm_20rpm 1200" in words
    words = " ".join(run("check", recorded.parent / "yarn-on-cylinder" / "forces.csv")[1].split())
    assert "a table of 21 readings at 1 load" in words


def test_recordings_forces_efficiencies_and_angles_are_fitted_together(recorded, plain, on_body, tmp_path):
    import shutil

    folder = tmp_path / "together"
    shutil.copytree(recorded, folder)
    shutil.copy(on_body / "efficiencies.csv", folder)
    (folder / "forces.csv").write_text(
        "cable_length_mm,run,stroke,input_force_N,output_force_N,velocity [r/min]\n"
        "440,x,pull,50,38.2,20\n440,x,return,40,52.4,-20\n470,y,pull,60,47.3,20\n"
    )
    tables = 'efficiencies = { file = "efficiencies.csv" }\nforces = { file = "forces.csv" }\n[[recording]]'
    text = (folder / "cable.toml").read_text()
    (folder / "cable.toml").write_text(text.replace("[[recording]]", tables, 1))
    together, (alone, _) = bf.fit(folder, mcmc=False), plain
    assert [t.name for t in together.model.terms] == [
        "wrap_angle",
        "efficiency",
        "run_efficiency",
        "recorded_efficiency",
    ]
    for name in ("mu1", "mu2", "mu3"):
        joint, single = together.least_squares.estimates[name], alone.least_squares.estimates[name]
        assert joint.standard_error < single.standard_error
        assert abs(joint.value - single.value) < 2 * single.standard_error
