"""Predictions while a contact bends: the mean over a gait."""

import numpy as np
import pytest

import bowdenfit as bf
from bowdenfit.errors import UsageError
from bowdenfit.questions.error_budget import with_bench_errors

pytestmark = pytest.mark.extended


@pytest.fixture(scope="module")
def fit(quick_fit):
    """A fit of the on-body data, whose last contact is bent with the knee."""
    return quick_fit


@pytest.fixture(scope="module")
def swing(tmp_path_factory):
    """The knee swings back from 45 deg to straight, at equal times."""
    path = tmp_path_factory.mktemp("gait") / "swing.csv"
    path.write_text("\n".join(["time_s,wrap_angle_deg", *(f"{i / 100},{x:.3f}" for i, x in enumerate(np.linspace(45, 0, 91)))]))
    return path


def at_470(fit, *angles, **more):
    """The row of 470 mm, with the bracket edge bent."""
    (row,) = bf.predict(fit, [470], contact="bracket edge", wrap_angles=[(x, "deg") for x in angles], **more)
    return row


def test_the_figures_of_the_bent_knee_come_out(fit, swing):
    assert at_470(fit, 45)["efficiency"] == pytest.approx(0.788, abs=0.004)
    assert at_470(fit, 20)["efficiency"] == pytest.approx(0.867, abs=0.006)
    assert at_470(fit, 0)["efficiency"] == pytest.approx(0.936, abs=0.008)
    (row,) = bf.predict(fit, [470], contact="bracket edge", gait=swing)
    assert row["efficiency"] == pytest.approx(0.861, abs=0.006)
    assert row["least_efficiency"] == pytest.approx(0.788, abs=0.004)
    assert row["most_efficiency"] == pytest.approx(0.936, abs=0.008)
    assert "mean over 91 wrap angles of 'bracket edge', 0 to 45 deg" in row["note"]


def unbent(fit):
    """Draws of mu3, and of the efficiency at 470 mm if the bracket edge did not bend the cable; bench errors included."""
    fit = with_bench_errors(fit)
    mu = fit.posterior.values["mu3"].ravel()
    return mu, fit.efficiency_draws([470])[:, 0] * np.exp(mu * np.pi / 4)


def test_the_torque_at_the_joint_is_the_moment_arm_times_what_arrives(fit, tmp_path):
    angles, arms = np.linspace(45, 0, 31), np.linspace(60, 40, 31)
    path = tmp_path / "arms.csv"
    rows = (f"{angle:.6f},{arm:.6f}" for angle, arm in zip(angles, arms, strict=True))
    path.write_text("\n".join(["wrap_angle_deg,moment_arm_mm", *rows]))
    (row,) = bf.predict(fit, [470], contact="bracket edge", gait=path, input_force=(100, "N"))
    mu, straight = unbent(fit)
    torque = 0.1 * arms * straight[:, None] * np.exp(-mu[:, None] * np.deg2rad(angles))  # 100 N times mm, in N m
    assert row["torque_N_m"] == pytest.approx(np.median(torque.mean(axis=1)), rel=1e-6)
    assert row["most_torque_N_m_q95"] == pytest.approx(np.quantile(torque.max(axis=1), 0.95), rel=1e-6)
    assert "torque_N_m" not in bf.predict(fit, [470], contact="bracket edge", gait=path)[0]
    assert "N*m" in str(bf.predict(fit, [470], contact="bracket edge", gait=path, input_force=(100, "N")))


def test_the_nominal_angle_gives_what_is_predicted_without_a_gait(fit):
    (plain,) = bf.predict(fit, [470])
    for name, value in plain.items():
        if name not in ("note",):
            assert at_470(fit, 45)[name] == pytest.approx(value, rel=1e-12), name


def test_a_swing_at_even_angles_has_the_mean_of_its_closed_form(fit, swing):
    mu, straight = unbent(fit)
    (row,) = bf.predict(fit, [470], contact="bracket edge", gait=swing)
    step = np.exp(-mu * np.deg2rad(0.5))
    mean = straight * (1 - step**91) / (1 - step) / 91  # a geometric series of steps of half a degree
    assert row["efficiency"] == pytest.approx(np.median(mean), rel=1e-6)
    assert row["q05"] == pytest.approx(np.quantile(mean, 0.05), rel=1e-6)


