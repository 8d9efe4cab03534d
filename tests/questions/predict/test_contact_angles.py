"""Predictions with a stated wrap angle for each contact, and at lengths outside the angle curves."""

from inspect import signature

import numpy as np
import pytest

import bowdenfit as bf
from bowdenfit.display import render_text
from bowdenfit.errors import UsageError
from bowdenfit.inference.draws import curve_function, for_each_draw
from bowdenfit.questions.error_budget import with_bench_errors
from bowdenfit.questions.predict.predictions import prediction_blocks
from bowdenfit.results import prediction_angles

EDGE, FREE = "bracket edge", "free sheath"


@pytest.fixture(scope="module")
def fit(quick_fit):
    """A fit of the on-body data: two curved contacts, and an edge at 45 deg."""
    return quick_fit


def expected(fit, length, free_deg, edge_deg):
    """Efficiency of every draw, bench errors included, at a length inside the curves, by the capstan equation."""
    fit = with_bench_errors(fit)
    curves = for_each_draw(curve_function(fit.model, np.array([float(length)])), fit.model.space.size)(fit.posterior.flat_z)
    own_angles = np.deg2rad(curves["free_sheath_angle"][:, 0])
    mu1, mu3 = (fit.posterior.values[name].ravel() for name in ("mu1", "mu3"))
    more = mu1 * (np.deg2rad(free_deg) - own_angles) + mu3 * np.deg2rad(edge_deg - 45)
    return curves["efficiency"][:, 0] * np.exp(-more)


def test_each_contact_can_be_given_its_wrap_angle(fit):
    (row,) = bf.predict(fit, [470], wrap_angles={EDGE: "30deg", FREE: (100, "deg")})
    right = expected(fit, 470, 100, 30)
    assert row["efficiency"] == pytest.approx(np.median(right), rel=1e-6)
    assert row["q05"] == pytest.approx(np.quantile(right, 0.05), rel=1e-6)
    assert row["note"] == "'bracket edge' bent by 30 deg and 'free sheath' bent by 100 deg"
    assert bf.predict(fit, 470, wrap_angles=["free sheath=100deg", "bracket edge = 30 deg"])[0]["mean"] == row["mean"]
    (force,) = bf.predict(fit, 470, "50N", wrap_angles={EDGE: "30deg", FREE: "100deg"})
    assert force["output_force_N"] == pytest.approx(50 * np.median(right), rel=1e-6)


def test_other_contacts_keep_a_stated_angle_while_one_goes_through_several(fit):
    (row,) = bf.predict(fit, [470], contact=EDGE, wrap_angles=["0deg", "60deg", "free sheath=100deg"])
    mean = (expected(fit, 470, 100, 0) + expected(fit, 470, 100, 60)) / 2
    assert row["efficiency"] == pytest.approx(np.median(mean), rel=1e-6)
    assert "mean over 2 wrap angles of 'bracket edge', 0 to 60 deg; 'free sheath' bent by 100 deg" in row["note"]


def test_the_command_takes_an_angle_for_each_contact(fit, quick_results, run):
    code, out, _ = run(
        "predict", quick_results, "470", "--wrap-angle", "bracket edge=45deg", "--wrap-angle", "free sheath=100deg"
    )
    assert code == 0
    assert f"Efficiency at 470 mm: {100 * np.median(expected(fit, 470, 100, 45)):.1f}" in out
    assert "'bracket edge' bent by 45 deg and 'free sheath' bent by 100 deg" in " ".join(out.split())


