"""Simulation-based calibration: ranks, verdicts, and wrong likelihoods that it must catch."""

import json
import pickle
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from multiprocessing import get_context

import numpy as np
import pytest
from cables import CONTACTS, DESIGN, cable, other_design
from conftest import ROOT
from offline_browser import browser, opened
from scipy import stats
from spoiled_input import copied

from bowdenfit.dataset import Dataset, load_dataset
from bowdenfit.description import Description, SamplerSettings
from bowdenfit.errors import StoreError
from bowdenfit.inference.batch.programs import BatchSettings
from bowdenfit.kinds.descriptions import make_design
from bowdenfit.kinds.kind import Design
from bowdenfit.multiple_testing import adjust_p_values
from bowdenfit.questions.calibrate import coverage_figure, ranks_figure, sharpness_figure
from bowdenfit.questions.calibrate.answer import Calibration, QuantityLabel
from bowdenfit.questions.calibrate.calibration import CalibrationJob, run_piece, split_into_pieces
from bowdenfit.questions.calibrate.rank_tests import UniformRanks, summarize_replications
from bowdenfit.questions.calibrate.replications import RankedTruth, Replication, append_replication, open_replications
from bowdenfit.questions.calibrate.replicator import BatchFitter, CalibrationPlan, Replicator
from bowdenfit.questions.calibrate.words import calibration_page, details_text, draw_calibration
from bowdenfit.questions.simulate.tables import empty_tables
from bowdenfit.questions.writing import write_page

pytestmark = pytest.mark.extended

QUICK = SamplerSettings(n_ensembles=2, n_walkers=32, max_steps=1000, target_ess=100, target_r_hat=1.1)


def data_set(name: str) -> Dataset:
    return load_dataset(ROOT / "datasets" / name)


# Ranks -------------------------------------------------------------------------------------------------------------


def test_p_values_of_uniform_ranks_are_uniform_and_agree_with_the_band():
    """Of 400 samples of 100: the share below 0.05 is rejected by a binomial test at 1e-4, by chance once in 10 000 seeds."""
    by_chance, generator = UniformRanks(100), np.random.default_rng(1)
    low, high = by_chance.band(0.95)
    rejected, outside = 0, 0
    for _ in range(400):
        sample = generator.uniform(size=100)
        share = by_chance.count_below(sample) / 100
        out = bool(np.any((share < low) | (share > high)))
        p = by_chance.p_value(sample)
        rejected, outside = rejected + (p <= 0.05), outside + out
        assert out == (p < 0.05) or abs(p - 0.05) < 0.02
    assert stats.binomtest(rejected, 400, 0.05).pvalue > 1e-4
    assert stats.binomtest(outside, 400, 0.05).pvalue > 1e-4


def test_ranks_heaped_in_the_middle_or_at_an_end_are_not_uniform():
    spread = np.linspace(0.01, 0.99, 100)
    by_chance = UniformRanks(100)
    assert by_chance.p_value(spread) > 0.9
    assert by_chance.p_value(0.5 + 0.6 * (spread - 0.5)) < 0.001
    assert by_chance.p_value(spread**2) < 0.001


def test_holm_s_correction_is_the_textbook_s():
    assert adjust_p_values([0.01, 0.04, 0.03, 0.005]) == pytest.approx([0.03, 0.06, 0.06, 0.02])
    assert adjust_p_values([0.6, 0.9]).tolist() == [1.0, 1.0]


def replications(n: int, sd: float = 1.0, shift: float = 0.0, seed: int = 0, bad: int = 0) -> list[Replication]:
    """Replications of a normal posterior whose stated spread is `sd` times the right one, shifted by `shift` of it."""
    generator = np.random.default_rng(seed)
    results = []
    for i in range(n):
        error = 0.3 * generator.standard_normal() + 0.3 * shift
        ranked = RankedTruth(0.0, error, 0.3 * sd, float(stats.norm.cdf(-error / (0.3 * sd))))
        reasons = ("R-hat of mu is 1.2 and should be below 1.03",) if i < bad else ()
        results.append(
            Replication(i, {"an efficiency is below 20 %": 1} if i % 7 == 0 else {}, reasons, {"mu": ranked}, 2.0)
        )
    return results


def test_right_intervals_are_called_calibrated():
    """By chance, ranks or coverage of the one quantity are called wrong once in fifty seeds or less."""
    calibration = summarize_replications(replications(200), {"mu": QuantityLabel(r"$\mu$")})
    (mu,) = calibration.quantities
    assert calibration.is_calibrated
    assert mu.shrinkage == pytest.approx(1 - 0.09)
    assert "CALIBRATED: for this description" in str(calibration)
    assert "29 simulated data sets were drawn again" in str(calibration)


