"""What readings reveal of bench errors: draws of what is left open, and benches whose fault shows or does not."""

import math

import catheters
import numpy as np
import pytest
from recorded_benches import RecordedBench, write
from scipy import stats
from spoiled_input import copied

import bowdenfit as bf
from bowdenfit.dataset import load_dataset
from bowdenfit.description.defaults import BenchErrors
from bowdenfit.inference.bench_errors import LearnedErrors
from bowdenfit.kinds.bench_error import BenchError, BenchLoads, ErrorSource, iterate_error_sources, order_of
from bowdenfit.kinds.efficiencies.kind import EfficiencyKind, EfficiencyTable
from bowdenfit.kinds.recordings.kind import RecordingKind
from bowdenfit.models import build_model
from bowdenfit.questions.error_budget import with_bench_errors
from bowdenfit.recordings.recording import Recordings

MU, LOADS = 0.15, (20.0, 40.0, 80.0, 120.0)


def unlearned(cells, count=1):
    """Errors of which readings say nothing."""
    sources = tuple(ErrorSource(f"error {i}", "", {BenchError(gain=1.0): 1.0}, cells) for i in range(count))
    nothing = np.zeros((count, count))
    return LearnedErrors(sources, np.arange(count), np.zeros(count), np.eye(count), nothing, nothing, nothing, {})


def test_four_rectangular_errors_have_the_interval_of_jcgm_101():
    """JCGM 101:2008, 9.2.3.3: 2 sqrt(3) (2 - (3/5)^(1/4)) = 3.88; within 5 standard errors of a million draws."""
    exact = 2 * math.sqrt(3) * (2 - 0.6**0.25)
    assert f"{exact:.2f}" == "3.88"
    total = unlearned(1, 4).draw(10**6, 3).sum(axis=1)
    assert np.std(total) == pytest.approx(2, abs=5 * math.sqrt(2) / 1000)
    assert np.quantile(total, (0.025, 0.975)) == pytest.approx((-exact, exact), abs=0.03)


def test_errors_of_two_load_cells_are_triangular_together():
    draws = unlearned(2).draw(10**6, 4)
    assert np.std(draws) == pytest.approx(1.0, rel=0.005)
    assert np.ptp(draws) == pytest.approx(2 * math.sqrt(6), rel=0.005)  # twice as wide as half of a triangle
    assert stats.kurtosis(draws[:, 0]) == pytest.approx(-0.6, abs=0.02)


def test_a_learned_error_has_the_posterior_of_normal_readings():
    """A prior of unit variance and a reading of 3.0 ± 0.5 have mean 2.4 and variance 0.2."""
    source = (ErrorSource("gain", "", {BenchError(gain=1.0): 1.0}),)
    information, nothing = np.array([[4.0]]), np.zeros((1, 1))
    learned = LearnedErrors(source, np.zeros(1, int), np.array([2.4]), np.array([[0.2]]), information, nothing, nothing, {})
    draws = learned.draw(10**6, 5)
    assert np.mean(draws) == pytest.approx(2.4, abs=0.003)
    assert np.var(draws) == pytest.approx(0.2, rel=0.01)


def bench(path, gain=0.0, exponent=0.0, seed=1, crosstalk=0.0, zeros=(0.0, 0.0), compression=0.0):
    """Write a sweep of eight mountings whose output cell reads too much, or part of the input, or whose friction or wrap angles
    depend on the mean tension; zeros of both cells are in newtons.
    """
    rng, rows = np.random.default_rng(seed), ["run,stroke,input_force_N,output_force_N,wrap_angle_deg"]
    middle = np.exp(np.mean(np.log(LOADS)))
    for number, bend in enumerate(np.linspace(45, 270, 8)):
        mounting = rng.normal(0, 0.015)
        for stroke in (1, -1):
            for load in LOADS:
                loss = 0.0
                for _ in range(20):
                    tension = load * np.exp(-stroke * loss / 2)
                    grown = np.radians(bend) * (1 + compression * tension / LOADS[-1])
                    loss = MU * (tension / middle) ** exponent * grown + mounting
                output = (load * np.exp(-stroke * loss) + crosstalk * load) * (1 + gain) * (1 + rng.normal(0, 0.004)) + zeros[1]
                rows.append(f"m{number},{'pull' if stroke > 0 else 'return'},{load + zeros[0]},{output:.5f},{bend:.1f}")
    path.write_text("\n".join(rows) + "\n")
    return path


