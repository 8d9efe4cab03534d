"""Comparison of fits: leave-one-out against exact answers, its fall-backs, weights, and what is said of it."""

import json
from dataclasses import replace

import jax
import numpy as np
import pytest
from cables import cable, measured
from offline_browser import browser, opened
from scipy import stats

import bowdenfit as bf
from bowdenfit.errors import DescriptionError, UsageError
from bowdenfit.inference.comparison import (
    ElpdDifference,
    LooPrediction,
    compare_predictions,
    psis_loo,
    stacking_weights,
)
from bowdenfit.inference.leave_one_out import REFIT, LooDensity, LooRefits, leave_one_out
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.inference.psis import Affine, find_best_map, match_moments, reliable_k
from bowdenfit.kinds.descriptions import make_design
from bowdenfit.kinds.efficiencies.kind import EfficiencyTable
from bowdenfit.models import build_model
from bowdenfit.questions.compare import comparison_figure
from bowdenfit.questions.compare.answer import Comparison
from bowdenfit.questions.compare.common_readings import CommonReadings, OmittedReadings, match_events
from bowdenfit.questions.compare.verb import VERB
from bowdenfit.questions.compare.words import comparison_page
from bowdenfit.questions.summary.verdict import NOT_CONVERGED, NOT_DESCRIBED
from bowdenfit.questions.writing import write_answer

pytestmark = pytest.mark.extended

QUICK = ("sampler.n_walkers=64", "sampler.target_ess=200", "sampler.target_r_hat=1.05", "sampler.max_steps=3000")
EDGE = {"name": "edge", "friction": "mu_edge", "wrap_angle": {"value": 45, "unit": "deg"}}
GRID = np.linspace(-4.5, 4.5, 301)
NO_RUN_EFFECT = {"tau": {"fixed": 0.0}}


@pytest.fixture(scope="module")
def outlier():
    """Eight efficiencies of one contact, the last far from the others: two parameters, so that integrals are exact."""
    description = cable(1, ("efficiencies",), contact=[EDGE])
    dataset, _ = measured(description, 3, design=make_design(efficiencies=tuple(np.linspace(400.0, 600.0, 8))))
    efficiency = dataset.measurements.table(EfficiencyTable).efficiency.copy()
    efficiency[-1] *= 0.93
    table = replace(dataset.measurements.table(EfficiencyTable), efficiency=efficiency)
    return LogDensity(build_model(replace(dataset, measurements=dataset.measurements.with_tables(table))))


@pytest.fixture(scope="module")
def on_a_grid(outlier):
    """Log likelihood of each reading on a grid of z, and the log prior there."""
    z = np.stack(np.meshgrid(GRID, GRID, indexing="ij"), axis=-1).reshape(-1, 2)
    pointwise = jax.jit(jax.vmap(lambda point, data: outlier.log_likelihoods(point, data)["efficiency"], (0, None)))(
        z, outlier.data
    )
    pointwise = np.asarray(pointwise)
    return z, pointwise, -0.5 * np.sum(z**2, axis=1)


@pytest.fixture(scope="module")
def exact(on_a_grid):
    """Log predictive density of each reading, the others known, by quadrature."""
    _, pointwise, log_prior = on_a_grid
    total = log_prior + pointwise.sum(axis=1)

    def of(i):
        without = total - pointwise[:, i]
        top = without.max()
        return np.log(np.sum(np.exp(without - top + pointwise[:, i]))) - np.log(np.sum(np.exp(without - top)))

    return np.array([of(i) for i in range(pointwise.shape[1])])


@pytest.fixture(scope="module")
def posterior_draws(on_a_grid):
    """4000 independent draws of the posterior: points of the grid by their probability, moved inside their cell."""
    z, pointwise, log_prior = on_a_grid
    generator = np.random.default_rng(1)
    total = log_prior + pointwise.sum(axis=1)
    probability = np.exp(total - total.max())
    chosen = generator.choice(len(z), 4000, p=probability / probability.sum())
    return (z[chosen] + generator.uniform(-0.5, 0.5, (4000, 2)) * (GRID[1] - GRID[0])).reshape(4, 1000, 2)


@pytest.fixture(scope="module")
def readings(outlier):
    return LooDensity(outlier)


def leaving_out(readings, z, share=1.0, seed=5):
    return LooRefits(readings, z, readings.evaluate(z)[1], share, seed)