@pytest.mark.parametrize(
    ("sd", "shift", "fault"),
    [(0.5, 0.0, "intervals too narrow"), (2.0, 0.0, "intervals too wide"), (1.0, 0.7, "estimated too high")],
)  # fmt: skip
def test_wrong_intervals_are_said_to_be_wrong_in_their_direction(sd, shift, fault):
    calibration = summarize_replications(replications(200, sd, shift), {})
    assert not calibration.is_calibrated
    assert fault in calibration.faults["mu"]
    text = str(calibration)
    assert "NOT CALIBRATED" in text
    assert f"- mu: {calibration.faults['mu']}." in text.replace("\n  ", " ")


def test_replications_that_did_not_converge_are_counted_and_named_and_too_many_leave_nothing_judged():
    calibration = summarize_replications(replications(100, bad=5), {})
    assert calibration.ranked == 95
    assert calibration.is_conclusive
    assert "5 replications did not converge and are not ranked (numbers 0, 1, 2, 3, 4)" in str(calibration)
    assert "they are, they would change nothing." in " ".join(str(calibration).split())
    spoiled = [
        replace(item, ranked={"mu": replace(item.ranked["mu"], rank=0.01)}) for item in replications(100, bad=10)[:10]
    ]
    suspect = summarize_replications([*spoiled, *replications(100, bad=10)[10:]], {})
    assert not suspect.faults
    assert suspect.faults_with_all == {"mu": "ranks are not uniform"}
    assert "mu (ranks are not uniform) would be wrong" in " ".join(str(suspect).split())
    worse = summarize_replications(replications(100, bad=30), {})
    assert not worse.is_calibrated
    assert "NOT JUDGED: 70 of 100" in str(worse)


def test_a_calibration_s_figures_show_every_quantity():
    calibration = summarize_replications(replications(50, 0.5), {"mu": QuantityLabel(r"$\mu$")})
    for file in (ranks_figure, coverage_figure, sharpness_figure):
        figure = file.draw(calibration)
        figure.canvas.draw()
        words = {text.get_text() for axes in figure.axes for text in (*axes.get_yticklabels(), axes.title)}
        assert any(r"$\mu$" in word for word in words)


# Kept as they end --------------------------------------------------------------------------------------------------

FINGERPRINT = {"description": {"name": "a"}, "sha256": {}, "seed": 3, "assumed": []}


def test_replications_are_kept_one_by_one_and_a_torn_line_is_made_again(tmp_path):
    folder = tmp_path / "new" / "calibration"
    made = replications(3)
    assert open_replications(folder, FINGERPRINT, resume=False, force=False) == {}
    for item in made:
        append_replication(folder, item)
    file = folder / "replications.jsonl"
    file.write_text(file.read_text()[:-20])
    assert open_replications(folder, FINGERPRINT, resume=True, force=False) == {0: made[0], 1: made[1]}
    append_replication(folder, made[2])
    assert open_replications(folder, FINGERPRINT, resume=True, force=False)[2] == made[2]


def test_another_seed_or_a_folder_of_something_else_is_refused(tmp_path):
    open_replications(tmp_path / "c", FINGERPRINT, resume=False, force=False)
    with pytest.raises(StoreError, match="the seed changed"):
        open_replications(tmp_path / "c", FINGERPRINT | {"seed": 4}, resume=True, force=False)
    append_replication(tmp_path / "c", replications(1)[0])
    with pytest.raises(StoreError, match="--resume, or start over with --force"):
        open_replications(tmp_path / "c", FINGERPRINT, resume=False, force=False)
    with pytest.raises(StoreError, match="holds no calibration to resume"):
        open_replications(tmp_path / "none", FINGERPRINT, resume=True, force=False)
    (tmp_path / "c" / "replications.jsonl").write_text("nothing\n")
    with pytest.raises(StoreError, match="damaged"):
        open_replications(tmp_path / "c", FINGERPRINT, resume=True, force=False)
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "notes.txt").write_text("mine")
    with pytest.raises(StoreError, match="holds no calibration"):
        open_replications(tmp_path / "other", FINGERPRINT, resume=False, force=True)
    assert (tmp_path / "other" / "notes.txt").read_text() == "mine"


def test_what_failed_before_its_first_replication_is_begun_anew_without_force(tmp_path):
    open_replications(tmp_path / "c", FINGERPRINT, resume=False, force=False)
    (tmp_path / "c" / "jobs").mkdir()
    assert open_replications(tmp_path / "c", FINGERPRINT | {"seed": 4}, resume=False, force=False) == {}
    assert json.loads((tmp_path / "c" / "replications.jsonl").read_text())["seed"] == 4
    (tmp_path / "c" / "calibration.json").write_text("{}")
    with pytest.raises(StoreError, match="--force"):
        open_replications(tmp_path / "c", FINGERPRINT, resume=False, force=False)