def learned(fit, name):
    return next(error for error in fit.error_budget.learned if name in error.name)


def test_a_gain_within_its_stated_limit_is_learned_trusted_and_corrected_for(tmp_path):
    fit = bf.fit(bench(tmp_path / "bench.csv", gain=0.03), seed=1, settings=["errors.gain=0.04"])
    gain, interval = learned(fit, "gain"), fit.error_budget.row("mu").bench
    assert fit.verdict().trusted and not fit.verdict().doubts
    assert gain.is_learned and abs(gain.mean - 3.0) < 3 * gain.sd < 2.5
    assert interval.q05 < MU < interval.q95
    assert "the gain error of the output's load cell" in " ".join(fit.error_budget.sentences())
    angle = learned(fit, "relative error")  # which looks like friction
    assert angle.sd == pytest.approx(angle.limit_sd, rel=0.02) and not angle.is_learned


def test_a_gain_beyond_its_limit_is_not_explained_away(tmp_path):
    fit = bf.fit(bench(tmp_path / "bench.csv", gain=0.03), seed=1, settings=["errors.gain=0.002"])
    assert not fit.verdict().trusted
    assert "stroke" in {departure.against.lower() for departure in fit.least_squares.departures if departure.is_noticeable}


def test_a_load_exponent_within_its_stated_limit_is_learned_inside_runs(tmp_path):
    path = bench(tmp_path / "bench.csv", exponent=-0.1)
    fit = bf.fit(path, seed=1, settings=["errors.load_exponent=0.15"])
    exponent = learned(fit, "exponent")
    assert fit.verdict().trusted
    assert "The readings reveal that the load exponent is -0." in " ".join(str(fit).split())
    assert exponent.mean == pytest.approx(-0.1, abs=3 * exponent.sd) and exponent.is_learned
    assert not bf.fit(path, seed=1, settings=["errors.load_exponent=0.01"]).verdict().trusted


def test_wrap_angles_that_grow_with_the_load_are_learned_and_corrected_for(tmp_path):
    """By 20 %, so that what the largest load adds, 13 % on average, is far more than the rest of the interval."""
    path = bench(tmp_path / "bench.csv", compression=0.2)
    settings = ["errors.compression=0.25", "errors.angle_scale=0", "errors.angle={value=0,unit='deg'}"]
    fit = bf.fit(path, seed=1, settings=settings)
    growth, interval = learned(fit, "growth"), fit.error_budget.row("mu")
    assert fit.verdict().trusted, fit.verdict().reasons
    assert growth.is_learned and growth.mean == pytest.approx(20, abs=3 * growth.sd)
    assert interval.bench.q05 < MU < interval.bench.q95
    assert interval.readings.q05 > MU  # wrap angles are those without a load


def test_crosstalk_within_its_stated_limit_is_learned_and_corrected_for(tmp_path):
    path = bench(tmp_path / "bench.csv", crosstalk=0.03)
    fit = bf.fit(path, seed=1, settings=["errors.crosstalk=0.05"])
    crosstalk, interval = learned(fit, "share of the input force"), fit.error_budget.row("mu").bench
    assert fit.verdict().trusted, fit.verdict().reasons
    assert crosstalk.is_learned and crosstalk.mean == pytest.approx(3.0, abs=2 * crosstalk.sd)
    assert interval.q05 < MU < interval.q95
    alone = bf.fit(path, seed=1)
    assert not alone.verdict().trusted
    assert not any("share of the input" in error.name for error in alone.error_budget.learned)


