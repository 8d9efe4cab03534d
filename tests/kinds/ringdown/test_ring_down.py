"""Ring-downs as a kind of table: read, refused, fitted, and found again."""

import numpy as np
import pytest
from figure_words import faults

import bowdenfit as bf
from bowdenfit.dataset import load_dataset
from bowdenfit.errors import DatasetError
from bowdenfit.kinds import KINDS
from bowdenfit.kinds.ringdown.kind import RingDownTable
from bowdenfit.physics.ring_down import ring_down
from bowdenfit.plots.style import LEFT_OUT
from bowdenfit.questions.bends import ring_down_figure

J, K, B, F = 1e-3, 20.0, 4e-3, 0.08
NAMES = {"ring_inertia": J, "ring_stiffness": K, "rope_damping": B, "ring_friction": F}
INERTIA = 'inertia = { value = 1.0e-3, sd = 2e-5, unit = "kg*m^2" }'
QUICK = ("sampler.n_walkers=64", "sampler.target_ess=200", "sampler.target_r_hat=1.1", "sampler.max_steps=3000")


def swung(added=0.0, amplitude=0.2, noise=1e-3, seed=0, seconds=0.25, rate=1000.0, torque=False, truth=(J, K, B, F)):
    """Time and reading of a bar that is released, about an angle of 0.5 rad where it was held still."""
    time = np.arange(0, seconds, 1 / rate)
    inertia, stiffness, damping, friction = truth
    angle, speed = ring_down(
        time - 0.2e-3, np.zeros(len(time), dtype=int), np.array([amplitude]), np.array([inertia + added]),
        np.array(stiffness), np.array(damping), np.array(friction), 200,
    )  # fmt: skip
    angle, speed = np.asarray(angle), np.asarray(speed)
    shown = stiffness * angle + damping * speed if torque else angle + 0.5
    size = stiffness * noise if torque else noise
    return time, shown + size * np.random.default_rng(seed).standard_normal(len(time))


def folder_of(path, runs, settings=INERTIA, heading="angle_rad"):
    """A data set of ring-downs (added inertia, time, reading), beside a few efficiencies that give the cable its friction."""
    lines = [f"run,time_s,{heading},added_inertia (kg*m^2)"]
    for i, (added, (time, reading)) in enumerate(runs):
        lines += [f"{i + 1},{t:.6f},{x:.8f},{added}" for t, x in zip(time, reading, strict=True)]
    (path / "ringdown.csv").write_text("\n".join(lines) + "\n")
    (path / "efficiencies.csv").write_text("wrap_angle_deg,efficiency\n90,0.86\n180,0.74\n270,0.63\n")
    (path / "cable.toml").write_text(
        "\n".join(
            [
                'name = "bar"', "[[contact]]", 'name = "sheath"', 'friction = "mu"', 'wrap_angle = { column = "wrap_angle" }',
                "[tables]", 'efficiencies = { file = "efficiencies.csv" }',
                f'ringdown = {{ file = "ringdown.csv"{", " + settings if settings else ""} }}',
            ]
        )
        + "\n"
    )  # fmt: skip
    return path


def test_a_ring_down_is_read_in_radians_and_from_its_release_on(tmp_path):
    time, angle = swung()
    folder_of(tmp_path, [(0.0, (time + 3, np.rad2deg(angle)))], heading="angle_deg")
    table = load_dataset(tmp_path).measurements.table(RingDownTable)
    np.testing.assert_allclose(table.reading, angle, atol=1e-8)
    np.testing.assert_allclose(table.time, time, atol=1e-6)
    n, half = table.measure_half_swings(0)
    assert n >= 8 and half == pytest.approx(np.pi * np.sqrt(J / K), rel=0.03)
    assert (table.inertia, table.inertia_sd, table.is_torque) == (1e-3, 2e-5, False)


@pytest.mark.parametrize(
    ("change", "settings", "words"),
    [
        (lambda t, x: (t, x), "", "in proportion to the inertia of what swings.*State it .*ringdown = .*or record a second"),
        (lambda t, x: (t[::-1], x), INERTIA, "time does not grow here"),
        (lambda t, x: (t[:10], x[:10]), INERTIA, "at least 20 rows"),
        (lambda t, x: (t, 0 * x), INERTIA, "nothing changes"),
        (lambda t, x: (t, np.exp(-30 * t)), INERTIA, "reverses 0 times.*separating damping from friction takes"),
        (lambda t, x: (t[::17], x[::17]), INERTIA, "at least 20 rows|record at least 4 rows a half swing|turns round"),
        (lambda t, x: (t, x), 'inertia = { value = 1, unit = "kg" }', "does not measure an inertia"),
    ],
)
def test_what_a_ring_down_cannot_be_told_from_is_refused(tmp_path, change, settings, words):
    folder_of(tmp_path, [(0.0, change(*swung()))], settings)
    with pytest.raises((DatasetError, bf.errors.BowdenfitError), match=words):
        load_dataset(tmp_path)


