"""The gate on figures of answers: all that `check`, `identify`, `next`, `compare` and `calibrate` draw can be read."""

import importlib
from pathlib import Path

import numpy as np
import pytest
from figure_words import assert_answer_readable

import bowdenfit as bf
from bowdenfit.inference.comparison import LooPrediction, compare_predictions, stacking_weights
from bowdenfit.inference.identifiability import Combination, CovarianceAnalysis, ParameterContraction
from bowdenfit.inference.interval import Interval
from bowdenfit.inference.profiles import Profile
from bowdenfit.kinds.candidate import Candidate
from bowdenfit.questions.calibrate.answer import QuantityLabel
from bowdenfit.questions.calibrate.rank_tests import summarize_replications
from bowdenfit.questions.calibrate.replications import RankedTruth, Replication
from bowdenfit.questions.check import prior_figure
from bowdenfit.questions.check.prior_predictive import predict_from_priors
from bowdenfit.questions.compare.answer import ComparedParameter, Comparison
from bowdenfit.questions.figure_files import write_figure
from bowdenfit.questions.figures import FIGURES
from bowdenfit.questions.identify.answer import Identifiability
from bowdenfit.questions.next.answer import NextMeasurement, RankedCandidate, TargetQuantity
from bowdenfit.questions.next.candidates import has_candidates
from bowdenfit.questions.watch.answer import History, WatchedAnswer
from bowdenfit.results.answer_cache import CAPTIONS

pytestmark = pytest.mark.extended

ROOT = Path(__file__).parents[2]
SETS = sorted(path.parent for path in (ROOT / "datasets").glob("*/cable.toml"))
FILES = {
    path.stem: importlib.import_module(".".join(path.relative_to(ROOT).with_suffix("").parts))
    for folder in ("questions", "addons")
    for path in (ROOT / "bowdenfit" / folder).rglob("*_figure.py")
}
LONG = "a_cable_with_a_name_that_is_as_long_as_names_of_files_may_well_be_in_some_laboratories"
NAME = LONG.replace("_", " ")  # of a cable; those of fits are names of folders, and shown as they are


def calibration(names, wrong, truths=()):
    """Of quantities with these names, of which one has intervals that are too narrow, or none."""
    generator, made = np.random.default_rng(1), []
    for i in range(60):
        ranks = {n: generator.beta(0.2, 0.2) if n == wrong else generator.uniform() for n in names}
        ranked = {n: RankedTruth(0.0, generator.normal(), 1.0, rank) for n, rank in ranks.items()}
        made.append(Replication(i, {}, (), ranked, 1.0))
    shown = {n: QuantityLabel(n.replace("_", " ")) for n in names}
    return summarize_replications(tuple(made), shown, name=NAME, seed=1, assumed=(), truths=truths)


def comparison(n_fits, n_readings, label):
    """Of fits with long names, of readings with a label each."""
    generator = np.random.default_rng(2)
    fits = [f"{NAME} {i}" for i in range(n_fits)]
    tables = ["run_efficiency", "run_efficiency", *["wrap_angle"] * (n_readings - 3), "stretch"]
    labels = tuple((table, label.format(i)) for i, table in enumerate(tables))
    how = ("importance sampling",) * n_readings
    predictions = {
        fit: LooPrediction(
            generator.normal(i, 1.0, n_readings), np.full(n_readings, 0.1), np.zeros(n_readings), labels, how
        )
        for i, fit in enumerate(fits)
    }
    wide = {fit: Interval.of(generator.normal(0.123, 0.01, 500)) for fit in fits}
    parameters = {f"mu{i}": ComparedParameter(rf"$\mu_{i}$", "1", wide) for i in range(5)}
    lengths = {fit: (Interval.of(generator.normal(471.0, 4.0, 500)), "mm") for fit in fits}
    return Comparison(
        compare_predictions(predictions), stacking_weights(predictions), predictions, (),
        dict.fromkeys(fits, "capstan"), parameters,
        lengths, {},
    )  # fmt: skip


def knowledge(names):
    """Of parameters with these names."""
    sums = tuple(
        Combination({n: 1.0 / (1 + abs(i - j)) for j, n in enumerate(names)}, 0.1, 0.01, 0.9 ** (1 + i) / 10)
        for i in range(len(names))
    )
    parameters = tuple(ParameterContraction(n, 0.1, 0.05, 0.1, "", 0.0, 1.0) for n in names)
    return CovarianceAnalysis(parameters, (), sums, (), None, 1.0)


def identifiability(*groups):
    """Of groups of parameters, with a profile for each of the first."""
    values = np.linspace(0.00012, 0.00029, 21)
    profiles = tuple(Profile(n, values, 12 * np.linspace(-1, 1, 21) ** 2) for n in groups[0])
    reference = {f"group {i}": knowledge(names) for i, names in enumerate(groups)}
    return Identifiability(NAME, "the least-squares estimate", True, reference, profiles)


def ranking(candidates, scale, words):
    """Of candidates, each the better the earlier it stands."""
    ranked = tuple(
        RankedCandidate(
            c, f"{c.kind}@{i}", words.format(i), 0.3 / (i + 1), 0.01, scale * (1 - 0.1 / (i + 1)), 0.001 * scale, i == 0
        )
        for i, c in enumerate(candidates)
    )
    answer = TargetQuantity("optimal-length", "the best cable length", "mm", scale * np.array([-1.0, 1.0]))
    return NextMeasurement(answer, ranked, None, (), "Cable length (mm)", (430.0, 530.0), True)