# Whole calibrations ------------------------------------------------------------------------------------------------

FRICTION = {"prior": {"lognormal": {"median": 0.12, "log_sd": 0.4}}}
SMALL_NOISE = {"sigma_F": {"prior": {"half_normal": {"sd": 0.3}}}}


def calibrated(plan: CalibrationPlan, n: int, **changes: object) -> Calibration:
    bench = Replicator(plan, BatchFitter(BatchSettings(QUICK, target_sd_error=np.inf)), **changes)
    return summarize_replications(list(bench.replicate(range(n))), {})


def designed(description: Description, design: Design) -> Dataset:
    return Dataset(description, empty_tables(description, design), {})


def two_coefficients(**prior: object) -> Dataset:
    """Runs of 40 samples over a known angle and one read with every run; nothing but the mounting limits the coefficients."""
    friction = dict.fromkeys(("mu_edge", "mu_clamp"), FRICTION)
    contacts = [CONTACTS[2], CONTACTS[4]]
    description = cable(2, ("forces",), contact=contacts, friction=friction, prior=SMALL_NOISE | prior)
    return designed(
        description,
        other_design(input_forces=tuple(np.linspace(40.0, 90.0, 40)), strokes=("pull",)),
    )


def test_a_small_calibration_of_the_right_likelihood_passes():
    """Of forces with a run effect, twelve times; it fails by chance for one seed in fifty or less."""
    dataset = two_coefficients()
    calibration = calibrated(CalibrationPlan(dataset, dataset, 5), 12)
    assert not calibration.faults, calibration.faults
    assert {q.name for q in calibration.quantities} >= {"mu_edge", "mu_clamp", "tau", "sigma_F"}


@pytest.mark.slow
def test_a_small_calibration_catches_samples_of_a_run_taken_for_independent():
    """Without the run effect intervals are several times too narrow: twelve replications reject a coefficient at 0.01.

    A right likelihood would be rejected once in a hundred seeds.
    """
    wrong = two_coefficients(tau={"fixed": 1e-6})
    calibration = calibrated(CalibrationPlan(two_coefficients(), wrong, 5), 12)
    assert calibration.quantities
    assert {"mu_edge", "mu_clamp"} & set(calibration.faults)
    assert "too narrow" in " ".join(calibration.faults.values())


def angles_alone(undetected: str) -> Dataset:
    """Angles that mostly fall below what can be detected, on a curve that falls along the route."""
    angles = {"file": "a.csv", "detection_limit": {"value": 20, "unit": "deg"}, "undetected": undetected}
    normal = {"free_angle_a": (-1.1, 0.2), "free_angle_b": (-1.2, 0.3)}
    prior = {name: {"prior": {"normal": {"mean": mean, "sd": sd}}} for name, (mean, sd) in normal.items()}
    prior |= {"sigma_theta": {"prior": {"lognormal": {"median": 2.0, "log_sd": 0.3}}}}
    return designed(cable(1, {"angles": angles}, prior=prior), make_design(angles=DESIGN.angles))


@pytest.mark.slow
def test_a_small_calibration_catches_zeros_in_the_place_of_angles_too_small_to_detect():
    """Zeros pull the curve down: eight replications reject a parameter at 0.01; a right likelihood, one seed in a hundred."""
    calibration = calibrated(CalibrationPlan(angles_alone("censored"), angles_alone("zero"), 5), 8)
    assert calibration.quantities
    assert calibration.faults


def test_a_replication_depends_on_its_number_alone():
    dataset = data_set("yarn-on-cylinder")
    plan = CalibrationPlan(dataset, dataset, 3)
    bench = Replicator(plan)
    _, second, _ = bench.replicate(range(3))
    (piece,) = pickle.loads(pickle.dumps(split_into_pieces(CalibrationJob(plan), [1], workers=2)))
    for (alone,) in (Replicator(plan, bench.laboratory).replicate([1]), run_piece(piece)):
        assert replace(alone, seconds=0.0) == replace(second, seconds=0.0)


def test_work_is_cut_so_that_all_replications_are_done_once():
    dataset = data_set("yarn-on-cylinder")
    numbers = list(range(3, 203))
    for workers, largest in ((1, 128), (2, 25), (50, 16)):
        pieces = split_into_pieces(CalibrationJob(CalibrationPlan(dataset, dataset, 3)), numbers, workers)
        assert [number for piece in pieces for number in piece.numbers] == numbers
        assert max(len(piece.numbers) for piece in pieces) == largest