def test_what_would_not_be_used_is_refused(quick_results, refuse, tmp_path):
    twice = ("--contact", EDGE, "--wrap-angle", "45deg", "--contact", FREE, "--wrap-angle", "100deg")
    assert "--contact is given twice, and only one can count" in refuse("predict", quick_results, "470", *twice)
    (tmp_path / "swing.csv").write_text("wrap_angle_deg\n45\n")
    gait = ("--gait", tmp_path / "swing.csv")
    for typed, words in (
        (("--wrap-angle", "braket edge=45deg"), "there is no such contact; did you mean 'bracket edge'?"),
        (("--wrap-angle", "bracket edge=45deg", "--wrap-angle", "bracket edge=20deg"), "states 'bracket edge' twice"),
        (("--wrap-angle", "45deg", "--wrap-angle", "bracket edge=20deg"), "does not say which contact is bent"),
        (("--wrap-angle", "bracket edge=45"), "'bracket edge', '45' is not a number with its unit"),
        (("--wrap-angle", "=45deg"), "has no name before its '='"),
        (("--wrap-angle", "bracket edge=-45deg"), "write it without a sign"),
        (("--contact", EDGE, *gait, "--wrap-angle", "bracket edge=20deg"), "both state the wrap angles of 'bracket edge'"),
        (("--contact", EDGE, "--wrap-angle", "20deg", "--gait-column", "knee"), "none is given; leave it out"),
        (("--wrap-angle", "bracket edge=20deg", "--quantity", "friction"), "leave the rest out"),
        (("--input-force", "50N", "--input-force", "60N"), "--input-force is given twice"),
    ):
        assert words in refuse("predict", quick_results, "470", *typed), typed


def test_a_wrong_angle_of_a_contact_is_refused_in_a_notebook(fit):
    with pytest.raises(UsageError, match=r"wrap_angles\['bracket edge'\] = 45 is not a number with its unit"):
        bf.predict(fit, 470, wrap_angles={EDGE: 45})
    with pytest.raises(UsageError, match="did you mean 'free sheath'"):
        bf.predict(fit, 470, wrap_angles={"free sheat": "45deg"})


# Outside the angle curves -----------------------------------------------------------------------------------------


def test_a_prediction_outside_the_curves_is_what_the_measured_angles_say(fit):
    """At 550 mm the angle table has 37 and 100 deg, and the fit expects its reading there by these; the bell said 64 %."""
    row = bf.predict(fit, [550])[0]
    draws = with_bench_errors(fit).posterior.values
    mu1, mu2, mu3 = (draws[name].ravel() for name in ("mu1", "mu2", "mu3"))
    right = np.exp(-(mu1 * np.deg2rad(100) + mu2 * np.deg2rad(37) + mu3 * np.deg2rad(45)))
    assert row["efficiency"] == pytest.approx(np.median(right), abs=5e-4)
    assert row["efficiency"] == pytest.approx(0.680, abs=0.003)
    noise = np.deg2rad(fit.posterior.values["sigma_theta"].ravel())
    assert row["sd"] == pytest.approx(np.sqrt(np.var(right) + np.mean((mu1**2 + mu2**2) * (right * noise) ** 2)), rel=0.03)
    assert row["note"] == "outside the curves, 430 to 530 mm: by the wrap angles measured there"
    assert not row["in_range"]


def test_all_ways_to_ask_outside_the_curves_agree(fit):
    rows = bf.predict(fit, [540, 550])
    assert bf.predict(fit, ["55cm"])[0]["mean"] == rows[1]["mean"]  # whatever stands beside it
    assert [estimate.mean for estimate in fit.efficiency([540, 550])] == pytest.approx([row["mean"] for row in rows], rel=1e-12)
    assert "540 mm and 550 mm: outside the curves" in " ".join(str(fit.efficiency([470, 540, 550])).split())
    (bent,) = bf.predict(fit, [550], contact=EDGE, wrap_angles="45deg")
    assert bent["efficiency"] == pytest.approx(rows[1]["efficiency"], rel=1e-12)
    wanted = bf.predict(fit, [550], output_force="100N")[0]
    assert wanted["input_force_N"] == pytest.approx(100 / rows[1]["efficiency"], rel=1e-6)


def test_where_no_angle_was_measured_outside_the_curves_a_prediction_is_refused(fit, quick_results, refuse):
    words = refuse("predict", quick_results, "560")
    assert "560 mm lies outside the curves, 430 to 530 mm, and no wrap angle of 'free sheath' and 'squeezed sheath'" in words
    assert "Measure the wrap angles there" in words and "--wrap-angle 'free sheath=30deg'" in words
    with pytest.raises(UsageError, match="560 mm lies outside the curves"):
        fit.efficiency([470, 560])
    with pytest.raises(UsageError, match="no wrap angle of 'squeezed sheath' was measured"):
        bf.predict(fit, 560, wrap_angles={FREE: "100deg"})
    (stated_prediction,) = bf.predict(fit, 560, wrap_angles={FREE: "100deg", "squeezed sheath": "37deg"})
    draws = with_bench_errors(fit).posterior.values
    mu1, mu2, mu3 = (draws[name].ravel() for name in ("mu1", "mu2", "mu3"))
    right = np.exp(-(mu1 * np.deg2rad(100) + mu2 * np.deg2rad(37) + mu3 * np.deg2rad(45)))
    assert stated_prediction["efficiency"] == pytest.approx(np.median(right), rel=1e-6)


