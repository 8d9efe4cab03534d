"""Tables in which friction would add force are refused, and healthy noisy ones are not."""

from dataclasses import replace

import numpy as np
import pytest
from hand_bench import Readings, pull, write

from bowdenfit.description import Sensors
from bowdenfit.errors import DatasetError
from bowdenfit.kinds.descriptions import parse_description
from bowdenfit.kinds.forces.impossible_forces import FALSE_ALARM, check_gains
from bowdenfit.kinds.forces.table import ForceTable
from bowdenfit.kinds.rows import OwnAngles, RowOrigin

pytestmark = pytest.mark.extended

ANGLES = (90.0, 180.0, 270.0)
LOSS = tuple(0.1 * np.deg2rad(ANGLES))
LOADS = (10.0, 20.0, 40.0, 60.0)
LBF = 4.4482


def _bench(seed: int = 0, **more) -> Readings:
    return pull(np.random.default_rng(seed), ANGLES, LOSS, LOADS, noise=(0.3, 0.3), repeats=3, **more)


def _without_strokes(rows: Readings) -> Readings:
    return replace(rows, stroke=np.ones_like(rows.stroke))


def _tenth(rows: Readings, i: int) -> Readings:
    return replace(rows, force_out=np.where(np.arange(len(rows.place)) == i, rows.force_out / 10, rows.force_out))


MISTAKES = {
    "columns swapped": (lambda r: r.swapped(), ["input_force and output_force", "swapped"]),
    "strokes exchanged": (lambda r: replace(r, stroke=-r.stroke), ["pull and return"]),
    "returns taken for pulls": (_without_strokes, ["add a column stroke"]),
    "output in lbf": (lambda r: replace(r, force_out=LBF * r.force_out), ["unit", "lbf and N", "correct the heading"]),
    "input in lbf": (lambda r: replace(r, force_in=LBF * r.force_in), ["unit", "lbf and N", "returning"]),
    "cells of unlike gain": (
        lambda r: replace(r, force_out=1.22 * r.force_out), ["differ in gain", "the run '1'", "input_gain_error_sd"]
    ),
    "one run swapped": (lambda r: r.swapped(r.label == "2"), ["24 of 72", "the run '2'", "leave the run out"]),
    "one row a tenth": (lambda r: _tenth(r, 30), ["row 32", "factor of more than two", "typing error"]),
    "one row swapped": (lambda r: r.swapped(np.array([17])), ["row 19", "1 of 72", "typing error", "force_noise"]),
}


@pytest.mark.parametrize("mistake", MISTAKES)
@pytest.mark.parametrize("unit", [0.05, 1.0, 200.0])
def test_more_force_out_than_in_is_refused_with_its_usual_cause(tmp_path, refuse, mistake, unit):
    spoil, names = MISTAKES[mistake]
    rows = _bench()
    rows = replace(rows, force_in=unit * rows.force_in, force_out=unit * rows.force_out)
    message = refuse("check", write(tmp_path, spoil(rows)))
    for name in (*names, "forces.csv, row"):
        assert name in message


@pytest.mark.parametrize("n", [1, 3, 6])
def test_swapped_columns_are_refused_where_every_run_is_one_reading(tmp_path, refuse, n):
    rows = pull(
        np.random.default_rng(n), [180.0] * n, [0.314] * n, [20.0], strokes=(1,), noise=(0.3, 0.3), scatter=0.02
    )
    assert "swapped" in refuse("check", write(tmp_path, rows.swapped()))


def test_a_table_that_says_that_some_readings_are_wrong_is_refused_only_as_a_whole(tmp_path, accept, refuse):
    heavy = 'noise = "student"\n'
    first = write(tmp_path / "one", _bench().swapped(np.array([17])))
    every = write(tmp_path / "every", _bench().swapped())
    for folder in (first, every):
        file = folder / "cable.toml"
        file.write_text(heavy + file.read_text())
    accept("check", first)
    assert "swapped" in refuse("check", every)


def test_stated_offsets_and_gain_errors_explain_a_gain_that_noise_does_not(tmp_path, accept, refuse):
    rows = pull(
        np.random.default_rng(2), [10.0], [0.02], LOADS, strokes=(1,), noise=(0.05, 0.05), repeats=5, offset=(0.0, 2.0)
    )
    assert "not zeroed" in refuse("check", write(tmp_path / "bare", rows))
    setting = '[sensors]\noffset_sd = { value = 1, unit = "N" }\n'
    accept("check", write(tmp_path / "offset", rows, more=setting))
    gained = replace(rows, force_out=1.06 * (rows.force_out - 2.0))
    refuse("check", write(tmp_path / "no gain", gained))
    setting = "[sensors]\ninput_gain_error_sd = 0.015\noutput_gain_error_sd = 0.02\n"
    accept("check", write(tmp_path / "gain", gained, more=setting))


