"""What to measure next: how much a reading tells of an answer, which candidates there are, and what is said of them."""

import itertools
import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import jax.numpy as jnp
import numpy as np
import pytest
from cables import DESIGN, cable, measured, other_design
from elastic_cables import ELASTIC, elastic_cable
from elastic_cables import TRUTH as ELASTIC_TRUTH
from scipy import stats
from simulated_coverage import Laboratory
from terminal_pages import faults

import bowdenfit as bf
from bowdenfit.dataset import Dataset, load_dataset
from bowdenfit.display import render_text
from bowdenfit.errors import UsageError
from bowdenfit.finished_fit import Fit
from bowdenfit.inference.draws import curve_function, for_each_draw, value_function
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.kinds.candidate import Candidate
from bowdenfit.kinds.descriptions import make_design
from bowdenfit.kinds.efficiencies.kind import EfficiencyTable
from bowdenfit.kinds.forces.next_run import typical_run
from bowdenfit.kinds.kind import Design
from bowdenfit.kinds.rows import OwnAngles, RowOrigin
from bowdenfit.kinds.tables import AngleTable
from bowdenfit.models import Model, build_model
from bowdenfit.questions.next import verb
from bowdenfit.questions.next.candidates import describe_candidate, format_candidate, list_candidates, parse_candidates
from bowdenfit.questions.next.ranking import rank_measurements
from bowdenfit.questions.next.variance_reduction import (
    error_of_difference,
    explained_share,
    mean_and_spread,
    simulate_readings,
    widths_after_outcomes,
)
from bowdenfit.questions.next.words import format_width, ranking_blocks
from bowdenfit.questions.simulate.tables import empty_tables
from bowdenfit.results.along_route import make_optimizer
from bowdenfit.results.record import Draws, Provenance

pytestmark = pytest.mark.extended

N = 12_800
LIMIT = 10.0  # deg, below which the on-body paper detects no angle


@pytest.fixture(scope="module")
def folder(quick_results):
    """Results folder of a quick fit of the on-body data."""
    return quick_results


@pytest.fixture(scope="module")
def fit(folder):
    return Fit.load(folder)


def pretended(dataset: Dataset, center: np.ndarray | dict[str, float], spread: float = 0.3, n: int = N) -> Fit:
    """A fit whose draws scatter about one z, or about given values, without the work of sampling."""
    model = build_model(dataset)
    z = np.asarray(model.space.unconstrain(center)) if isinstance(center, dict) else center
    z = z + spread * np.random.default_rng(4).standard_normal((n, model.space.size))
    shown = for_each_draw(value_function(model), model.space.size)(z)
    best = for_each_draw(make_optimizer(model), model.space.size)(z) if model.description.route else ()
    optimum = {name: b[None] for name, b in zip(("optimal_length", "optimal_efficiency"), best, strict=False)}
    draws = Draws(z[None], {k: v[None] for k, v in shown.items()}, optimum, {}, {}, {}, {}, {}, 1, n, 0.3)
    return Fit(dataset, None, draws, True, (), Provenance(1, {}))  # type: ignore[arg-type]


# How much a reading explains --------------------------------------------------------------------------------------


def test_a_linear_reading_explains_the_squared_correlation():
    """Within 4.5 standard errors: a false alarm in 1 of 100 000 runs of each of three cases (and the seed is fixed)."""
    generator = np.random.default_rng(1)
    answer = generator.standard_normal(N)
    for noise in (0.3, 1.0, 3.0):
        share = explained_share((answer + noise * generator.standard_normal(N))[:, None], answer)
        assert abs(share.share - 1 / (1 + noise**2)) < 4.5 * share.error
        assert 0 < share.error < 0.02


def test_curved_dependence_counts_where_correlation_sees_nothing():
    x, noise = np.random.default_rng(2).standard_normal((2, N))
    share = explained_share((x + 0.1 * noise)[:, None], x**2)
    assert abs(np.corrcoef(x, x**2)[0, 1]) < 0.05
    assert share.share > 0.95


