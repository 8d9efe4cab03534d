"""What walking costs: against SciPy, against the paper's printed numbers, and how often its intervals hold the truth."""

import shutil
from pathlib import Path

import numpy as np
import pytest
from scipy import stats

import bowdenfit as bf
from bowdenfit.addons.metabolic.answer import analyze_study, find_contradictions, rounding_range
from bowdenfit.addons.metabolic.study import (
    MetabolicCosts,
    Study,
    brockway,
    half_width,
    mean_and_error,
    persons_needed,
    power,
    probability_below,
    read_study,
    smallest_detectable,
    t_from_p,
    two_sided_p,
)

PRINTED = Path(__file__).parents[3] / "datasets" / "on-body-metabolic"


def test_the_t_of_pairs_is_scipys():
    generator = np.random.default_rng(1)
    for persons in (2, 5, 12, 40):
        first, other = generator.normal(6, 0.3, (2, persons))
        mean, error = mean_and_error(first - other)
        reference = stats.ttest_rel(first, other)
        assert mean / error == pytest.approx(reference.statistic, rel=1e-12)
        assert two_sided_p(mean / error, persons) == pytest.approx(reference.pvalue, rel=1e-12)
        low, high = reference.confidence_interval(0.95)
        assert (mean - half_width(error, persons), mean + half_width(error, persons)) == pytest.approx((low, high), rel=1e-12)
        below = stats.ttest_rel(first, other, alternative="less").pvalue
        assert probability_below(mean, error, persons) == pytest.approx(1 - below, rel=1e-12)
        assert two_sided_p(t_from_p(0.03, persons), persons) == pytest.approx(0.03, rel=1e-12)


def test_power_is_that_of_simulated_studies():
    """Within 4 standard errors of 20,000 studies; by chance once in 16,000 runs."""
    generator = np.random.default_rng(2)
    d = generator.normal(0.8, 1.0, (20_000, 6))
    computed = np.mean(stats.ttest_1samp(d, 0.0, axis=1).pvalue < 0.05)
    assert abs(power(0.8, 6) - computed) < 4 * np.sqrt(computed * (1 - computed) / 20_000)
    needed = persons_needed(0.5)
    assert power(0.5, needed) >= 0.8 > power(0.5, needed - 1)
    assert persons_needed(1e-4) is None and persons_needed(0.0) is None and persons_needed(50.0) == 2
    for effect in (0.01, 0.1, 1.0, 3.0):
        needed = persons_needed(effect)
        assert power(effect, needed) >= 0.8 > power(effect, needed - 1)
    for persons in (2, 5, 1000):
        assert power(smallest_detectable(persons), persons) == pytest.approx(0.8)


def test_brockways_equation_is_the_literatures():
    assert brockway(1000.0, 800.0) == pytest.approx((16.58 * 1000 + 4.51 * 800) / 60)  # J/ml
    assert brockway(60.0, 0.0, 0.01) == pytest.approx(16.58 - 5.90 * 0.01 * 1000 / 60)


@pytest.mark.extended
@pytest.mark.parametrize(("studies", "least", "most"), [(400, 362, 395), pytest.param(1000, 922, 976, marks=pytest.mark.slow)])
def test_intervals_hold_the_truth_in_ninety_five_of_a_hundred_studies(studies, least, most):
    """Of so many studies of five persons; outside these by chance once in ten thousand runs."""
    generator, held = np.random.default_rng(3), 0
    study = Study(schema=1, name="made")
    for _ in range(studies):
        person = generator.normal(6.0, 0.3, (5, 1))
        net = person + np.array([0.0, -0.3]) + generator.normal(0, 0.15, (5, 2))
        (comparison,) = analyze_study(study, MetabolicCosts(tuple("abcde"), ("without", "with"), net)).comparisons
        held += comparison.low <= -0.3 <= comparison.high
    assert least <= held <= most