def test_the_best_length_does_not_move_with_the_angle_of_a_contact_that_stays(fit):
    lengths = [440, 455, 470, 485, 500]
    bent = [(x, "deg") for x in (0, 10, 60)]
    gait = bf.predict(fit, lengths, contact="bracket edge", wrap_angles=bent)
    nominal = bf.predict(fit, lengths)
    assert np.argmax([row["efficiency"] for row in gait]) == np.argmax([row["efficiency"] for row in nominal])
    ratios = [a["efficiency"] / b["efficiency"] for a, b in zip(gait, nominal, strict=True)]
    assert np.ptp(ratios) < 2e-3  # the angle multiplies the efficiency of every length alike, draw by draw


def test_forces_over_a_gait_are_those_of_its_angles(fit):
    wanted = at_470(fit, 0, 45, output_force=(100, "N"))
    assert wanted["least_input_force_N"] == pytest.approx(at_470(fit, 0, output_force=(100, "N"))["input_force_N"], rel=1e-12)
    assert wanted["most_input_force_N"] == pytest.approx(at_470(fit, 45, output_force=(100, "N"))["input_force_N"], rel=1e-12)
    arrives = at_470(fit, 20, input_force=(0.2, "kN"))
    assert arrives["output_force_N"] == pytest.approx(200 * at_470(fit, 20)["efficiency"], rel=1e-12)


def test_a_long_gait_is_stood_for_by_its_quantiles(fit, tmp_path):
    table, rng = tmp_path / "walk.csv", np.random.default_rng(3)
    angles = 30 + 30 * np.sin(rng.uniform(0, 2 * np.pi, 3000))
    table.write_text("\n".join(["knee (deg)", *(f"{x:.4f}" for x in angles)]))
    (row,) = bf.predict(fit, [470], contact="bracket edge", gait=table, gait_column="knee (deg)")
    mu, straight = unbent(fit)
    mean = straight * sum(np.exp(-mu * angle) for angle in np.deg2rad(angles)) / 3000
    assert row["efficiency"] == pytest.approx(np.median(mean), rel=1e-5)
    assert "3000 wrap angles" in row["note"]


def test_the_command_says_the_mean_and_its_ends(quick_results, swing, run):
    code, out, _ = run("predict", quick_results, "470", "--contact", "bracket edge", "--gait", swing)
    assert code == 0
    assert out.startswith("Efficiency at 470 mm: 8") and "Least efficiency at 470 mm: 7" in out
    assert max(map(len, out.splitlines())) <= 80


def test_bad_gaits_are_refused_in_words(fit, quick_results, swing, refuse, tmp_path):
    folder = quick_results
    assert "there is no such contact" in refuse("predict", folder, "--contact", "braket edge", "--gait", swing)
    assert "there is no such contact" in refuse("predict", folder, "--contact", "")
    assert "name one of the two" in refuse("predict", folder, "--contact", "bracket edge")
    assert "name one of the two" in refuse(
        "predict", folder, "--contact", "bracket edge", "--gait", swing, "--wrap-angle", "45deg"
    )
    assert "does not say which of them is bent" in refuse("predict", folder, "--gait", swing)
    assert "leave the rest out" in refuse("predict", folder, "--contact", "bracket edge", "--quantity", "preload")
    (tmp_path / "bad.csv").write_text("wrap_angle_deg\n45\n-3\n")
    assert "row 3" in refuse("predict", folder, "--contact", "bracket edge", "--gait", tmp_path / "bad.csv")
    assert "missing.csv" in refuse("predict", folder, "--contact", "bracket edge", "--gait", tmp_path / "missing.csv")
    with pytest.raises(UsageError, match="write it without a sign"):
        at_470(fit, -5)


def test_springs_and_dynamic_ranges_that_cannot_be_told_are_refused(fit):
    options = {"wrap_angles": [(90, "deg")]}
    for request, words in (
        ({"quantity": "stiffness", "spring": (5, "N")}, "does not measure a stiffness"),
        ({"quantity": "friction", "spring": (5, "N/mm")}, "does not depend on --spring, which is asked of stiffness; leave"),
        ({"quantity": "friction", "input_force": (50, "N")}, "does not depend on --input-force, which is asked of eff"),
        ({"quantity": "preload", "stroke": "return"}, "does not depend on --stroke return, which is asked of efficiency, out"),
        ({"quantity": "preload-window", "preload": (5, "N")}, "preload-window does not depend on --preload"),
        ({"friction_limit": (5, "N")}, "efficiency does not depend on --friction-limit, which is asked of preload-window"),
        ({"quantity": "dynamic-range"}, "asked of pull-pull loops"),
    ):
        with pytest.raises(UsageError, match=words):
            bf.predict(fit, **request, **options)