def test_two_columns_tell_together_what_neither_tells_alone():
    x, y = np.random.default_rng(3).standard_normal((2, N))
    together = explained_share(np.column_stack([x, y]), x * y)
    assert together.share > 0.99
    assert explained_share(x[:, None], x * y).share < 0.01


def test_noise_does_not_look_like_information():
    """60 readings of pure noise, from few draws: cross-validated shares exceed 0.02 about once in 10^6 such tests."""
    generator = np.random.default_rng(4)
    answer = generator.standard_normal(1500)
    shares = [explained_share(generator.standard_normal((1500, 2)), answer).share for _ in range(60)]
    assert max(shares) < 0.02
    assert np.mean(np.array(shares) == 0) > 0.5


def test_the_stated_error_is_the_scatter_of_the_shares():
    """Of 80 repetitions, so that the ratio is known to 8 %; it leaves 0.7 to 1.4 about once in 10 000 runs."""
    generator = np.random.default_rng(5)
    results = []
    for _ in range(80):
        answer = generator.standard_normal(1280)
        results.append(explained_share((answer + generator.standard_normal(1280))[:, None], answer))
    stated_error, scatter = np.mean([f.error for f in results]), np.std([f.share for f in results])
    assert 0.7 < stated_error / scatter < 1.4


def test_draws_that_stay_alike_for_long_have_a_larger_error():
    generator = np.random.default_rng(6)
    answer = generator.standard_normal(N // 10)
    reading = answer + generator.standard_normal(N // 10)
    alone = explained_share(reading[:, None], answer)
    copies = explained_share(np.repeat(reading, 10)[:, None], np.repeat(answer, 10))
    assert copies.error == pytest.approx(alone.error, rel=0.15)
    assert copies.share == pytest.approx(alone.share, abs=2 * alone.error)


def test_a_reading_that_is_always_the_same_explains_nothing():
    answer = np.random.default_rng(7).standard_normal(N)
    share = explained_share(np.full((N, 2), 10.0), answer)
    assert (share.share, share.error) == (0.0, pytest.approx(0.0, abs=1e-3))
    assert explained_share(answer[:, None], np.full(N, 3.0)).share == 0.0


def test_shares_from_the_same_draws_differ_by_less_than_each_errs():
    x, y = np.random.default_rng(8).standard_normal((2, N))
    first, other = (explained_share((x + y + 0.01 * i)[:, None], x) for i in (0, 1))
    assert error_of_difference(first, other) < 0.05 * first.error
    assert error_of_difference(first, explained_share(y[:, None], x)) > 0.5 * first.error


def test_mean_and_scatter_of_three_readings_on():
    readings = np.random.default_rng(9).standard_normal((50, 8, 2))
    assert mean_and_spread(readings[:, :2]).shape == (50, 2)
    assert mean_and_spread(readings).shape == (50, 4)
    np.testing.assert_allclose(mean_and_spread(readings)[:, :2], readings.mean(axis=1))


# Readings ---------------------------------------------------------------------------------------------------------


def _left_by_weighting(answer: np.ndarray, log_likelihoods: np.ndarray) -> tuple[float, float]:
    """Mean variance left after outcomes (rows), by weighting the draws (columns), and its standard error."""
    weight = np.exp(log_likelihoods - log_likelihoods.max(axis=1, keepdims=True))
    weight /= weight.sum(axis=1, keepdims=True)
    left = weight @ answer**2 - (weight @ answer) ** 2
    return float(left.mean() / answer.var()), float(left.std() / np.sqrt(len(left)) / answer.var())


@pytest.fixture(scope="module")
def wide(fit):
    """Draws about those of the on-body fit that scatter more, so that angles tell something too."""
    return pretended(fit.dataset, fit.draws().flat_z.mean(axis=0), n=6400)


@pytest.mark.parametrize(
    ("kind", "answer"),
    [("efficiency", "optimal-length"), ("efficiency", "mu3"), ("angle", "squeezed_sheath_angle_b")],
)
def test_the_expected_reduction_is_what_weighting_the_draws_by_each_outcome_gives(wide, kind, answer):
    """Within 4.5 standard errors of 400 outcomes: a false alarm in fewer than 1 of 10 000 runs of the three cases.

    Draws are weighted by the likelihood of the reading, written down here anew; about half of the squeezed sheath's angles
    are too small to detect there.
    """
    length = 490.0
    ranking = rank_measurements(wide, answer, [format_candidate(Candidate(kind, length))])
    model, z = wide.model, wide.draws().flat_z
    curves = for_each_draw(curve_function(model, np.array([length])), model.space.size)(z)
    shown = {k: v.ravel() for k, v in wide.draws().values.items()}
    generator = np.random.default_rng(11)
    outcomes = generator.choice(len(z), 400, replace=False)
    total = np.zeros((len(outcomes), len(z)))
    if kind == "efficiency":
        loss, tau = -np.log(curves["efficiency"][:, 0]), shown["tau"]
        reading = (loss + tau * generator.standard_normal(len(z)))[outcomes]
        total = stats.norm.logpdf(reading[:, None], loss, tau)
    else:
        sd = shown["sigma_theta"]
        for name in model.cable.curves:
            reading = (curves[name][:, 0] + sd * generator.standard_normal(len(z)))[outcomes, None]
            seen = stats.norm.logpdf(reading, curves[name][:, 0], sd)
            total += np.where(reading > LIMIT, seen, stats.norm.logcdf((LIMIT - curves[name][:, 0]) / sd))
    left, error = _left_by_weighting(ranking.answer.draws, total)
    (ranked,) = ranking.ranked
    assert abs((1 - ranked.share) - left) < 4.5 * np.hypot(error, ranked.error)
    assert ranked.share > 0.02  # something to compare


def test_an_angle_that_cannot_be_detected_tells_nothing(on_body):
    dataset = load_dataset(on_body, ["tables.angles.detection_limit.value=179"])
    model = build_model(dataset)
    z = 0.1 * np.random.default_rng(1).standard_normal((64, model.space.size))
    (reading,) = simulate_readings(model, dataset.measurements, [Candidate("angle", 470.0)], z, 1)
    assert reading.shape == (64, 1, 2)
    np.testing.assert_allclose(reading, 179.0)


def test_readings_of_the_published_geometry_are_of_the_curves_that_hold_there(on_body):
    dataset = load_dataset(on_body, ['geometry="published"'])
    model = build_model(dataset)
    z = 0.1 * np.random.default_rng(1).standard_normal((8, model.space.size))
    candidates = [Candidate("angle", length) for length in (440.0, 470.0, 520.0)]
    readings = simulate_readings(model, dataset.measurements, candidates, z, 1)
    assert [r.shape[2] for r in readings] == [1, 2, 1]


def _quiet(design: Design = DESIGN, **more: Any) -> tuple[Dataset, Model]:
    """A cable whose load cells read almost without noise."""
    sensors = {"input_gain_error_sd": 0, "output_gain_error_sd": 0.02, "force_noise": {"value": 1e-6, "unit": "N"}}
    description = cable(2, sensors=sensors, **more)
    dataset = Dataset(description, empty_tables(description, design), {})
    return dataset, build_model(dataset)


def _runs(dataset: Dataset, model: Model, *values: dict[str, float], repeats: int = 1) -> np.ndarray:
    """Runs at 500 mm of each cable, repeats by columns."""
    middle = {p.name: float(p.prior.constrain(jnp.zeros(()))) for p in model.space.free}
    z = np.array([model.space.unconstrain(middle | value) for value in values])
    (runs,) = simulate_readings(model, dataset.measurements, [Candidate("force", 500.0)], z, 1, repeats=repeats)
    return runs


def test_a_run_of_both_strokes_tells_the_exponent_free_of_the_gain_error():
    """Noise is made negligible: the gain error is all in the difference of the strokes, and in the mean of a pull alone."""
    without, both = _runs(*_quiet(), *({"tau": 1e-9, "gain_error": g} for g in (1e-9, 0.03)))[:, 0]
    np.testing.assert_allclose(both - without, [0.0, 0.03], atol=1e-5)
    ((pulled,),) = _runs(*_quiet(other_design(strokes=("pull",))), {"tau": 1e-9, "gain_error": 0.03})
    np.testing.assert_allclose(pulled, [without[0] + 0.03], atol=1e-5)


def test_every_repeat_of_a_run_is_mounted_anew():
    """The scatter of 400 runs is tau: known to 3.5 %, and more than 15 % off in fewer than 1 of 10 000 runs."""
    dataset, model = _quiet()
    (runs,) = _runs(dataset, model, {"tau": 0.05}, repeats=400)
    assert runs[:, 0].std() == pytest.approx(0.05, rel=0.15)
    assert runs[:, 1].std() < 1e-4  # both strokes of a run are of one mounting


def test_a_run_where_friction_depends_on_the_load_also_tells_how_it_changes_with_it():
    dataset, model = _quiet(friction_model="drag")
    ((run,),) = _runs(dataset, model, {"drag": 2.0})
    assert len(run) == 3  # mean, difference of the strokes, slope with the load
    assert -0.1 < run[2] < -0.001  # drag makes friction look larger at small loads


def test_long_runs_are_joined_into_few_readings_that_count_for_more():
    design = other_design(input_forces=tuple(np.linspace(20.0, 90.0, 100)))
    run = typical_run(empty_tables(cable(1), design))
    assert len(run.input_force) == 24
    assert run.n_effective.sum() == 200
    assert typical_run(empty_tables(cable(1, ("angles", "efficiencies")), DESIGN)) is None


def test_a_run_like_those_recorded_so_far_has_the_noise_of_blocks(on_body):
    dataset = load_dataset(on_body.parent / "synthetic-recordings")
    run = typical_run(dataset.measurements)
    assert run.noise == "sigma_block"
    assert set(run.stroke) == {-1.0, 1.0}
    assert len(run.input_force) == 24 < run.n_effective.sum()
    candidates = list_candidates(Fit(dataset, None, None, True, (), Provenance(1, {})))  # type: ignore[arg-type]
    assert {c.kind for c in candidates} == {"angle", "force"}
    assert Candidate("force", 430.0) in candidates


# Candidates -------------------------------------------------------------------------------------------------------


def test_by_default_candidates_are_what_the_tables_can_hold(fit):
    names = [format_candidate(c) for c in list_candidates(fit)]
    lengths = range(430, 540, 10)
    assert names == [f"angle@{length}" for length in lengths] + [f"efficiency@{length}" for length in (*lengths, 540, 550)]


def test_a_cable_without_a_route_is_measured_again_at_its_wrap_angles():
    clamp = {"name": "housing", "friction": "mu", "wrap_angle": {"column": "clamp_angle"}}
    description = cable(1, ("forces",), contact=[clamp], route=None)
    design = make_design(runs=(0.0,) * 3, input_forces=(20.0, 60.0), own_angles={"clamp_angle": (30.0, 90.0, 180.0)})
    dataset = Dataset(description, empty_tables(description, design), {})
    fit = pretended(dataset, {"mu": 0.1, "tau": 0.01, "sigma_F": 0.5}, n=3200)
    assert [format_candidate(c) for c in list_candidates(fit)] == ["force@30deg", "force@90deg", "force@180deg"]
    ranking = rank_measurements(fit)
    assert ranking.answer.name == "mu"
    assert ranking.best.name == "force@180deg"  # the same error of the exponent is least of the largest angle
    assert "wrap angles in the columns" not in render_text(ranking_blocks(ranking, 5))


def test_elastic_cables_have_stretch_preload_and_loop_readings():
    description = elastic_cable()
    dataset = Dataset(description, empty_tables(description, make_design(**ELASTIC)), {})
    fit = pretended(dataset, ELASTIC_TRUTH, n=3200)  # in shown units, which here are the internal ones
    names = [format_candidate(c) for c in list_candidates(fit)]
    assert {name.partition("@")[0] for name in names} == {"stretch", "preload", "loop"}
    assert all("," in name for name in names if not name.startswith("preload"))
    candidates = ["stretch@90deg,50N", "stretch@0deg,0.1kN", "preload@1.5rad", "loop@90deg,30N"]
    ranking = rank_measurements(fit, "stiffness", candidates)
    assert {r.name for r in ranking.ranked} == {
        "stretch@90deg,50N",
        "stretch@0deg,100N",
        "preload@85.9437deg",
        "loop@90deg,30N",
    }
    assert ranking.ranked[0].candidate.kind == "stretch"
    assert [r.words for r in ranking.ranked if r.candidate.kind == "loop"] == [
        "the loop's output force at 90 deg under 30 N"
    ]


def test_what_is_proposed_where_nothing_is_offered_can_be_asked(on_body):
    """Of a catheter no displacement can be simulated, but an efficiency at a bend can."""
    dataset = load_dataset(on_body.parent / "synthetic-catheter")
    fit = pretended(dataset, np.zeros(build_model(dataset).space.size), n=3200)
    with pytest.raises(UsageError, match=r"\(displacement\) cannot be simulated") as refused:
        rank_measurements(fit)
    proposed = re.search(r"such as (.*)\.$", str(refused.value))[1].split(" or ")
    assert proposed == ["efficiency@90deg"]
    assert [r.name for r in rank_measurements(fit, candidates=proposed).ranked] == proposed


def test_what_is_not_understood_is_answered_with_a_name_that_is(fit):
    dataset = load_dataset(Path(__file__).parents[3] / "datasets" / "synthetic-haptic-loop")
    loop = pretended(dataset, np.zeros(build_model(dataset).space.size), n=10)
    for of, kinds in ((fit, ("angle", "efficiency")), (loop, ("stretch", "preload", "loop"))):
        for kind in kinds:
            with pytest.raises(UsageError) as refused:
                parse_candidates(of, [f"{kind}@3s"])
            (name,) = re.findall(rf"{kind}@[^ ]*\d\w*(?=, with units|\.$)", str(refused.value))
            (candidate,) = parse_candidates(of, [name])
            assert format_candidate(candidate) == name


@pytest.mark.parametrize("text", ["angle@450", "efficiency@470", "efficiency@550"])
def test_a_candidate_is_read_as_it_is_named(fit, text):
    (candidate,) = parse_candidates(fit, [text])
    assert format_candidate(candidate) == text
    assert f"{candidate.route:g} mm" in describe_candidate(fit, candidate)


def test_lengths_may_have_units(fit):
    assert parse_candidates(fit, ["angle@47cm", "angle@470 mm", "angle@470"]) == (Candidate("angle", 470.0),)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("angel@450", "did you mean 'angle'"),
        ("angle@550", "outside the range of the curves, 430 to 530 mm"),
        ("angle", "needs the cable length"),
        ("angle@45deg", "says nothing about an angle"),
        ("efficiency@600", "no angles were measured there"),
        ("efficiency@abc", "is not a number with its unit"),
        ("efficiency@470,50N", "says nothing about an efficiency"),
        ("efficiency@470kg", "says nothing about an efficiency"),
        ("efficiency@470furlongz", "is not known"),
        ("force@470", "name an efficiency instead"),
        ("stretch@90deg,50N", "fit with a table of stretch"),
        ("stretch@90deg", "needs a load greater than zero"),
        ("preload@-90deg", "needs wrap angles without a sign"),
        ("preload", "needs a wrap angle"),
        ("loop@470,30N", "only a pull-pull loop"),
    ],
)
def test_candidates_that_make_no_sense_are_refused_in_a_sentence(fit, text, sentence):
    with pytest.raises(UsageError) as refused:
        parse_candidates(fit, [text])
    assert sentence in str(refused.value)
    assert repr(text) in str(refused.value)