def test_leave_one_out_with_fall_backs_is_what_integrals_give(readings, posterior_draws, exact):
    """Fails by chance for one seed in 2000: eight readings within four standard errors, and 0.005 for the grid."""
    _, pointwise = readings.evaluate(posterior_draws.reshape(-1, 2))
    loo = leave_one_out(readings, posterior_draws, {"efficiency": pointwise.reshape(4, 1000, -1)}, 4000.0, 5)
    assert loo.how[-1] in {"moment matching", "refit"}
    assert loo.pareto_k[-1] > 0.7
    assert loo.how[:-1] == ("importance sampling",) * 7
    assert np.all(np.abs(loo.elpd - exact) < 4 * loo.error + 0.005)
    plain = psis_loo({"efficiency": pointwise.reshape(4, 1000, -1)}, 4000.0)
    assert abs(loo.elpd[-1] - exact[-1]) < abs(plain.elpd[-1] - exact[-1])


def test_a_fit_without_a_reading_gives_its_exact_density(readings, posterior_draws, exact):
    """Fails by chance for one seed in 15 000: two readings within four standard errors, and 0.005 for the grid."""
    for i in (0, 7):
        elpd, error, settled = leaving_out(readings, posterior_draws.reshape(-1, 2)).refit_without(i)
        assert settled
        assert 0 < error < 0.1
        assert elpd == pytest.approx(exact[i], abs=4 * error + 0.005)


def test_draws_of_a_fit_without_a_reading_are_those_of_its_posterior(readings, posterior_draws, on_a_grid):
    """Fails by chance for one seed in 4000: means and sds of two parameters within four standard errors."""
    z, pointwise, log_prior = on_a_grid
    log_density = log_prior + pointwise[:, :7].sum(axis=1)
    probability = np.exp(log_density - log_density.max())
    probability /= probability.sum()
    mean = probability @ z
    sd = np.sqrt(probability @ (z - mean) ** 2)
    chain = leaving_out(readings, posterior_draws.reshape(-1, 2)).chain_without(7)
    draws = chain.z.reshape(-1, 2)
    for i, name in enumerate(p.name for p in readings.posterior.model.space.free):
        error = chain.diagnostics[name].mcse_mean
        assert 0 < error < 0.1 * sd[i]
        assert draws[:, i].mean() == pytest.approx(mean[i], abs=4 * error)
        assert draws[:, i].std() == pytest.approx(sd[i], abs=4 * error)


def test_a_refit_that_is_stopped_too_early_is_called_rough(outlier, posterior_draws):
    hasty = LooDensity(outlier, REFIT.model_copy(update={"max_steps": 200}))
    _, _, settled = leaving_out(hasty, posterior_draws.reshape(-1, 2)).refit_without(7)
    assert not settled
    assert LooPrediction(np.zeros(2), np.array([0.9, 0.9]), how=("rough", "refit")).unreliable == 1


def test_moment_matching_finds_a_posterior_that_lies_elsewhere():
    """Conjugate: prior Normal(0, 1) in three dimensions, one reading of their sum, another of their difference.

    Without the first, the sum lies four standard deviations from where the draws are, and scatters by twice as much. Fails
    by chance for one seed in 10 000 (four standard errors).
    """
    generator = np.random.default_rng(2)
    directions, values, sds = np.array([[1.0, 1, 1], [1, -1, 0]]), np.array([4.0, 0.5]), np.array([1.0, 0.5])
    precision = np.eye(3) + (directions.T / sds**2) @ directions
    mean = np.linalg.solve(precision, (directions.T / sds**2) @ values)
    draws = generator.multivariate_normal(mean, np.linalg.inv(precision), 8000)

    def evaluate(point):
        terms = stats.norm.logpdf(values, point @ directions.T, sds)
        return terms.sum(axis=1) - 0.5 * np.sum(point**2, axis=1), terms[:, 0]

    truth = stats.norm.logpdf(4.0, 0.0, 2.0)
    density, likelihood = evaluate(draws)
    elpd, k, error = match_moments(draws, evaluate, 1.0)
    assert k < 0.5
    assert error < 0.1
    assert elpd == pytest.approx(truth, abs=4 * error)
    plain = psis_loo({"": likelihood[None, :, None]}, 8000.0)
    assert plain.pareto_k[0] > 0.7
    assert abs(plain.elpd[0] - truth) > 0.3
    transform = find_best_map(draws, density, evaluate, 1.0)
    np.testing.assert_allclose(transform.move_back(transform(draws)), draws, atol=1e-9)


