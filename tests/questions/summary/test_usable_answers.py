"""Answers that may be used although not every coefficient is determined, and when not even the best length may."""

import json
import subprocess
import sys

import numpy as np
import pytest

import bowdenfit as bf
from bowdenfit.questions.summary.brief import summary_text
from bowdenfit.questions.summary.usable_answers import weights_for_moved_prior

CABLE = """
name = "two contacts"
[route]
variable = "cable_length"
unit = "mm"
range = [400, 600]
[tables.angles]
file = "angles.csv"
[tables.forces]
file = "forces.csv"
[[contact]]
name = "long bend"
friction = "mu1"
wrap_angle = { curve = "line", column = "falling", departure = "none" }
[[contact]]
name = "short bend"
friction = "mu2"
wrap_angle = { curve = "line", column = "rising", departure = "none" }
"""


def write_bench(folder, rising_ends, places):
    """A bench of which one angle falls from 120 to 30 deg and the other rises [deg]; made without the package."""
    folder.mkdir(exist_ok=True)
    rng, x = np.random.default_rng(4), np.linspace(0, 1, 11)
    angles = {"falling": 120 - 90 * x, "rising": np.interp(x, [0, 1], rising_ends)}
    lines = ["cable_length_mm,falling_deg,rising_deg"]
    lines += [
        f"{400 + 200 * place:.0f},{a + rng.normal(0, 1):.2f},{b * (1 + rng.normal(0, 0.02)):.2f}"
        for place, a, b in zip(x, angles["falling"], angles["rising"], strict=True)
    ]
    (folder / "angles.csv").write_text("\n".join(lines) + "\n")
    lines = ["run,cable_length_mm,stroke,input_force_N,output_force_N"]
    for run, place in enumerate(places):
        bends = np.deg2rad([120 - 90 * place, np.interp(place, [0, 1], rising_ends)])
        exponent = bends @ [0.12, 0.1] + 0.005 * rng.normal()
        for force in (40, 80, 120):
            scatter = 1 + 0.003 * rng.standard_normal(2)
            forces = force * scatter * [1, np.exp(-exponent)]
            lines.append(f"{run},{400 + 200 * place:.0f},pull,{forces[0]:.3f},{forces[1]:.3f}")
    (folder / "forces.csv").write_text("\n".join(lines) + "\n")
    (folder / "cable.toml").write_text(CABLE)
    return folder


@pytest.fixture(scope="module")
def hardly_any_short_bend(tmp_path_factory):
    """Results of a bench whose short bend loses hardly anything: its coefficient is open, and the longest sheath the best."""
    folder = tmp_path_factory.mktemp("short")
    bf.fit(write_bench(folder / "bench", (0.5, 1.0), (0.1, 0.5, 0.9)), seed=1, figures=False, output=folder / "fit")
    return folder / "fit"


def run_summary(results, *options):
    """Exit code and page of `bowdenfit summary`."""
    command = [sys.executable, "-m", "bowdenfit", "summary", str(results), *options]
    run = subprocess.run(command, capture_output=True, text=True, check=False)
    return run.returncode, " ".join(run.stdout.split())


@pytest.fixture(scope="module")
def one_place(tmp_path_factory):
    """A fit of a bench read at one length, where both bends are long: which one rubs is open, and so is the best length."""
    folder = tmp_path_factory.mktemp("place")
    return bf.fit(write_bench(folder, (5.0, 120.0), (0.5, 0.5, 0.5)), seed=1, figures=False)


def test_a_length_that_does_not_hang_on_the_open_coefficient_may_be_used(hardly_any_short_bend):
    code, page = run_summary(hardly_any_short_bend)
    assert code == 0
    assert "You can trust the best length and the efficiency there" in page
    assert "mu2 by itself rests on its prior. Do not use it by itself." in page
    assert "NOT DETERMINED: friction, short bend" in page and "NOT DETERMINED: friction, long bend" not in page
    summary = json.loads((hardly_any_short_bend / "summary.json").read_text())
    assert summary["verdict"]["answers"] == {"best_length": True, "efficiency": True, "coefficients_to_leave": ["mu2"]}


def test_who_asks_for_coefficients_is_refused_them_first(hardly_any_short_bend):
    code, page = run_summary(hardly_any_short_bend, "--for", "coefficients")
    assert code == 3
    assert page.startswith("two contacts: DO NOT USE THESE NUMBERS: the measurements do not determine every coefficient.")


def test_where_no_length_is_surely_good_enough_numbers_hold_but_not_the_design(one_place):
    verdict = one_place.verdict()
    assert verdict.answers["best_length"] is False and not verdict.may_be_used_for("design")
    page = " ".join(summary_text(one_place).split())
    assert "measure more before you cut" in page and "Which length is good enough they do not show yet." in page


def test_predictions_rest_on_every_coefficient(hardly_any_short_bend):
    command = [sys.executable, "-m", "bowdenfit", "predict", str(hardly_any_short_bend), "450"]
    run = subprocess.run(command, capture_output=True, text=True, check=False)
    assert run.returncode == 3 and "Warning: this fit is not identifiable" in run.stderr


@pytest.mark.parametrize("move", [0.5, -0.5])
def test_weights_are_those_of_a_moved_prior(move):
    z = np.random.default_rng(3).standard_normal(40_000)
    weights = weights_for_moved_prior(z, move)
    assert weights.sum() == pytest.approx(1)
    mean = weights @ z
    assert (mean, weights @ (z - mean) ** 2) == pytest.approx((move, 1.0), abs=5 * np.exp(0.125) / np.sqrt(len(z)))


def test_weights_that_rest_on_a_few_draws_are_none():
    assert weights_for_moved_prior(np.random.default_rng(3).standard_normal(300), 3.0) is None