# The ranking ------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def for_length(fit):
    return rank_measurements(fit)


def test_for_the_best_length_efficiencies_far_from_it_are_worth_most(for_length):
    """At the best length the efficiency does not change with it; at the ends it tells which of the two slopes is steeper."""
    share = {r.name: r.share for r in for_length.ranked}
    assert for_length.best.name in ("efficiency@430", "efficiency@530")
    assert share["efficiency@470"] < 0.02 < share["efficiency@510"] < share["efficiency@530"] + 0.05
    assert max(value for name, value in share.items() if name.startswith("angle")) < 0.03


def test_for_the_coefficient_of_the_bracket_edge_the_length_of_least_other_friction_is_best(fit):
    ranking = rank_measurements(fit, "mu3", [f"efficiency@{length}" for length in (430, 450, 480, 510, 530)])
    assert ranking.best.name == "efficiency@480"


def test_an_efficiency_is_best_known_by_measuring_it(on_body):
    """By a fit that has converged; by the few draws of a quick one another length may seem better."""
    fit = bf.fit(on_body, seed=1, figures=False)
    ranking = rank_measurements(fit, "efficiency@500", [f"efficiency@{length}" for length in (430, 470, 500, 530)])
    assert ranking.best.name == "efficiency@500"
    assert ranking.answer.unit == "points"
    assert ranking.repeats.to_halve(ranking.answer.sd) is not None