def history(counts, words, unit):
    """Of an answer that is known the better the more mountings there are; trusted, and good enough, from the second half on."""
    generator, half = np.random.default_rng(3), counts[len(counts) // 2]
    answers = [
        WatchedAnswer(
            NAME, count, 3 * count, words, words, unit, Interval.of(generator.normal(471.0, 20 / count, 500)),
            count > half, "", {} if count > half else None,
        )
        for count in counts
    ]  # fmt: skip
    return History(tuple(answers))


MANY = tuple(f"mu_{LONG}_{i}" for i in range(8))
ROUTE = [Candidate(kind, 430.0 + 10 * i) for i in range(12) for kind in ("efficiency", "angle")]
LOADS = [Candidate("loop", load=5.0 * i, angles=(1.0,)) for i in range(30)]
ANSWERS = {
    "two quantities": (("coverage", "ranks", "sharpness"), lambda: calibration(("mu", "tau"), "")),
    "one of many wrong": (("coverage", "ranks", "sharpness"), lambda: calibration(("mu", "tau", *MANY), "tau")),
    "truths stated": (("coverage",), lambda: calibration(("mu",), "mu", ("mu = 0.1",))),
    "two fits": (("comparison",), lambda: comparison(2, 4, "{} mm")),
    "seven fits": (("comparison",), lambda: comparison(7, 40, "squeezed_sheath_angle at {} mm")),
    "many readings": (("comparison",), lambda: comparison(3, 400, "{} mm")),
    "one coefficient": (("identifiability",), lambda: identifiability(("mu",))),
    "many coefficients": (
        ("identifiability",),
        lambda: identifiability(MANY, (*MANY, *(f"{n}b" for n in MANY), *"abcdefg")),
    ),
    "along a route": (("next",), lambda: ranking(ROUTE, 5.2, "the efficiency at {} mm")),
    "small numbers": (("next",), lambda: ranking(LOADS, 6.5e-5, "the loop's output force at 180 deg under {} N")),
    "one mounting": (("history",), lambda: history([1], "mu", "")),
    "forty mountings": (("history",), lambda: history([*range(1, 41)], "the best cable length", "mm")),
    "large numbers, long words": (("next",), lambda: ranking(LOADS, 6.5e5, NAME + " {}")),
}


@pytest.mark.parametrize("of", ANSWERS)
def test_figures_of_answers_can_be_read(of):
    names, make = ANSWERS[of]
    computed = make()
    for name in names:
        assert_answer_readable(FILES[f"{name}_figure"], computed, NAME)


@pytest.mark.parametrize("name", ["on-body-exoskeleton", "synthetic-haptic-loop", "yarn-on-cylinder"])
def test_the_figure_of_the_priors_can_be_read(name):
    assert_answer_readable(prior_figure, predict_from_priors(bf.read(ROOT / "datasets" / name), 1), NAME)


def test_no_figure_of_an_answer_is_left_out():
    looked_at = {f"{name}_figure" for names, _ in ANSWERS.values() for name in names} | {"prior_figure"}
    looked_at |= {"compensation_figure", "compensation_traces_figure", "teleoperation_figure"}  # beside their fits
    looked_at |= {"metabolic_figure"}  # beside its study
    looked_at |= {"likelihood_figure"}  # of a profile or a contour, in tests/questions/identify
    assert looked_at | {f"{name}_figure" for name in FIGURES} == set(FILES)


def test_each_figure_is_written_in_three_formats_beside_its_caption(tmp_path):
    """A second figure in the folder leaves the caption of the first, and the same again replaces it."""
    computed, folder = calibration(("mu", "tau"), ""), tmp_path / "new"
    for name in ("coverage", "ranks", "coverage"):
        write_figure(FILES[f"{name}_figure"], computed, folder, name, computed.name)
    endings = ("pdf", "png", "svg")
    assert {p.name for p in folder.iterdir()} == {
        CAPTIONS,
        *(f"{n}.{e}" for n in ("coverage", "ranks") for e in endings),
    }
    first, second = (folder / CAPTIONS).read_text().split("\n\n")
    assert first.startswith("coverage: Coverage of the intervals: how often they contain the true value")
    assert second.startswith("ranks: Where the true values fall within their estimated distributions")


@pytest.mark.slow
@pytest.mark.parametrize("folder", SETS, ids=lambda path: path.name)
def test_figures_of_answers_on_every_data_set_can_be_read(folder, tmp_path):
    fit = bf.fit(folder, output=tmp_path / "fit", seed=1, figures=False)
    assert_answer_readable(prior_figure, predict_from_priors(fit.dataset, 1), fit.name)
    assert_answer_readable(FILES["identifiability_figure"], bf.identify(fit), fit.name)
    named = (
        () if has_candidates(fit) else ("efficiency@180deg", "efficiency@540deg")
    )  # of a catheter no displacement can be
    assert_answer_readable(FILES["next_figure"], bf.next_measurement(fit, candidates=named), fit.name)
    calibrated_again = bf.calibrate(folder, replications=20, seed=1, output=tmp_path / "calibration")
    for name in ("coverage", "ranks", "sharpness"):
        assert_answer_readable(FILES[f"{name}_figure"], calibrated_again, fit.name)