def test_an_affine_map_knows_its_volume():
    transform = Affine(np.array([[2.0, 0.0], [1.0, 3.0]]), np.array([1.0, -1.0]), np.array([5.0, 5.0]))
    np.testing.assert_allclose(transform(np.array([[6.0, 5.0]])), [[8.0, 5.0]])
    assert transform.log_volume == pytest.approx(np.log(6.0))


def test_few_draws_ask_for_a_smaller_pareto_k():
    assert reliable_k(20_000) == 0.7
    assert reliable_k(400) == pytest.approx(1 - 1 / np.log10(400))
    assert reliable_k(5) == 0.0


@pytest.mark.filterwarnings("ignore:The inplace keyword:Warning")
def test_weights_are_those_of_arviz_and_do_not_mind_a_constant():
    arviz_base, arviz_stats = pytest.importorskip("arviz_base"), pytest.importorskip("arviz_stats")
    generator = np.random.default_rng(8)
    y = generator.normal(size=40)
    names, means = ("a", "b", "c"), (0.6, -0.7, 3.0)
    log_likelihood = {
        n: stats.norm.logpdf(y, m, 1.0) + np.zeros((4, 500, 1)) for n, m in zip(names, means, strict=True)
    }
    log_likelihood = {n: v + 1e-3 * generator.normal(size=v.shape) for n, v in log_likelihood.items()}
    predictions = {n: psis_loo({"y": v}, 2000.0) for n, v in log_likelihood.items()}
    weights = stacking_weights(predictions)
    trees = {
        n: arviz_base.from_dict({"posterior": {"x": generator.normal(size=(4, 500))}, "log_likelihood": {"y": v}})
        for n, v in log_likelihood.items()
    }
    theirs = arviz_stats.compare(trees)["weight"]
    assert sum(weights.values()) == pytest.approx(1.0)
    for name in names:
        assert weights[name] == pytest.approx(float(theirs[name]), abs=0.02)
    moved = {n: replace(p, elpd=p.elpd + 900.0) for n, p in predictions.items()}  # exp(900) is infinite
    assert stacking_weights(moved) == pytest.approx(weights, abs=1e-6)


def test_weights_prefer_the_model_that_readings_come_from():
    """80 readings from Normal(0, 1) against Normal(1, 1): the truth weighs less than 0.65 for fewer than one seed in 1000.

    (Of 3000 simulated sets of readings, none.)
    """
    y = np.random.default_rng(4).normal(size=80)
    k = np.zeros(80)
    weights = stacking_weights(
        {"right": LooPrediction(stats.norm.logpdf(y), k), "wrong": LooPrediction(stats.norm.logpdf(y, 1.0), k)}
    )
    assert weights["right"] > 0.65


def test_with_few_readings_two_standard_errors_lean_and_four_decide():
    assert ElpdDifference(9.0, 3.0, 0).verdict(20) == "leaning"
    assert ElpdDifference(9.0, 3.0, 0).verdict(200) == "clear"
    assert ElpdDifference(13.0, 3.0, 0).verdict(20) == "clear"
    assert ElpdDifference(3.9, 0.1, 0).verdict(200) == "open"
    assert ElpdDifference(50.0, float("nan"), 0).verdict(1) == "open"


def by_hand(pointwise, how=("importance sampling",) * 6):
    """A comparison of two fits without parameters, from what the better one gains by each reading."""
    n, labels = len(pointwise), tuple(("efficiency", f"{400 + 10 * i} mm") for i in range(len(pointwise)))
    predictions = {
        "good": LooPrediction(np.asarray(pointwise, dtype=float), np.full(n, 0.1), np.zeros(n), labels, how[:n]),
        "poor": LooPrediction(np.zeros(n), np.full(n, 0.1), np.zeros(n), labels, how[:n]),
    }
    names = dict.fromkeys(predictions, "capstan")
    return Comparison(
        compare_predictions(predictions), stacking_weights(predictions), predictions, (), names, {}, {}, {}
    )  # fmt: skip