def test_the_standard_deviation_falls_from_step_to_step_and_with_every_repeat(for_length):
    assert for_length.answer.sd > for_length.best.sd == for_length.plan[0].sd
    sds = [step.sd for step in for_length.plan]
    assert len(sds) == 3
    assert sds == sorted(sds, reverse=True)
    assert list(for_length.repeats.sd) == sorted(for_length.repeats.sd, reverse=True)
    assert for_length.repeats.sd[0] == pytest.approx(for_length.best.sd, rel=0.05)


def test_the_ranking_is_in_order_and_says_what_is_as_good(for_length):
    shares = [r.share for r in for_length.ranked]
    noticeable = [r.is_noticeable for r in for_length.ranked]
    assert noticeable == sorted(noticeable, reverse=True)
    assert shares[: sum(noticeable)] == sorted(shares[: sum(noticeable)], reverse=True)
    assert for_length.ranked[0].as_good
    assert not for_length.ranked[-1].as_good
    alike = [r for r in for_length.ranked[1:] if r.as_good]
    assert ("would do equally well" in render_text(ranking_blocks(for_length, 3))) == bool(alike)


def test_costs_change_the_ranking_but_do_not_bring_up_what_does_nothing(fit):
    named = ["angle@470", "efficiency@430", "efficiency@510"]
    ranking = rank_measurements(fit, None, named, {"angle": 1e-6, "efficiency": 5.0})
    assert ranking.best.name == "efficiency@430"
    assert ranking.ranked[-1].name == "angle@470"
    assert ranking.best.worth == pytest.approx(ranking.best.share / 5)
    assert "for its cost" in render_text(ranking_blocks(ranking, 5))


