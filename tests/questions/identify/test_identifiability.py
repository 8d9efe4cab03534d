"""What measurements determine: known answers, in words, and the verdict that follows."""

import json

import numpy as np
import pytest
from cables import LENGTHS, cable, measured

import bowdenfit as bf
from bowdenfit.inference.identifiability import analyze_covariance
from bowdenfit.kinds.descriptions import make_design, parse_description
from bowdenfit.questions.identify.verb import identify

pytestmark = pytest.mark.extended

PRIOR_SD = 0.7
QUICK = ("sampler.n_walkers=64", "sampler.target_ess=300", "sampler.target_r_hat=1.05", "sampler.max_steps=3000")
SET = [f"--set={setting}" for setting in QUICK]
TWO_CONTACTS = """
name = "Two turns"
[[contact]]
name = "half turn"
friction = "mu_a"
wrap_angle = { value = 180, unit = "deg" }
[[contact]]
name = "quarter turn"
friction = "mu_b"
wrap_angle = { value = 90, unit = "deg" }
[tables]
forces = { file = "forces.csv" }
"""


def seen_through(*rows: tuple[np.ndarray, float], prior_sd: np.ndarray) -> np.ndarray:
    """Covariance left by readings of weighted sums of parameters, each with its noise."""
    information = np.diag(1 / prior_sd**2)
    for weights, noise in rows:
        information = information + np.outer(weights, weights) / noise**2
    return np.linalg.inv(information)


def test_the_sum_that_was_measured_is_the_combination_found():
    """One reading of 2 a + 1.6 b: the combination is a + 0.8 b, and its sd is half the reading's."""
    prior_sd, value = np.array([1.0, 0.5]), np.array([1.0, 2.0])
    weights = np.array([2.0, 1.6])
    analysis = analyze_covariance(("a", "b"), value, seen_through((weights, 0.01), prior_sd=prior_sd), prior_sd)
    (together,) = analysis.determined
    assert together.words == "a + 0.8 b"
    assert together.value == pytest.approx(2.6)
    assert together.sd == pytest.approx(0.005, rel=1e-3)
    assert analysis.identified == ()
    assert analysis.undetermined is not None
    assert analysis.collinearity > 1e6


def test_parameters_read_one_by_one_are_known_by_themselves_and_others_rest_on_their_priors():
    prior_sd, value = np.full(3, PRIOR_SD), np.ones(3)
    rows = ((np.array([1.0, 0, 0]), 0.05), (np.array([0, 1.0, 0]), 0.7))
    analysis = analyze_covariance(("a", "b", "c"), value, seen_through(*rows, prior_sd=prior_sd), prior_sd)
    assert [p.name for p in analysis.identified] == ["a"]
    assert [p.name for p in analysis.partly_identified] == ["b"]
    assert [p.name for p in analysis.on_prior] == ["c"]
    assert [p.contraction for p in analysis.parameters] == pytest.approx([1 - 1 / (1 + 196), 0.5, 0.0], abs=1e-9)
    assert [p.inflation for p in analysis.parameters] == pytest.approx([1, 1, 1])


def test_information_of_each_direction_is_that_of_the_readings():
    """Two independent readings of sums: 9 and 4 times the prior's information along them, nothing along the third."""
    prior_sd = np.ones(3)
    q, _ = np.linalg.qr(np.random.default_rng(1).standard_normal((3, 3)))
    covariance = seen_through((q[0], 1 / 3), (q[1], 1 / 2), prior_sd=prior_sd)
    analysis = analyze_covariance(("a", "b", "c"), np.ones(3), covariance, prior_sd)
    assert [d.information for d in analysis.directions] == pytest.approx([9, 4, 0], abs=1e-9)


