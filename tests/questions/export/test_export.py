"""Exported files against predictions of the fit they come from."""

import csv
import json
from types import SimpleNamespace

import numpy as np
import pytest
from exported_cables import HOSTILE, cable

import bowdenfit as bf
from bowdenfit.errors import UsageError
from bowdenfit.questions.export.sensors import estimate_sensors
from bowdenfit.questions.export.tables import LEVELS, tabulate_transmission
from bowdenfit.questions.export.text import ascii_text
from bowdenfit.questions.export.writers import draws_table

pytestmark = pytest.mark.extended

QUICK = ("sampler.n_walkers=64", "sampler.target_ess=100", "sampler.target_r_hat=1.1", "sampler.max_steps=1000")


@pytest.fixture(scope="module")
def fit(quick_fit):
    """A quick fit of the on-body data."""
    return quick_fit


@pytest.fixture(scope="module")
def of_load(tmp_path_factory):
    """A quick fit of a rope with drag, whose friction is not the same both ways."""
    path = tmp_path_factory.mktemp("bench") / "bench.csv"
    rng = np.random.default_rng(2)
    rows = [
        (bend, force, (force + 4) * np.exp(-0.1 * (1.05 if stroke == "pull" else -0.95) * np.deg2rad(bend)) - 4, stroke)
        for bend in (90, 180, 270) for force in (20, 50, 100) for stroke in ("pull", "return")
    ]  # fmt: skip
    lines = [f"{bend},{force},{out + 0.1 * rng.standard_normal():.3f},{stroke}" for bend, force, out, stroke in rows]
    path.write_text("\n".join(["wrap_angle_deg,input_force_N,output_force_N,stroke", *lines]) + "\n")
    return bf.fit(path, seed=1, settings=QUICK, friction="drag+stroke-dependent")


def read_back(text):
    """Rows of a CSV with remarks at its top, as numbers by column."""
    rows = list(csv.reader(line for line in text.splitlines() if not line.startswith("#")))
    return {name: list(column) for name, column in zip(rows[0], zip(*rows[1:], strict=True), strict=True)}


def test_the_lookup_table_says_what_predict_says(fit, tmp_path):
    done = bf.export(fit, "csv", tmp_path / "table.csv", points=5)
    columns = read_back(done.file.read_text())
    rows = bf.predict(fit, [430, 455, 480, 505, 530])
    for name in ("efficiency", "mean", "sd", "q05", "q95", "mounting_q05", "mounting_q95"):
        np.testing.assert_array_equal(np.array(columns[name], dtype=float), [row[name] for row in rows])
    assert columns["cable_length_mm"] == ["430.0", "455.0", "480.0", "505.0", "530.0"]
    np.testing.assert_allclose(
        np.exp(-np.array(columns["friction_exponent_q95"], dtype=float)), [row["q05"] for row in rows], rtol=1e-5
    )


@pytest.mark.parametrize("stroke", ["pull", "return"])
def test_quantiles_of_friction_give_the_intervals_of_predictions(of_load, stroke):
    tables = tabulate_transmission(of_load, points=3)
    route_points, reference = tables.points.values, tables.reference_force
    rows = bf.predict(of_load, wrap_angles=[(x, "rad") for x in route_points], input_force=(reference, "N"), stroke=stroke)
    row, sign = (0, 1) if stroke == "pull" else (1, -1)
    assert tables.depends_on_load
    quantiles = ("q95", "output_force_N", "q05")[::sign]
    for level, quantile in zip(("q05", "q50", "q95"), quantiles, strict=True):
        level_table = tables.levels[LEVELS.index(level)]
        scale = level_table.load_exponent, level_table.drag, reference
        shift = sign * level_table.exponent[row]
        there = (reference + level_table.drag) * np.exp(-shift) - level_table.drag
        assert scale[0] == 0
        np.testing.assert_allclose(there, [r[quantile] for r in rows], rtol=1e-6)


def test_draws_are_cables_of_the_posterior_in_mountings_of_their_own(fit):
    tables = tabulate_transmission(fit, points=2, draws=400)
    draws = np.array([level.exponent[0] for level in tables.levels[len(LEVELS) :]])
    of_mountings = [tables.levels[LEVELS.index(f"mounting_{q}")].exponent[0] for q in ("q05", "q95")]
    inside = np.mean((draws > of_mountings[0]) & (draws < of_mountings[1]))
    assert (
        0.9 - 4.4 * 0.011 < inside < 0.9 + 4.4 * 0.011
    )  # binomial of 800, half of them dependent: less than 1 in 10^4
    columns = read_back(draws_table(tables))
    assert len(columns["draw"]) == 800
    np.testing.assert_array_equal(np.array(columns["friction_exponent_pull"], dtype=float).reshape(-1, 2), draws)