@pytest.mark.parametrize(
    ("costs", "sentence"),
    [
        ({"angle": 1.0}, "nothing of efficiency"),
        ({"angle": 1.0, "efficiency": 1.0, "force": 2.0}, "no candidate is of this kind"),
        ({"angle": 0.0, "efficiency": 1.0}, "write a positive number"),
    ],
)
def test_costs_that_make_no_sense_are_refused(fit, costs, sentence):
    with pytest.raises(UsageError, match=sentence):
        rank_measurements(fit, None, ["angle@450", "efficiency@450"], costs)


@pytest.mark.parametrize(
    ("wanted", "sentence"),
    [
        ("mu9", "is not an answer of this fit"),
        ("efficiency", "does not say where"),
        ("efficiency@600", "outside the range 430 to 530 mm"),
    ],
)
def test_answers_that_there_are_not_are_refused(fit, wanted, sentence):
    with pytest.raises(UsageError, match=sentence):
        rank_measurements(fit, wanted)


def test_where_nothing_helps_that_is_what_is_said(fit):
    text = render_text(ranking_blocks(rank_measurements(fit, None, ["angle@470"]), 5))
    assert text.startswith("None of these measurements would narrow the best cable length noticeably")
    assert "--candidate" in text


def test_the_advice_comes_first_and_in_one_sentence(for_length):
    first = " ".join(render_text(ranking_blocks(for_length, 4)).split("\n\n", maxsplit=1)[0].split())
    best, answer = for_length.best, for_length.answer
    assert first.startswith(
        f"Measure {best.words} next, after remounting the cable. That would narrow the best cable length from ± "
        f"{answer.sd:.1f} mm to ± {best.sd:.1f} mm."
    )
    assert "You may stop: any cable length from 4" in first
    assert "After it, " in first
    page = render_text(ranking_blocks(for_length, 30))
    assert not [fault for fault in faults(page, lines=60) if "no answer" not in fault]