# Words and seeds --------------------------------------------------------------------------------------------------


def test_a_dynamic_range_is_a_ratio_without_a_unit():
    row = {"wrap_angle_deg": 90.0, "dynamic_range": 55.5, "mean": 55.4, "sd": 1.0, "q05": 54.1, "q95": 56.9, "note": ""}
    assert render_text(prediction_blocks([row])) == "Dynamic range at 90 deg: 55.5 (90 % interval 54.1 to 56.9).\n"
    several = render_text(prediction_blocks([row, row | {"wrap_angle_deg": 180.0, "dynamic_range": 30.2}]))
    assert "Dynamic range: highest 55.5 at 90 deg, lowest 30.2 at 180 deg." in " ".join(several.split())
    assert several.split("\n\n")[1].splitlines()[0].split() == ["wrap", "angle", "(deg)", "dynamic", "range"]


def test_a_column_of_a_gait_is_named_by_the_option_that_there_is(fit, quick_results, refuse, tmp_path):
    path = tmp_path / "stride.csv"
    path.write_text("time_s,theta_deg,knee\n0,45,45\n1,0,0\n")
    options = {"contact": EDGE, "gait": path}
    (right,) = bf.predict(fit, 470, contact=EDGE, wrap_angles=["45deg", "0deg"])
    for column in ("theta_deg", "knee:deg"):
        assert bf.predict(fit, 470, **options, gait_column=column)[0]["mean"] == right["mean"]
    typed = ("predict", quick_results, "470", "--contact", EDGE, "--gait", path)
    assert "write it behind the heading, as --gait-column 'knee:deg'" in refuse(*typed, "--gait-column", "knee")
    assert "has no such column; did you mean 'theta_deg'?" in refuse(*typed, "--gait-column", "theta_dg")
    words = refuse(*typed)
    assert "--gait-column 'NAME:deg'" in words and "--column wrap_angle" not in words


def test_another_seed_leaves_the_posterior_and_draws_other_mountings(fit):
    other = fit.with_seed(fit.provenance.seed + 1)
    assert isinstance(other, bf.Fit) and fit.with_seed(None) is fit
    assert other.parameter_of_draws("mu1") == fit.parameter_of_draws("mu1")
    assert not np.array_equal(other.mounting(), fit.mounting())
    for verb in (bf.compensate, bf.teleoperate):
        assert signature(verb).parameters["seed"].default is None


@pytest.mark.extended
def test_many_lengths_are_predicted_in_parts_and_too_many_are_refused(fit, monkeypatch):
    lengths = np.linspace(440.0, 520.0, 7)
    in_one, means = bf.predict(fit, lengths), [estimate.mean for estimate in fit.efficiency(lengths)]
    bent = bf.predict(fit, lengths[:3], contact=EDGE, wrap_angles=["0deg", "60deg"])
    monkeypatch.setattr(prediction_angles, "_AT_ONCE", 2)
    assert [len(part) for part in prediction_angles.split_lengths(lengths)] == [2, 2, 2, 1]
    assert [row["mean"] for row in bf.predict(fit, lengths)] == pytest.approx([row["mean"] for row in in_one], rel=1e-12)
    assert [estimate.mean for estimate in fit.efficiency(lengths)] == pytest.approx(means, rel=1e-12)
    again = bf.predict(fit, lengths[:3], contact=EDGE, wrap_angles=["0deg", "60deg"])
    assert [row["mean"] for row in again] == pytest.approx([row["mean"] for row in bent], rel=1e-12)
    for ask in (fit.efficiency, lambda many: bf.predict(fit, many)):
        with pytest.raises(UsageError, match="10,001 lengths are asked for, and at most 10,000"):
            ask(np.linspace(440.0, 520.0, 10_001))
