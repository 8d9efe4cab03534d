"""What is said of groups: their contrasts in summary, JSON and notebooks, and whether they differ at all."""

import json

import numpy as np
import pytest
from hand_bench import BENDS, pull
from terminal_pages import faults

import bowdenfit as bf

pytestmark = pytest.mark.extended

QUICK = ("sampler.n_walkers=64", "sampler.target_ess=300", "sampler.target_r_hat=1.05", "sampler.max_steps=4000")
TRUE = {"new": 0.1, "old": 0.14}


def _folder(path, mountings=4, true=TRUE, alike=False):
    path.mkdir(parents=True, exist_ok=True)
    (path / "cable.toml").write_text(BENDS)
    lines, generator = ["run,group,wrap_angle_deg,stroke,input_force_N,output_force_N"], np.random.default_rng(8)
    for group, mu in true.items():
        generator = np.random.default_rng(8) if alike else generator
        bends = [180.0] * mountings
        rows = pull(generator, bends, [mu * np.pi] * mountings, (20, 40, 60), noise=(0.1, 0.1), scatter=0.02)
        cells = zip(rows.label, rows.stroke, rows.force_in, rows.force_out, strict=True)
        lines += [f"{label},{group},180,{stroke:+d},{f_in:.5f},{f_out:.5f}" for label, stroke, f_in, f_out in cells]
    (path / "forces.csv").write_text("\n".join(lines) + "\n")
    return path


@pytest.fixture(scope="module")
def fitted(tmp_path_factory):
    """A fit with a coefficient for each group, and one in which they share it."""
    path = tmp_path_factory.mktemp("groups")
    dataset = _folder(path / "data")
    for model in ("by-group", "capstan"):
        bf.fit(dataset, friction=model, seed=1, output=path / model, figures=False, settings=QUICK)
    return path


def test_a_contrast_is_said_in_summary_json_and_notebook(fitted):
    fit = bf.load(fitted / "by-group")
    draws = fit.draws().values["mu[new]"] - fit.draws().values["mu[old]"]
    contrast = fit.groups.contrast("new", "old")
    assert contrast.difference.median == pytest.approx(np.median(draws)) == pytest.approx(-0.04, abs=0.015)
    assert contrast.probability == pytest.approx(np.mean(draws < 0))
    page = (fitted / "by-group" / "summary.txt").read_text()
    text = " ".join(page.split())
    assert faults(page) == []
    assert f"new minus old: {contrast.difference.median:.4f}, 90 % interval" in text and "different (lower) with prob" in text
    (page,) = json.loads((fitted / "by-group" / "summary.json").read_text())["groups"]["contrasts"]
    assert page["difference"]["q95"] == contrast.difference.q95 and page["in_words"] == str(contrast)
    other = fit.groups.contrast("old", "new").difference
    assert (other.q05, other.q95) == (-contrast.difference.q95, -contrast.difference.q05)
    with pytest.raises(KeyError, match="groups are new, old"):
        fit.groups.contrast("new", "older")


def test_groups_that_share_a_coefficient_and_should_not_are_not_trusted(fitted):
    shared = bf.load(fitted / "capstan")
    assert shared.groups is None and not shared.verdict().trusted
    (reason,) = shared.verdict().reasons
    assert "in the group new the loss is" in reason and "--friction by-group" in reason
    assert bf.load(fitted / "by-group").verdict().trusted


def test_compare_tells_whether_groups_differ(fitted, accept):
    comparison = bf.compare({name: bf.load(fitted / name) for name in ("capstan", "by-group")})
    assert comparison.best == "by-group"
    assert "by-group" in accept("compare", fitted / "capstan", fitted / "by-group")


def test_groups_that_do_not_differ_are_not_said_to(tmp_path):
    """The same readings in both groups: either sign is as probable, and shared coefficients describe them."""
    dataset = _folder(tmp_path / "alike", true={"new": 0.12, "old": 0.12}, alike=True)
    contrast = bf.fit(dataset, friction="by-group", seed=1, settings=QUICK).groups.contrast("new", "old")
    assert contrast.probability < 0.55 and abs(contrast.difference.median) < 0.1 * contrast.difference.sd
    assert bf.fit(dataset, seed=1, mcmc=False).verdict().trusted


def test_one_mounting_of_each_group_is_warned_of_and_leaves_them_alike(tmp_path, accept):
    dataset = _folder(tmp_path / "once", mountings=1)
    assert "new and old: measured in one mounting of the cable each" in accept("check", dataset, "--friction", "by-group")
    reference = bf.fit(dataset, friction="by-group", seed=1, settings=QUICK).groups.contrast("new", "old")
    assert reference.difference.sd > 0.01  # a mounting's scatter, whose prior alone speaks, over 180 deg