# The command line -------------------------------------------------------------------------------------------------


def test_the_command_prints_the_ranking_and_writes_its_folder(folder, tmp_path, run):
    named = [part for length in (430, 470, 510) for part in ("--candidate", f"efficiency@{length}")]
    code, out, err = run("next", folder, *named, "--top", 2, "--output", tmp_path / "plan")
    assert code == 0
    assert "and 1 more, ranked lower; --top 3 shows all" in out
    written = sorted(path.name for path in (tmp_path / "plan").iterdir())
    assert written == ["captions.txt", *(f"next_measurement.{ending}" for ending in ("json", "pdf", "png", "svg", "txt"))]
    assert (tmp_path / "plan" / "next_measurement.txt").read_text() == out
    assert err.count("Wrote") == len(written) - 1  # captions go with the figure


def test_the_command_gives_json(folder, run):
    code, out, _ = run("next", folder, "--for", "mu3", "--candidate", "efficiency@480", "--json")
    page = json.loads(out)
    assert code == 0
    assert page["answer"]["name"] == "mu3"
    assert page["best"] == page["candidates"][0]["candidate"] == "efficiency@480"
    assert 0.05 < page["candidates"][0]["variance_reduction"] < 0.6
    assert page["repeats"]["times"][0] == 1


def test_the_command_refuses_in_a_sentence(folder, run):
    code, _, err = run("next", folder, "--cost", "angle")
    assert code == 2
    assert "is not a kind and a number" in err
    code, _, err = run("next", folder, "--candidate", "force@470")
    assert code == 2
    assert "--candidate 'force@470'" in err