def test_zeros_within_their_stated_limit_are_learned_and_corrected_for(tmp_path):
    fit = bf.fit(bench(tmp_path / "bench.csv", zeros=(0.0, 2.4)), seed=1, settings=["errors.zero=0.03"])
    zero, interval = learned(fit, "zero of the output"), fit.error_budget.row("mu").bench
    assert fit.verdict().trusted, fit.verdict().reasons
    assert zero.is_learned
    assert interval.q05 < MU < interval.q95
    with_offsets = bf.fit(tmp_path / "bench.csv", seed=1, settings=['sensors.offset_sd={value=1,unit="N"}'])
    assert not any("zero" in error.name for error in with_offsets.error_budget.learned)  # they are parameters


@pytest.mark.parametrize(("table", "names"), [("efficiency", set()), ("weights", {"output_zero"})])
def test_only_cells_that_were_read_have_a_zero(tmp_path, table, names):
    path, settings = bench(tmp_path / "bench.csv"), []
    if table == "efficiency":
        path.write_text("efficiency,wrap_angle_deg\n0.9,45\n0.8,90\n0.7,135\n0.6,200\n")
    else:
        settings = ['sensors.force_noise={value=0.1,unit="N"}', "sensors.input_force_noise=0"]
    sources = iterate_error_sources(bf.read(path, settings=settings).description)
    assert {step.kind for source in sources for step in source.steps if "zero" in step.kind} == names


def test_without_errors_the_answers_are_those_of_the_readings(tmp_path):
    path = bench(tmp_path / "bench.csv")
    fit, alone = bf.fit(path, seed=1), bf.fit(path, seed=1, errors="none")
    assert "reveal" not in str(fit)
    assert fit.verdict().trusted and not any(error.contradicts_limit for error in fit.error_budget.learned)
    moved = with_bench_errors(fit)
    assert with_bench_errors(moved) is moved
    assert fit.error_budget.row("mu").readings == alone.parameter("mu") == fit.parameter_of_draws("mu")


def test_errors_none_leaves_out_every_error(tmp_path):
    limits = bf.read(bench(tmp_path / "bench.csv"), errors="none", settings=["errors.crosstalk=0.1"]).description.errors
    assert limits.model_fields_set == set(BenchErrors.model_fields)
    assert list(iterate_error_sources(bf.read(tmp_path / "bench.csv", errors="none").description)) == []


def test_an_error_that_moves_no_reading_is_not_said_to_be_included(tmp_path):
    """Friction of a cable that was mounted once cannot have changed from mounting to mounting."""
    path = bench(tmp_path / "bench.csv")
    path.write_text("".join(line for line in path.read_text().splitlines(True) if line.startswith(("run", "m0"))))
    budget = bf.fit(path, seed=1).error_budget
    assert [source.name for source in budget.without_effect] == ["wear"]
    assert "wear" not in {source.name for source in budget.sources} and "wear" not in budget.rows[0].shifts
    assert "wear" not in budget.sentences()[0] and budget.sentences()[-1].endswith(": wear.")


def test_angles_of_force_against_displacement_have_an_error(on_body, tmp_path):
    """All 2 % too large, which no reading shows. Noise of 133 readings would stand for a gain of one standard deviation."""
    folder = copied(on_body.parent / "synthetic-catheter", ("cable.toml", "displacement.csv"), tmp_path / "cable")
    heading, *rows = (folder / "displacement.csv").read_text().splitlines()
    scaled = [f"{1.02 * float(angle):.2f},{read}" for angle, read in (row.split(",", 1) for row in rows)]
    (folder / "displacement.csv").write_text("\n".join([heading, *scaled]) + "\n")
    fit, truth = bf.fit(folder, seed=1), catheters.TRUTH["mu"]
    interval, gain = fit.error_budget.row("mu"), learned(fit, "gain")
    assert fit.verdict().trusted
    assert interval.bench.q05 < truth < interval.bench.q95
    assert interval.readings.q95 < truth
    assert abs(gain.mean) < 0.2 * gain.limit_sd
    assert [source.name for source in fit.error_budget.without_effect] == ["wear", "load exponent", "compression"]