def test_the_sentence_says_what_is_preferred_and_what_that_rests_on():
    def words(*args):
        return " ".join(str(by_hand(*args)).split())

    assert "The data prefer good over poor (score less by 12.1 ± 0.2)." in words([2.0, 2.1, 1.9, 2.0, 2.1, 2.0])
    assert "With 6 readings the standard errors tend to be too small." in words([2.0, 2.1, 1.9, 2.0, 2.1, 2.0])
    leaning = words([2.0, 0.2, 1.9, 2.5, 0.1, 0.3])
    assert "The data favor good over poor (score less by 7.0" in leaning
    assert "tends to be too small: not proof." in leaning
    alone = words([9.0, 0.2, -0.1, 0.2, 0.1, 0.3])
    assert "The data cannot distinguish good from poor" in alone
    assert "Prefer the simpler one." in alone
    assert "even 0 excludes no model." in alone
    assert "excludes no model" not in leaning
    assert "standard error unknown, with one reading" in words([3.0])
    rough = words([2.0, 2.1, 1.9, 2.0, 2.1, 2.0], ("rough", "refit", *("importance sampling",) * 4))
    assert "For 2 readings the fit without it did not converge" in rough
    assert "efficiency 410 mm fitted again fitted again" in rough


def test_a_fit_that_is_not_to_be_trusted_is_named_and_decides_the_exit_code():
    comparison = by_hand([2.0, 2.1, 1.9, 2.0, 2.1, 2.0])
    assert comparison.trusted
    assert VERB.reply(comparison, {"output": None}).exit_code == 0

    def replied(**troubles):
        reply = VERB.reply(replace(comparison, troubles=troubles), {"output": None})
        return reply.exit_code, " ".join(reply.text.split())

    code, text = replied(good=(NOT_DESCRIBED,))
    assert code == 3
    assert "good is not to be trusted: it is not a description of its readings. Predicting best among these" in text
    code, text = replied(poor=(NOT_DESCRIBED,))  # which is why it predicts worse
    assert code == 0
    assert "poor is not to be trusted" in text
    code, text = replied(poor=(NOT_CONVERGED, NOT_DESCRIBED))
    assert code == 3
    assert "Scores rest on its draws; fit it again with --resume before you compare." in text


def test_the_page_of_a_comparison_opens_without_a_fault(tmp_path):
    comparison = by_hand([2.0, 2.1, 1.9, 2.0, 2.1, 2.0], ("rough", "refit", *("importance sampling",) * 4))
    odd = {"good": "</title><script>alert(1)</script>"}
    renamed = {
        part: {odd.get(name, name): value for name, value in getattr(comparison, part).items()}
        for part in ("differences", "weights", "predictions", "descriptions")
    }
    comparison = replace(comparison, **renamed)
    write_answer(tmp_path, "comparison", comparison, "", {"comparison": comparison_figure}, page=comparison_page(comparison))
    with browser() as chromium, opened(chromium, tmp_path / "comparison.html", width=390) as reader:
        assert reader.faults() == []
        assert reader.page.locator("main img").count() == 1
        assert "The data prefer </title><script>alert(1)</script> over poor" in reader.page.locator("main").inner_text()
        assert reader.sheets() <= 6


def test_one_reading_that_makes_most_of_a_difference_is_named():
    comparison = by_hand([9.0, 1.0, 1.1, 0.9, 1.0, 1.2])
    comparison = replace(comparison, differences=comparison.differences | {"poor": ElpdDifference(14.2, 2.0, 0)})
    assert "Most of it comes from one reading, efficiency 400 mm (+9.0)." in " ".join(str(comparison).split())


@pytest.fixture(scope="module")
def mountings():
    """Twelve mountings of one cable, which differ by 3 %."""
    description = cable(1, ("forces",), contact=[EDGE])
    design = make_design(runs=tuple(np.linspace(400.0, 600.0, 12)), input_forces=(20.0, 40.0, 60.0, 80.0))
    return measured(description, 6, design=design, tau=0.03)[0]


def fitted(dataset, **changes):
    description = dataset.description
    sampler = description.sampler.model_copy(
        update={"n_walkers": 64, "target_ess": 300, "target_r_hat": 1.05, "max_steps": 3000}
    )
    settings = {"prior": {**description.prior, **changes.pop("prior", {})}, "sampler": sampler, **changes}
    return bf.fit(replace(dataset, description=description.model_validate({**dict(description), **settings})), seed=1)