def test_the_command_line_calibrates_resumes_and_says_when_too_few_replications_are_there(run, tmp_path):
    data, folder = ROOT / "datasets" / "yarn-on-cylinder", tmp_path / "c"
    begin = ("calibrate", data, "-o", folder, "-j", 1)
    code, out, err = run(*begin, "-n", 2, "--seed", 1)
    assert code == 3
    assert "NOT JUDGED: 2 of 2" in out
    assert f"Wrote {folder}." in err
    written = {path.relative_to(folder).as_posix() for path in folder.rglob("*.*")}
    figures = {f"figures/{name}.{e}" for name in ("ranks", "coverage", "sharpness") for e in ("png", "svg", "pdf")}
    texts = {"summary.txt", "details.txt", "figures/captions.txt", "calibration.json", "replications.jsonl", "report.html"}
    assert written == texts | figures
    assert (folder / "details.txt").read_text().startswith((folder / "summary.txt").read_text())
    code, _, err = run(*begin, "-n", 2)
    assert code == 2
    assert "--resume" in err
    code, out, _ = run(*begin, "-n", 3, "--resume", "--json")
    page = json.loads(out)
    assert code == 3
    assert (page["replications"], page["seed"]) == (3, 1)
    assert page["quantities"][0]["name"] == "mu"
    assert len((folder / "replications.jsonl").read_text().splitlines()) == 4


def test_the_page_of_a_calibration_opens_without_a_fault(tmp_path):
    quantity = QuantityLabel(r"$\mu$", meaning="friction of the sheath")
    calibration = replace(summarize_replications(replications(50), {"mu": quantity}), name="</title><script>alert(1)</script>")
    draw_calibration(calibration, tmp_path)
    path = write_page(calibration_page(calibration), tmp_path, tmp_path / "report.html")
    with browser() as chromium, opened(chromium, path, width=390) as reader:
        assert reader.faults() == []
        assert reader.page.locator("main img").count() == 3
        assert "CALIBRATED: for this description and these tables" in reader.page.locator("main").inner_text()
        (mu,) = calibration.quantities
        cells = reader.page.locator("details tbody td").all_text_contents()
        assert cells == ["friction of the sheath", f"{mu.p_value:.3f}", f"{mu.corrected:.3f}", f"{mu.shrinkage:.2f}"]
        assert all(cell in details_text(calibration) for cell in cells[1:])
        assert reader.sheets() <= 6


def test_an_interrupted_calibration_says_how_to_go_on(run, tmp_path, monkeypatch):
    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr("bowdenfit.questions.calibrate.replicator.Replicator.replicate", interrupted)
    code, _, err = run("calibrate", ROOT / "datasets" / "yarn-on-cylinder", "-o", tmp_path / "c")
    assert code == 130
    assert "run the same command with --resume" in err


def test_what_cannot_be_assumed_or_replicated_is_refused_in_a_sentence(run, tmp_path):
    data = ROOT / "datasets" / "on-body-exoskeleton"
    begin = ("calibrate", data, "-o", tmp_path / "c", "-n", 2, "-j", 1)
    code, _, err = run(*begin, "--assume", "tables.efficiencies.files=[]", "--seed", 1)
    assert code == 2
    code, _, err = run(*begin, "--assume", "friction.mu9.fixed=0.1")
    assert code == 2
    assert "mu9" in err
    assert not (tmp_path / "c").exists()


def test_a_table_that_only_the_assumption_names_is_refused(run, tmp_path):
    names = ("cable.toml", "angles.csv", "efficiencies.csv")
    folder = copied(ROOT / "datasets" / "on-body-exoskeleton", names, tmp_path / "cable")
    (folder / "forces.csv").write_text("cable_length_mm,run,input_force_N,output_force_N\n440,1,50,38\n470,2,50,40\n")
    assumption = 'tables.forces={file="forces.csv"}'
    code, _, err = run("calibrate", folder, "-o", tmp_path / "c", "-n", 2, "-j", 1, "--assume", assumption)
    assert code == 2
    assert "--assume changes which tables" in err


@pytest.mark.slow
def test_two_cores_and_two_processes_give_the_replications_that_one_gives():
    """The same ranks to the last digit."""
    from bowdenfit import calibrate

    data = ROOT / "datasets" / "yarn-on-cylinder"
    first, two = (calibrate(data, replications=40, workers=workers, seed=1) for workers in (1, 2))
    with ProcessPoolExecutor(2, get_context("spawn")) as executor:
        remaining = calibrate(data, replications=40, workers=2, seed=1, engine=executor)
    assert [q.ranks for q in first.quantities] == [q.ranks for q in two.quantities] == [q.ranks for q in remaining.quantities]