def test_a_fit_without_a_posterior_is_told_to_sample(on_body_squares):
    with pytest.raises(UsageError, match="no posterior"):
        verb.next_measurement(on_body_squares)


# Against refits ---------------------------------------------------------------------------------------------------


def _with_efficiency(dataset: Dataset, length: float, reading: float) -> Dataset:
    rows = dataset.measurements.table(EfficiencyTable)
    n = len(rows.route) + 1
    nothing = np.full((n, len(rows.own.names)), np.nan)
    table = EfficiencyTable(
        np.append(rows.route, length), np.append(rows.efficiency, reading), np.zeros(n),
        OwnAngles(rows.own.names, nothing, nothing), _origin(n),
    )  # fmt: skip
    return replace(dataset, measurements=dataset.measurements.with_tables(table))


def _with_angles(dataset: Dataset, length: float, reading: np.ndarray) -> Dataset:
    rows = dataset.measurements.table(AngleTable)
    angle = np.vstack([rows.angle, np.deg2rad(reading)])
    table = AngleTable(np.append(rows.route, length), rows.names, angle, np.full(angle.shape, np.nan), _origin(len(angle)))
    return replace(dataset, measurements=dataset.measurements.with_tables(table))


def _origin(n: int) -> RowOrigin:
    return RowOrigin(("test",), np.zeros(n, dtype=int), np.arange(2, n + 2))