def test_an_error_moves_readings_of_a_loop_and_not_their_noise():
    rng, x, strokes = np.random.default_rng(4), np.linspace(1, 9, 60), np.arange(60) % 2
    noisy = 3 * x + strokes + rng.normal(0, 0.3, 60)
    read, changed = BenchError(gain=0.1).apply_to_loop((x, noisy), strokes, strokes, BenchLoads(9.0, 30.0, 10.0, 20.0))
    assert np.array_equal(read, x)
    assert changed - noisy == pytest.approx(0.1 * (3 * x + strokes), abs=0.035)  # of noise of 0.03, 0.07 and more would be left


def test_an_error_moves_efficiencies_and_not_their_noise(tmp_path):
    bend = np.tile([45.0, 90.0, 135.0, 180.0], 15)
    exact = 0.9 - 0.1 * np.radians(bend)
    noisy = exact + np.random.default_rng(4).normal(0, 0.03, 60)
    rows = (f"{e:.6f},{b:g}" for e, b in zip(noisy, bend, strict=True))
    (tmp_path / "bench.csv").write_text("\n".join(["efficiency,wrap_angle_deg", *rows]) + "\n")
    table = bf.read(tmp_path / "bench.csv").measurements.table(EfficiencyTable)
    changed = EfficiencyKind().with_bench_error(table, BenchError(gain=0.1)).efficiency
    assert changed - table.efficiency == pytest.approx(0.1 * exact, abs=0.003)  # of noise of 0.003, 0.007 would be left


def test_the_order_of_mountings_is_centered():
    assert order_of(np.array([0, 0, 1, 2]), 3).tolist() == [-0.5, -0.5, 0.0, 0.5]
    assert order_of(np.array([0, 0]), 1).tolist() == [0, 0]


def test_wear_and_load_scale_the_loss():
    forces = np.array([100.0, 100.0, 0.0]), np.array([50.0, 50.0, 0.0])
    worn = BenchError(wear=0.2).apply_to_friction(*forces, BenchLoads.of(*forces), np.array([-0.5, 0.5, 0.5]))
    assert np.log(100 / worn[:2]) == pytest.approx(np.log(2) * np.array([0.9, 1.1]))
    assert worn[2] == 0
    forces = np.array([50.0, 100.0, 200.0]), np.array([25.0, 50.0, 100.0])
    for error, factors in (
        (BenchError(load_exponent=0.1), 2.0 ** np.array([-0.1, 0, 0.1])),
        (BenchError(compression=0.1), 1 + 0.1 * np.array([0.25, 0.5, 1.0])),
    ):
        loaded = error.apply_to_friction(*forces, BenchLoads.of(*forces))
        assert np.log(forces[0] / loaded) == pytest.approx(np.log(2) * factors)


@pytest.mark.parametrize(("sds", "grow"), [([0.01, 0.02], False), ([0.01, np.nan], True), ([], True)])
def test_angles_that_all_have_a_stated_error_do_not_grow(sds, grow):
    assert BenchError(compression=0.1).where_angles_grow(np.array(sds)).compression == (0.1 if grow else 0.0)