def test_angle_and_torque_at_once_are_refused(tmp_path):
    folder_of(tmp_path, [(0.0, swung())])
    text = (tmp_path / "ringdown.csv").read_text().replace("added_inertia (kg*m^2)", "torque_N_m")
    (tmp_path / "ringdown.csv").write_text(text)
    with pytest.raises(DatasetError, match="has both; leave one"):
        load_dataset(tmp_path)


def test_least_squares_finds_what_a_ring_down_was_made_of(tmp_path):
    setting = INERTIA.replace("sd = 2e-5, ", "")
    fit = bf.fit(folder_of(tmp_path, [(0.0, swung(noise=2e-4))], setting), seed=1, mcmc=False)
    for name, truth in list(NAMES.items())[1:]:
        assert fit.least_squares.estimates[name].value == pytest.approx(truth, rel=0.05), name


@pytest.mark.slow
def test_a_second_ring_down_with_a_known_inertia_tells_the_inertia(tmp_path):
    fit = bf.fit(folder_of(tmp_path, [(0.0, swung()), (1e-3, swung(1e-3, seed=1))], ""), seed=1, settings=QUICK)
    for name, truth in NAMES.items():
        estimate = fit.parameter(name)
        assert abs(estimate.mean - truth) < 4 * estimate.sd and estimate.sd < 0.1 * truth, name


@pytest.mark.slow
def test_torque_tells_the_same_as_angle(tmp_path):
    fit = bf.fit(folder_of(tmp_path, [(0.0, swung(torque=True))], heading="torque_N_m"), seed=1, settings=QUICK)
    for name, truth in NAMES.items():
        estimate = fit.parameter(name)
        assert abs(estimate.mean - truth) < 4 * estimate.sd and estimate.sd < 0.1 * truth, name


@pytest.mark.extended
@pytest.mark.parametrize(("heading", "unit"), [("angle_rad", 180 / np.pi), ("torque_N_m", 1.0)])
def test_readings_that_are_left_out_are_gray_at_their_time_since_their_release(tmp_path, heading, unit):
    is_torque = heading == "torque_N_m"
    (time, first), (_, second) = swung(torque=is_torque), swung(1e-3, seed=1, torque=is_torque)
    folder_of(tmp_path, [(0.0, (time + 3, first)), (1e-3, (time + 3, second))], heading=heading)
    text, rows = (tmp_path / "cable.toml").read_text(), [10, len(time) + 1, len(time) + 2, len(time) + 12]
    exclude = f'file = "ringdown.csv", exclude = [{{ rows = {rows}, reason = "bumped" }}]'
    (tmp_path / "cable.toml").write_text(text.replace('file = "ringdown.csv"', exclude))
    runs = ring_down_figure.data(bf.fit(tmp_path, seed=1, mcmc=False))
    expected = [[(time[8], first[8]), (time[-1], first[-1])], [(-1e-3, second[0]), (time[9], second[10])]]
    for run, places in zip(runs, expected, strict=True):
        np.testing.assert_allclose(run.left_out.T, np.array(places) * [1, unit], atol=1e-6)
    assert "4 readings left out by the user" in ring_down_figure.caption(runs)
    assert LEFT_OUT in ring_down_figure.draw(runs).axes[0].get_legend_handles_labels()[1]


@pytest.mark.extended
def test_a_released_joint_is_drawn_as_it_was_read_and_fitted(tmp_path):
    setting = INERTIA.replace("sd = 2e-5, ", "")
    fit = bf.fit(folder_of(tmp_path, [(0.0, swung(noise=2e-4)), (1e-3, swung(1e-3, noise=2e-4, seed=1))], setting), seed=1,
                 mcmc=False)  # fmt: skip
    first, second = ring_down_figure.data(fit)
    assert (first.label, second.label) == ("Run 1", "Run 2, 0.001 kg m² added")
    assert np.std(first.points - first.points_fitted) < np.rad2deg(4e-4)
    np.testing.assert_allclose(np.interp(first.points_time, first.time, first.reading[0]), first.points_fitted, atol=0.3)
    assert ring_down_figure.caption((first, second)).startswith("Angle against the time since the release of the joint, 2 runs")
    assert faults(ring_down_figure.draw((first, second))) == []


def test_files_of_a_released_joint_are_offered_where_no_description_says_what_they_hold():
    questions = KINDS["ringdown"].init_questions
    assert [item.quantity.name for item in questions.required] == ["time", "angle"]
    assert not questions.is_guessed, "time and angle are in many a file"