@pytest.mark.slow
def test_refits_with_the_readings_added_narrow_the_best_length_as_expected():
    """Mean of 10 refits a candidate, each within 4.5 standard errors: a false alarm in fewer than 1 of 20 000 runs.

    The refits are by the package's own sampler, whose draws give a variance to 5 % or so; the best candidate, which is so by
    far, must be that of the refits too.
    """
    design = make_design(angles=(420.0, 470.0, 500.0, 540.0, 590.0), efficiencies=(440.0, 500.0, 560.0))
    dataset, _ = measured(cable(2, ("angles", "efficiencies")), 3, design=design)
    laboratory, density = Laboratory(), LogDensity(build_model(dataset))
    z = laboratory.draws(density, 1)
    length = for_each_draw(make_optimizer(density.model), density.model.space.size)
    initial, generator = length(z)[0], np.random.default_rng(2)
    candidates = [Candidate("efficiency", 400.0), Candidate("efficiency", 500.0), Candidate("angle", 500.0)]
    readings = simulate_readings(density.model, dataset.measurements, candidates, z, 1)
    realized, expected = {}, {}
    for candidate, reading in zip(candidates, readings, strict=True):
        expected[candidate] = explained_share(reading[:, 0], initial).share
        left = []
        for k, draw in enumerate(generator.choice(len(z), 10, replace=False)):
            add = _with_efficiency if candidate.kind == "efficiency" else _with_angles
            value = reading[draw, 0, 0] if candidate.kind == "efficiency" else reading[draw, 0]
            terms = build_model(add(dataset, candidate.route, value)).terms
            extended = LogDensity(Model(density.model.cable, density.model.space, terms))
            left.append(np.var(length(laboratory.draws(extended, k))[0]) / np.var(initial))
        realized[candidate] = 1 - np.mean(left), np.std(left) / np.sqrt(10)
    for candidate, (share, error) in realized.items():
        assert abs(share - expected[candidate]) < 4.5 * np.hypot(error, 0.02), (candidate, realized, expected)
    assert max(expected, key=expected.__getitem__) == max(realized, key=lambda c: realized[c][0])


def test_an_interval_after_an_outcome_is_as_wide_as_the_conditional_one():
    rng = np.random.default_rng(3)
    answer = rng.normal(size=5_000)
    readings = (0.8 * answer[:, None] + 0.6 * rng.normal(size=(5_000, 2)))[..., None]
    widths = widths_after_outcomes(readings, answer)
    assert np.median(widths) == pytest.approx(2 * 1.645 * 0.6, rel=0.05)
    assert np.quantile(widths, 0.95) < 2.5


def test_the_range_after_a_second_mounting_is_the_same_for_every_seed():
    """Though the tail of tau is so long that standard deviations have no limit."""
    rng, stated_sds = np.random.default_rng(4), []
    for _ in range(4):
        tau = 0.02 * np.abs(rng.standard_cauchy(5_000))
        mu = 0.1 - tau * rng.standard_normal(5_000)
        readings = (mu + tau * rng.standard_normal((3, 5_000))).T[..., None]
        stated_sds.append(np.quantile(widths_after_outcomes(readings, mu), (0.05, 0.5, 0.95)))
    assert np.ptp(np.log(stated_sds), axis=0) == pytest.approx([0, 0, 0], abs=0.35)


@pytest.mark.parametrize(
    ("width", "printed"), [(0.0367, "0.04"), (0.0162, "0.016"), (0.0951, "0.1"), (23.4, "20"), (0.0, "0")]
)
def test_widths_are_printed_to_digits_that_stand(width, printed):
    assert format_width(width) == printed


@pytest.mark.parametrize("runs", [1, 2])
def test_a_fit_of_one_mounting_is_told_to_mount_the_cable_anew(tmp_path, runs):
    rng, rows = np.random.default_rng(4), ["run,stroke,input_force_N,output_force_N"]
    for run in range(runs):
        mounting = rng.normal(0, 0.02)
        for stroke, force in itertools.product((1, -1), (20, 50, 100)):
            output = force * np.exp(-stroke * (0.12 * np.pi + mounting)) * (1 + rng.normal(0, 0.004))
            rows.append(f"r{run},{'pull' if stroke > 0 else 'return'},{force},{output:.4f}")
    (tmp_path / "table.csv").write_text("\n".join(rows) + "\n")
    fit = bf.fit(tmp_path / "table.csv", wrap_angle="180deg", seed=1)
    ranking = bf.next_measurement(fit)
    second = ranking.second_mounting
    text = " ".join(str(ranking).split())
    if runs == 1:
        assert second is not None
        assert second.low < second.width < second.high
        assert second.width < second.width_now
        assert text.startswith("Remount the cable and measure a force run next: all readings come from one mounting")
        assert "uncertainty lower by" not in text
        assert "Next: remount the cable" in " ".join(str(fit).split())
    else:
        assert second is None
        assert "Remount the cable" not in text