def test_the_printed_study_shows_what_it_can_show():
    answer = bf.metabolic(PRINTED)
    by_pair = {(comparison.condition, comparison.less): comparison for comparison in answer.comparisons}
    assert by_pair["550 mm", "no exoskeleton"].is_significant and by_pair["470 mm", "no exoskeleton"].is_significant
    between = by_pair["470 mm", "550 mm"]
    assert not between.is_significant and between.lower == pytest.approx(0.889, abs=1e-3)
    assert 0.85 < between.lower_doubted < 0.87 and between.needed == 21
    assert by_pair["550 mm", "no exoskeleton"].share == pytest.approx(-0.0619, abs=5e-5)
    assert len(answer.contradictions) == 2
    assert "-6.98 % for 550 mm does not follow" in answer.contradictions[0] and "-6.19 %" in answer.contradictions[0]
    assert "No mean of no exoskeleton gives both" in answer.contradictions[1]
    text = str(answer)
    assert "470 mm is not significantly lower than 550 mm" in text and "same order" in text
    assert max(len(line.encode()) for line in text.splitlines()) <= 80


def test_numbers_that_go_together_contradict_nothing():
    study, _ = read_study(PRINTED)
    right = [
        comparison.model_copy(update={"percent": "-6.19"} if comparison.percent == "-6.98" else {})
        for comparison in study.difference
    ]
    assert not list(find_contradictions(study.model_copy(update={"difference": tuple(right)})))
    wild = study.difference[0].model_copy(update={"p": "0.9", "percent": None})
    (message,) = find_contradictions(study.model_copy(update={"difference": (wild,)}))
    assert "contradicts their standard errors" in message
    assert rounding_range("-6.98") == pytest.approx((-6.985, -6.975)) and rounding_range("6.3") == pytest.approx((6.25, 6.35))


def table_of(folder, rows, *lines):
    shutil.copytree(PRINTED, folder, dirs_exist_ok=True)
    (folder / "metabolic.toml").write_text('schema = 1\nname = "made"\ntable = "persons.csv"\n' + "\n".join(lines))
    (folder / "persons.csv").write_text("\n".join(rows) + "\n")
    return folder


def test_gas_becomes_net_cost(tmp_path):
    rows = ["person,condition,VO2_ml_per_min,VCO2_ml_per_min,mass_kg"]
    for i, who in enumerate("abc"):
        rows += [f"{who},rest,300,250,70", f"{who},without,{1500 + 20 * i},1300,70", f"{who},with,{1400 + 35 * i},1250,70"]
    (comparison,) = bf.metabolic(table_of(tmp_path / "gas", rows, 'rest = "rest"')).comparisons
    expected = [(16.58 * (-100 + 15 * i) + 4.51 * -50) / 60 / 70 for i in range(3)]
    assert (comparison.condition, comparison.less) == ("with", "without") and comparison.difference == pytest.approx(
        np.mean(expected)
    )


@pytest.mark.parametrize(
    ("rows", "lines", "message"),
    [
        (["person,condition,net_W_per_kg", "a,x,6", "a,x,7"], [], "a appears twice for x"),
        (["person,condition,net_W_per_kg", "a,x,6", "a,y,7"], [], "1 persons and 2 conditions"),
        (["person,condition,cost", "a,x,6"], [], "has no column VO2_ml_per_min"),
        (["person,condition,VO2_ml_per_min,VCO2_ml_per_min,mass_kg", "a,x,9,9,9", "b,x,9,9,9"], [], "in which persons rested"),
        (["person,condition,net_W_per_kg", "a,x,6", "b,x,", "b,y,7"], [], "blank"),
        (["person,condition,net_W_per_kg"], ["persons = 0"], "persons is wrong"),
        (["person,condition,net_W_per_kg"], ['[[condition]]\nname = "a"\nmean = 6.3'], "written as text with all their digits"),
    ],
)
def test_wrong_tables_are_refused_in_a_sentence(run, tmp_path, rows, lines, message):
    code, _, error = run("metabolic", table_of(tmp_path / "wrong", rows, *lines))
    assert code == 2 and message in " ".join(error.split())


def test_printed_numbers_that_are_not_enough_are_refused(tmp_path, run):
    for text, message in (("", "number of persons"), ("persons = 5", "nothing can be compared")):
        (tmp_path / "metabolic.toml").write_text(f'schema = 1\nname = "made"\n{text}\n')
        code, _, error = run("metabolic", tmp_path)
        assert code == 2 and message in " ".join(error.split())
    assert run("metabolic", tmp_path / "nowhere")[0] == 2