@pytest.fixture(scope="module")
def by_run_effect(mountings):
    return {"with": fitted(mountings), "without": fitted(mountings, prior=NO_RUN_EFFECT)}


@pytest.mark.slow
def test_run_effects_that_are_there_are_preferred_to_none(by_run_effect):
    """Runs scatter by 0.03 where their own readings leave 0.004 open, so that none of 1500 simulated sets of twelve favors
    the model without; its weight passes a half for one set in 1000, and the difference is within chance for one in six.
    """
    comparison = bf.compare(by_run_effect)
    assert comparison.best == "with"
    assert comparison.weights["with"] > 0.45
    assert sum(comparison.weights.values()) == pytest.approx(1.0)
    text = " ".join(str(comparison).split())
    assert "capstan, no run effect" in text
    assert "(score less by" in text
    assert "A run of forces counts as one reading" in text
    assert "12 of run efficiency" in text


def test_fits_that_differ_in_a_prior_alone_are_said_to(by_run_effect, mountings):
    measured_apart = {"prior": {"lognormal": {"median": 0.2, "log_sd": 0.1}}}
    fits = {"with": by_run_effect["with"], "known": fitted(mountings, friction={"mu_edge": measured_apart})}
    comparison = bf.compare(fits)
    (other,) = comparison.other_priors
    assert comparison.other_priors[other] == ("mu_edge",)
    text = " ".join(str(comparison).split())
    assert f"{other} differs from {comparison.best} only in the prior of mu_edge" in text
    assert "Prefer the simpler one" not in text
    assert bf.compare(by_run_effect).other_priors == {}
    held = fitted(mountings, friction={"mu_edge": measured_apart}, prior={"tau": {"fixed": 0.03}})
    assert bf.compare({"none": by_run_effect["without"], "held": held}).other_priors == {}, "a value is held at another one"


def test_a_fit_with_a_fixed_parameter_is_loaded_as_it_was_saved(by_run_effect, tmp_path):
    by_run_effect["without"].save(tmp_path / "without")
    assert [p.name for p in bf.load(tmp_path / "without").model.space.fixed] == ["tau"]


def test_efficiencies_without_sd_need_a_run_effect(on_body):
    with pytest.raises(DescriptionError, match="row 3 has no standard deviation of its own"):
        build_model(bf.read(on_body, settings=("prior.tau.fixed=0",)))
    with pytest.raises(DescriptionError, match="cannot be negative"):
        build_model(bf.read(on_body, settings=("prior.tau.fixed=-0.1",)))


@pytest.fixture(scope="module")
def geometries(on_body, tmp_path_factory):
    folder = tmp_path_factory.mktemp("geometries")
    for geometry in ("continuous", "published"):
        settings = (*QUICK[:-1], "sampler.max_steps=20000")  # one fit in twenty takes more than 4000
        bf.fit(on_body, output=folder / geometry, seed=1, settings=settings, figures=False, geometry=geometry)
    return folder


@pytest.mark.slow
def test_published_and_continuous_geometry_are_compared_on_what_both_have(geometries, run):
    folder = geometries / "comparison"
    code, text, progress = run("compare", geometries / "continuous", geometries / "published", "--output", folder)
    assert code == 0
    words = " ".join(text.split())
    assert "Of wrap angle only 17 of 22 readings are compared" in words
    assert "continuous: below the limit, published: zeros, in the published regions" in words
    assert "4 of efficiency" in words
    assert "Influential readings (the fit would change without them) were left out by moment matching" in words
    assert progress == f"Wrote {folder}.\n"  # what is being left out is said in a terminal alone, where it goes again
    page = json.loads((folder / "comparison.json").read_text())
    assert sum(row["stacking_weight"] for row in page["fits"]) == pytest.approx(1.0)
    assert len(page["readings"]) == 21
    by_label = {row["label"]: row["fits"] for row in page["readings"]}
    # On which readings a fit leans so much that weights do not do is for the draws to say (several k are close to 0.7); but
    # weights serve exactly where k says so, for every reading of every fit.
    longer = {"moment matching", "refit"}
    leaned_on = [label for label, fits in by_label.items() if {fit["how"] for fit in fits.values()} & longer]
    assert leaned_on and all(label in text for label in leaned_on)
    for fit in (fit for fits in by_label.values() for fit in fits.values()):
        assert (fit["how"] == "importance sampling") == (fit["pareto_k"] <= 0.7), fit
    assert page["fits"][1]["elpd_difference"] == pytest.approx(page["fits"][0]["elpd"] - page["fits"][1]["elpd"])
    assert (folder / "comparison.txt").read_text() == text
    assert {p.name for p in folder.iterdir()} == {
        "comparison.html", "comparison.json", "comparison.txt", "comparison.png", "comparison.svg",
        "comparison.pdf", "captions.txt",
    }  # fmt: skip
    code, _, error = run("compare", geometries / "continuous", geometries / "published", "--output", folder)
    assert code != 0
    assert "holds a comparison already; add --force" in error
    code, _, error = run("compare", geometries / "continuous", geometries / "published", "--output", geometries)
    assert code != 0
    assert "exists and holds no comparison" in error