@pytest.mark.parametrize("kind", ["wear", "load_exponent", "compression", "crosstalk", "gain", "hysteresis"])
def test_an_error_moves_readings_of_a_rope_and_not_their_noise(kind):
    error, forces = BenchError(**{kind: 0.1}), (np.array([100.0, 100.0, 100.0]), np.array([50.0, 55.0, 45.0]))
    slides, loads = np.ones(3, dtype=int), BenchLoads(200.0, 100.0, 60.0, 141.0)
    read = error.apply_to_rope(forces, np.full(3, np.log(2)), slides, 0.25, loads)
    assert np.ptp(np.log(read[1] / forces[1])) == pytest.approx(0, abs=1e-12)
    exact = error.apply_to_rope((forces[0], np.full(3, 50.0)), np.full(3, np.log(2)), slides, 0.25, loads)
    assert read[1][0] == exact[1][0]


def table(path, counts, strokes, noise=0.3):
    """Write a healthy sweep of mountings with so many readings each, of which so large a share are pulls."""
    rng, rows = np.random.default_rng(7), ["run,stroke,input_force_N,output_force_N,wrap_angle_deg"]
    for number, count in enumerate(counts):
        bend = 30 + 240 * number / (len(counts) - 1)
        loss = MU * np.radians(bend) + rng.normal(0, 0.006)
        for _ in range(count):
            stroke, load = 1 if rng.random() < strokes else -1, 100 * rng.uniform(0.2, 1)
            read = load + rng.normal(0, noise), load * np.exp(-stroke * loss) + rng.normal(0, noise)
            rows.append(f"m{number},{'pull' if stroke > 0 else 'return'},{read[0]:.4f},{read[1]:.4f},{bend:.1f}")
    path.write_text("\n".join(rows) + "\n")
    return path


def assert_nothing_learned_from_noise(fit):
    """No error beyond 3 standard deviations of what healthy readings say of it: of 9 errors in 2 benches of 100."""
    interval = fit.error_budget.row("mu").bench
    assert interval.q05 < MU < interval.q95
    for error in fit.error_budget.learned:
        scatter = math.sqrt(max(error.limit_sd**2 - error.sd**2, 0.0))
        assert abs(error.mean) < 3 * scatter + 0.02 * error.limit_sd, str(error)


def test_the_noise_of_many_readings_in_few_mountings_is_not_taken_for_an_error(tmp_path):
    """The earlier mountings and the pull have more readings, whose noise would stand for wear and for hysteresis."""
    path = table(tmp_path / "bench.csv", (600, 400, 200, 20, 10, 6), 0.8)
    assert_nothing_learned_from_noise(bf.fit(path, seed=1))


def test_a_crosstalk_that_looks_like_friction_is_not_learned_from_noise(tmp_path):
    """Pulls alone, each in a mounting of its own: what crosstalk adds is a change of the friction coefficient."""
    path = table(tmp_path / "bench.csv", (1,) * 200, 1.0)
    assert_nothing_learned_from_noise(bf.fit(path, seed=1, settings=["errors.crosstalk=0.05"]))


def test_readings_keep_their_weights_and_cells_in_a_bench_with_an_error(tmp_path):
    model = build_model(bf.read(table(tmp_path / "bench.csv", (6, 4, 2), 0.5)))
    (term,), (changed,) = model.terms, model.terms_with_error(BenchError(gain=0.1))
    assert np.array_equal(term.data.cells.weight, changed.data.cells.weight)
    assert not np.array_equal(term.data.cells.mean, changed.data.cells.mean)


def test_wear_moves_all_blocks_of_a_stroke_alike(tmp_path):
    path = write(RecordedBench(length=30, rate=100, mountings=2), tmp_path / "bench", 1)
    recordings = load_dataset(path).measurements.table(Recordings)
    worn = RecordingKind().with_bench_error(recordings, BenchError(wear=0.2))
    for healthy, changed, factor in zip(recordings.items, worn.items, (0.9, 1.1), strict=True):
        change = np.log(changed.blocks.output_force / healthy.blocks.output_force)
        for stroke in (1, -1):
            blocks = healthy.strokes.contact == stroke
            assert change[blocks] == pytest.approx(-stroke * (factor - 1) * healthy.strokes.exponent, abs=0.002)
            assert np.ptp(change[blocks]) < 1e-12