def test_a_plan_at_one_length_determines_one_sum_of_the_coefficients(tmp_path):
    """All wrap angles are constant, so every reading sees the same sum: pi mu_a + pi/2 mu_b."""
    plan = tmp_path / "plan.toml"
    plan.write_text(TWO_CONTACTS + "[design]\nruns = [0, 0, 0, 0]\ninput_forces = [20, 50, 100]\n")
    analysis = identify(plan)
    (together,) = analysis.groups["friction"].determined
    assert together.words == "mu_a + 0.5 mu_b"
    assert analysis.groups["friction"].undetermined is not None
    assert "nothing has been measured" in analysis.basis


def test_a_plan_with_more_runs_knows_more(tmp_path):
    sds = []
    for runs in ("[0, 0]", "[0, 0, 0, 0, 0, 0, 0, 0]"):
        plan = tmp_path / f"plan{len(sds)}.toml"
        plan.write_text(TWO_CONTACTS + f"[design]\nruns = {runs}\ninput_forces = [20, 50, 100]\n")
        sds.append(identify(plan).groups["friction"].determined[0].sd)
    assert sds[1] == pytest.approx(sds[0] / 2, rel=0.02)


@pytest.mark.slow
def test_the_judgment_before_sampling_agrees_with_the_fit(on_body):
    """The Fisher information at the maximum against draws: sds within a third (a funnel is not a normal).

    Before sampling mountings scatter by the prior's median, so it is one near what these four readings show.
    """
    scatter = "prior.tau.prior.half_normal.sd=0.02"
    initial = identify(on_body, settings=[scatter]).groups["friction"]
    fit = bf.fit(on_body, seed=3, settings=[scatter, *QUICK])
    after = identify(fit).groups["friction"]
    for p, q in zip(initial.parameters, after.parameters, strict=True):
        assert p.sd == pytest.approx(q.sd, rel=0.33), p.name
    assert [p.name for p in after.identified] == ["mu1", "mu2", "mu3"]


@pytest.fixture(scope="module")
def two_turns(tmp_path_factory):
    """A bench that cannot tell its two coefficients apart, because their wrap angles never change."""
    folder = tmp_path_factory.mktemp("two") / "turns"
    plan = folder.parent / "plan.toml"
    truth = "[truth]\nmu_a = 0.1\nmu_b = 0.15\ntau = 0.01\nsigma_F = 0.3\n"
    plan.write_text(TWO_CONTACTS + truth + "[design]\nruns = [0, 0, 0, 0, 0, 0]\ninput_forces = [20, 50, 100]\n")
    bf.simulate(plan, output=folder, seed=1)
    return folder


def test_coefficients_that_cannot_be_told_apart_are_not_trusted(two_turns, tmp_path, run):
    code, out, _ = run("fit", two_turns, "-o", tmp_path / "fit", "--seed", 1, "--no-figures", *SET)
    assert code == 3
    text = " ".join(out.split())
    assert "DO NOT USE THESE NUMBERS: the measurements do not determine every coefficient" in text
    assert "do not separate mu_a and mu_b: what they determine is mu_a + 0.5 mu_b" in text
    page = json.loads((tmp_path / "fit" / "summary.json").read_text())
    assert page["verdict"]["converged"] is True
    assert page["verdict"]["trusted"] is False
    code, out, _ = run("identify", tmp_path / "fit", "-o", tmp_path / "known")
    assert code == 0
    assert "mu_a + 0.5 mu_b to" in " ".join(out.split())
    assert (tmp_path / "known" / "identifiability.png").stat().st_size > 10_000


def test_a_coefficient_measured_separately_makes_the_other_known(two_turns, tmp_path, run):
    """Which the judgment before sampling foretells: its sds and those of draws agree within a third."""
    description = "friction.mu_b.measured={value=0.15,sd=0.01}"
    code, out, _ = run("fit", two_turns, "-o", tmp_path / "fit", "--seed", 1, "--no-figures", "--set", description, *SET)
    assert code == 0, out
    assert "You can trust this" in out
    initial = identify(two_turns, settings=[description]).groups["friction"]
    after = identify(bf.load(tmp_path / "fit")).groups["friction"]
    for p, q in zip(initial.parameters, after.parameters, strict=True):
        assert p.sd == pytest.approx(q.sd, rel=0.33), p.name
    assert [p.name for p in initial.identified] == [p.name for p in after.identified] == ["mu_a"]  # mu_b is as stated