# runs, loads, strokes, repeats, noise in both cells [N] and friction exponent of cables with hardly any friction
HEALTHY = {
    "three runs": (3, (10.0, 20.0, 40.0), (1, -1), 2, 0.8, 0.0),
    "one load": (20, (50.0,), (1,), 3, 5.0, 0.0),
    "one long run": (1, (1.0, 5.0, 20.0, 50.0), (1, -1), 50, 0.1, 0.01),
    "one short run": (1, (30.0, 50.0), (1, -1), 5, 3.0, 0.02),
    "noise of a sixth at the lowest load": (3, (1.0, 5.0, 20.0), (1, -1), 6, 0.15, 0.3),
    "few readings that stand alone": (5, (50.0,), (1,), 1, 1.0, 0.01),
    "many readings that stand alone": (20, (50.0,), (1,), 1, 1.5, 0.0),
}


@pytest.mark.parametrize(("tables", "most"), [(200, 3), pytest.param(500, 4, marks=pytest.mark.slow)])
@pytest.mark.parametrize("bench", HEALTHY)
def test_a_noisy_table_of_a_cable_without_friction_is_hardly_ever_refused(bench, tables, most):
    """More false alarms are less likely than 2e-4 if each table has a chance of one in a thousand."""
    n, loads, strokes, repeats, noise, loss = HEALTHY[bench]
    generator = np.random.default_rng(7)
    contact = {"name": "sheath", "friction": "mu", "wrap_angle": {"value": 90, "unit": "deg"}}
    description = parse_description({"name": "bench", "contact": [contact], "tables": {"forces": {"file": "f.csv"}}})
    alarms = 0
    for _ in range(tables):
        rows = pull(generator, [90.0] * n, [loss] * n, loads, strokes=strokes, repeats=repeats, noise=(noise, noise))
        try:
            check_gains(_table(rows), description)
        except DatasetError:
            alarms += 1
    assert FALSE_ALARM <= 1e-3
    assert alarms <= most


def _table(rows: Readings) -> ForceTable:
    n, (names, run) = len(rows.place), np.unique(rows.label, return_inverse=True)
    unknown, origin = np.full(n, np.nan), RowOrigin.below_heading("forces.csv", n)
    own_angles = OwnAngles.none((), n)
    return ForceTable(unknown, rows.force_in, rows.force_out, run, tuple(names), rows.stroke, own_angles, origin, unknown)


def test_an_efficiency_above_1_within_its_error_is_read_and_one_beyond_it_is_refused(tmp_path, accept, refuse):
    (tmp_path / "cable.toml").write_text(
        """
        name = "hardly any friction"
        contact = [{ name = "sheath", friction = "mu", wrap_angle = { value = 90, unit = "deg" } }]
        tables = { efficiencies = { file = "efficiencies.csv" } }
        """
    )
    table = tmp_path / "efficiencies.csv"
    table.write_text("efficiency,efficiency_sd\n0.99,0.02\n1.03,0.02\n")
    assert "103.0 %" in accept("check", tmp_path)
    table.write_text("efficiency,efficiency_sd\n0.99,0.02\n1.13,0.02\n")
    assert "above 1" in refuse("check", tmp_path)
    table.write_text("efficiency_percent\n99\n103\n")
    assert "efficiency_sd" in refuse("check", tmp_path)


def test_gain_errors_of_both_cells_add_in_quadrature_and_one_for_both_is_refused(tmp_path, refuse):
    rows = _bench()
    both = refuse("check", write(tmp_path / "both", rows, more="[sensors]\ngain_error_sd = 0.005\n"))
    assert "input_gain_error_sd = 0.005 and output_gain_error_sd = 0.005" in both
    first = refuse("check", write(tmp_path / "one", rows, more="[sensors]\noutput_gain_error_sd = 0.005\n"))
    assert "input_gain_error_sd too" in first
    assert Sensors(input_gain_error_sd=0.003, output_gain_error_sd=0.004).gain_sd == pytest.approx(0.005)
    assert Sensors.model_validate({"gain_error_sd": None}).gain_sd is None  # as older results have stored it


@pytest.mark.parametrize(("strokes", "more", "message"), [
    ((1,), "", "only pulls were read"), ((-1,), "", "only returns were read"), ((1, -1), "", ""),
    ((1,), "[sensors]\ninput_gain_error_sd = 0.0\noutput_gain_error_sd = 0.0\n", ""),
])  # fmt: skip
def test_readings_of_one_stroke_that_cannot_tell_the_gains_of_the_cells_are_warned_of(tmp_path, accept, strokes, more, message):
    """One percent of gain over the mean loss of 0.31 is 3 % of the coefficient."""
    out = " ".join(accept("check", write(tmp_path, _bench(strokes=strokes), more=more)).split())
    assert (message in out) if message else ("look like friction" not in out)
    assert not message or "by 1 %, coefficients are wrong by 3 %" in out