def test_every_file_says_fit_seed_version_and_range(fit, tmp_path):
    for to, ending in (("c", "h"), ("csv", "csv"), ("matlab", "m"), ("yaml", "yaml")):
        text = bf.export(fit, to, tmp_path / f"file.{ending}", points=3).file.read_text()
        made = f"seed {fit.provenance.seed}", f"bowdenfit {fit.provenance.versions['bowdenfit']}"
        assert all(words in text for words in ("On-body knee exoskeleton", *made, "430 to 530 mm"))


def test_the_estimator_gets_the_sensors_that_description_and_recordings_tell(fit, on_body, tmp_path):
    sensors = tabulate_transmission(fit, points=2).sensors
    assert np.isnan(sensors.force_sd) and sensors.noise_time == 0.0  # a table does not tell the noise of a sample
    assert sensors.gain_sd == pytest.approx(np.sqrt(2) * 0.01) and sensors.latency_sd == 0.01
    text = bf.export(fit, "c", tmp_path / "cable.h", points=3).file.read_text()
    assert "bowden_fitted_sensors = {NAN, 0.0, 0.0141" in text
    recorded = SimpleNamespace(dataset=bf.read(on_body.with_name("synthetic-recordings")))
    sensors = estimate_sensors(recorded)
    assert sensors.force_sd == pytest.approx(0.5, rel=0.1) and sensors.noise_time == 0.0  # truth.json
    sheet = {"gain_sd": 0.003, "offset_sd": SimpleNamespace(to=lambda _: 0.2), "force_noise": None}
    description = SimpleNamespace(sensors=SimpleNamespace(**sheet), errors=SimpleNamespace(gain=0.01), route=None)
    dataset = SimpleNamespace(description=description, measurements=recorded.dataset.measurements)
    sensors = estimate_sensors(SimpleNamespace(dataset=dataset))
    assert (sensors.gain_sd, sensors.zero_sd) == (0.003, 0.2)


def test_the_command_writes_a_file_and_does_not_replace_one(fit, of_load, tmp_path, run, refuse, monkeypatch):
    monkeypatch.chdir(tmp_path)
    fit.save("fits")
    of_load.save("of few draws")
    code, out, _ = run("export", "fits", "--to", "c", "--points", 3, "--draws", 2)
    assert code in (0, 3)
    assert out == "Wrote on_body_knee_exoskeleton.h.\n"
    assert "add --force" in refuse("export", "fits", "--to", "c")
    code, out, _ = run("export", "fits", "--to", "csv", "--points", 3, "--json", "-o", "new/table.csv")
    assert json.loads(out)["format"] == "csv" and (tmp_path / "new" / "table.csv").exists()
    assert "draws; ask for at most that many" in refuse("export", "of few draws", "--to", "csv", "--draws", 9999)


@pytest.mark.slow
def test_a_loop_is_exported_with_its_stiffness_at_the_wrap_angle_asked_for(tmp_path, run, refuse, monkeypatch, on_body):
    monkeypatch.chdir(tmp_path)
    fit = bf.fit(on_body.with_name("synthetic-haptic-loop"), seed=5, settings=QUICK)
    fit.save("fits")
    code, out, _ = run("export", "fits", "--to", "mujoco", "--at", "100deg", "--points", 5)
    assert code in (0, 3)
    assert "Friction is that at wrap_angle 100 deg.\nIt holds up to" in out
    text = (tmp_path / "synthetic_haptic_loop.xml").read_text()
    tables = tabulate_transmission(fit, 5)
    rows = bf.predict(
        fit, quantity="stiffness", wrap_angles=[(x, "rad") for x in tables.points.values], input_force=(1e-6, "N")
    )
    np.testing.assert_allclose(tables.median.stiffness, [row["stiffness_N_per_mm"] for row in rows], rtol=1e-6)
    assert tables.radii == (20.0, 20.0)
    assert repr(2000 * float(np.interp(np.deg2rad(100), tables.points.values, tables.median.stiffness))) in text
    assert "is asked of mujoco" in refuse("export", "fits", "--to", "c", "--at", "100deg")
    assert "--at 100mm" in refuse("export", "fits", "--to", "mujoco", "--force", "--at", "100mm")


def test_a_fit_without_draws_is_refused_in_words(on_body_squares, tmp_path):
    with pytest.raises(UsageError, match="without MCMC"):
        bf.export(on_body_squares, "c", tmp_path / "bowden.h")
    assert not (tmp_path / "bowden.h").exists()


def test_hostile_names_are_harmless_in_csv():
    text = draws_table(cable("rope", name=HOSTILE))
    columns = read_back(text)
    assert list(columns) == ["draw", "wrap_angle_rad", "friction_exponent_pull", "friction_exponent_return"]
    assert text.isascii()
    assert "a,'=1+1" in draws_table(cable("rope", name="a,=1+1"))  # which a spreadsheet would compute


def test_plain_text_holds_nothing_that_steers():
    assert ascii_text(HOSTILE).isascii() and ascii_text(HOSTILE).isprintable()
    assert not any(bad in ascii_text(HOSTILE + "/*/*/-->") for bad in ("*/", "/*", "??", "--", "\\", "%{", "%}"))