def test_the_order_of_tables_in_a_stored_fit_does_not_matter(geometries):
    fit = bf.load(geometries / "continuous")
    readings, of_table = LooDensity(LogDensity(fit.model)), fit.posterior.log_likelihood
    sound = [i for i, (_, label) in enumerate(readings.names) if "430" not in label and "at 4" in label]
    loo = [
        leave_one_out(readings, fit.posterior.z, tables, 2000.0, 1, sound)
        for tables in (dict(sorted(of_table.items())), dict(sorted(of_table.items(), reverse=True)))
    ]
    np.testing.assert_array_equal(loo[0].elpd, loo[1].elpd)
    assert len(sound) > 8
    assert all(table == "wrap_angle" for table, _ in loo[0].readings)


def test_fits_of_other_files_or_with_nothing_in_common_are_refused(geometries, by_run_effect, monkeypatch):
    fit = bf.load(geometries / "continuous")
    other = replace(fit, dataset=replace(fit.dataset, sha256=fit.dataset.sha256 | {"angles.csv": "0" * 64}))
    with pytest.raises(UsageError, match="not fitted to the same readings"):
        bf.compare({"a": fit, "b": other})
    strange = replace(fit, dataset=replace(by_run_effect["with"].dataset, sha256=fit.dataset.sha256))
    with pytest.raises(UsageError, match="not fitted to the same readings"):
        bf.compare({"a": fit, "b": strange})
    nothing = CommonReadings((), {}, (OmittedReadings("wrap_angle", 0, 26, "they are taken differently"),))
    monkeypatch.setattr("bowdenfit.questions.compare.common_readings.match_events", lambda *_: nothing)
    with pytest.raises(
        UsageError, match=r"no reading in common .* left out of the comparison: they are taken differently"
    ):
        bf.compare({"a": fit, "b": fit})


def test_whole_recordings_and_runs_are_not_the_same_readings(on_body, by_run_effect):
    folder = on_body.parent / "synthetic-recordings"
    data = {name: bf.read(folder, settings=(f"tables.recordings.likelihood={name}",)) for name in ("runs", "whole")}
    fits = {name: replace(by_run_effect["with"], dataset=dataset) for name, dataset in data.items()}
    common = match_events(fits, {name: {} for name in fits})
    assert {table for table, _ in common.readings} == {"wrap_angle"}
    (omitted,) = common.omitted
    assert omitted.sentence().startswith("All readings of recorded efficiency are left out of the comparison")
    assert "not the same readings" in omitted.why


@pytest.mark.slow
def test_every_reading_of_the_on_body_data_is_predicted_as_by_a_fit_without_it(on_body):
    """26 readings within five standard errors of both: chance of a false alarm below one in 10 000 while Pareto k stays
    below 0.5; between 0.5 and 0.7 the weights have no finite variance and a quarter of a nat is allowed besides.
    """
    fit = bf.fit(on_body, seed=1)
    readings = LooDensity(LogDensity(fit.model))
    effective = min(d.ess_bulk for d in fit.posterior.diagnostics.values())
    loo = leave_one_out(readings, fit.posterior.z, fit.posterior.log_likelihood, effective, 1)
    assert loo.unreliable == 0
    all_readings = leaving_out(readings, fit.posterior.flat_z, 0.15, 9)
    for i in range(len(loo.readings)):
        elpd, error, settled = all_readings.refit_without(i)
        assert settled, loo.readings[i]
        heavy = 0.25 if loo.pareto_k[i] > 0.5 else 0.0
        assert abs(elpd - loo.elpd[i]) < 5 * np.hypot(error, loo.error[i]) + heavy, loo.readings[i]