def test_without_sampling_the_same_data_are_not_trusted_either(two_turns, tmp_path, run):
    code, out, _ = run("fit", two_turns, "-o", tmp_path / "fit", "--no-mcmc", "--no-figures")
    assert code == 3
    assert "do not determine mu_a and mu_b" in " ".join(out.split())


def test_a_fit_that_has_not_converged_is_not_trusted(on_body, tmp_path, run):
    settings = ["--set", "sampler.max_steps=200", "--set", "sampler.n_walkers=64"]
    code, out, _ = run("fit", on_body, "-o", tmp_path / "fit", "--seed", 1, "--no-figures", *settings)
    assert code == 3
    assert "DO NOT USE THESE NUMBERS: the fit has not converged" in " ".join(out.split())
    code, _, err = run("length", tmp_path / "fit")
    assert "not converged" in err


def test_tables_that_contradict_each_other_are_not_trusted(tmp_path, run):
    """Forces of a cable with mu = 0.1 beside efficiencies of one with 0.2; tau and its prior leave no room for both."""
    plan, folder = tmp_path / "plan.toml", tmp_path / "half turn"
    single = TWO_CONTACTS[: TWO_CONTACTS.rindex("[[contact]]")]
    truth = "[tables]\nforces = { file = 'forces.csv' }\n[truth]\nmu_a = 0.1\ntau = 0.01\nsigma_F = 0.3\n"
    plan.write_text(single + truth + "[design]\nruns = [0, 0, 0, 0, 0, 0, 0, 0]\ninput_forces = [20, 50, 100]\n")
    bf.simulate(plan, output=folder, seed=1)
    (folder / "efficiencies.csv").write_text(
        "efficiency\n0.53\n0.54\n0.53\n0.535\n0.54\n0.53\n0.53\n0.54\n0.53\n0.53\n"
    )
    text = (folder / "cable.toml").read_text()
    (folder / "cable.toml").write_text(
        text.replace("[tables]", "[tables]\nefficiencies = { file = 'efficiencies.csv' }")
    )
    code, out, _ = run("fit", folder, "-o", tmp_path / "fit", "--seed", 1, "--no-figures", "--no-mcmc")
    assert code == 3
    assert "DO NOT USE THESE NUMBERS: the measurements contradict each other" in " ".join(out.split())
    assert "standard deviations: without it mu_a would be" in " ".join(out.split())


def test_readings_of_a_plan_are_judged_with_its_curves():
    """Three coefficients and forces at one length only: one sum is determined, the coefficients are not."""
    design = make_design(angles=LENGTHS, runs=(430.0,) * 6, input_forces=(20.0, 60.0))
    data, _ = measured(cable(3), 1, design=design)
    analysis = identify(data).groups["friction"]
    assert analysis.undetermined is not None
    assert len(analysis.determined) == 1
    assert len(analysis.determined[0].weights) == 3


def test_a_fit_is_judged_as_it_was_read(quick_results, run):
    code, out, err = run("identify", quick_results, "--set", "friction.mu1.fixed=0.1")
    assert (code, out) == (2, "")
    assert "settings would change nothing: fit its data set again with that, or leave it out" in " ".join(err.split())


def test_a_missing_source_is_refused_in_a_sentence(tmp_path, run):
    code, _, err = run("identify", tmp_path / "nothing")
    assert code == 2
    assert "Traceback" not in err
    assert "nothing" in err


def test_the_template_of_two_turns_is_a_description():
    import tomllib

    assert len(parse_description(tomllib.loads(TWO_CONTACTS)).contact) == 2
