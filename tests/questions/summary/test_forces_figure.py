"""The figure of a table of forces: readings, the fitted law, what they are off it, and apparent friction against the load."""

from dataclasses import replace

import numpy as np
import pytest
from figure_words import check_words, words
from hand_bench import pull, write

import bowdenfit as bf
from bowdenfit.questions.figures import collect_figure_data
from bowdenfit.questions.summary import forces_figure
from bowdenfit.questions.summary.figure_data import MOST_PLACES, MOST_READINGS, ForcesAtBend, ForcesData

LONG = "The model does not describe force runs: around a load of 1.8 N the loss is 65 % larger than the model says; and so on"


def _here(label, mu, load, trusted_law, strokes=(1, -1, 0), shown=True, sign=(1.0, -1.0)):
    """Readings that obey the capstan equation, and a law that does or does not."""
    bend, force = np.pi, np.tile(np.geomspace(load[0], load[-1], 5), len(strokes))
    stroke = np.repeat(strokes, 5)
    exponent = np.array(sign)[:, None] * mu * bend * (np.ones(len(load)) if trusted_law else (load / load[0]) ** -0.3)
    law = np.exp(-exponent) * load * np.array([0.97, 1.0, 1.03])[:, None, None]
    apparent = np.broadcast_to(np.abs(exponent) / bend, law.shape) * np.array([0.9, 1.0, 1.1])[:, None, None]
    slides = np.where(stroke == 0, np.nan, 1.0)
    off = slides * 2.0 * np.where(np.arange(len(force)) % 2, 1, -1)
    read = force * np.exp(-stroke * mu * bend)
    return ForcesAtBend(label, force, read, stroke, off, mu * slides, load, law, apparent, mu, shown)


def _forces(n=1, lowest=1.0, highest=10.0, trusted=True, draws=True, logarithmic=False, names="{} deg"):
    load = np.geomspace(lowest, highest, 21)
    places = tuple(_here(names.format(30 * i), 0.1 + 0.01 * i, load, trusted, shown=i < MOST_PLACES) for i in range(n))
    if not draws:
        places = tuple(replace(p, law=p.law[1:2], apparent_law=p.apparent_law[1:2]) for p in places)
    spread = np.full(21, 3.0) if draws else np.zeros(0)
    return ForcesData(places, load, spread, "capstan", trusted, "" if trusted else LONG, logarithmic, 0 if n == 1 else 9600)


CASES = {
    "one bend": _forces(),
    "three bends without draws": _forces(3, draws=False),
    "many bends": _forces(9),
    "one newton, not trusted": _forces(2, 0.01, 1.0, trusted=False, logarithmic=True),
    "ten kilonewtons": _forces(2, 10.0, 20_000.0, trusted=False, logarithmic=True),
    "five decades": _forces(2, 0.1, 10_000.0, logarithmic=True),
    "long names": _forces(6, names="lubricated rope, {} mm"),
}


@pytest.mark.parametrize("case", CASES)
def test_nothing_overlaps_or_leaves_the_page(case):
    check_words(forces_figure.draw(CASES[case]), case)


@pytest.mark.parametrize(("wide", "shown"), [(0.9, True), (40.0, False)], ids=["wide", "no end"])
def test_the_band_of_the_coefficient_is_seen_whole_unless_readings_would_shrink_to_a_line(wide, shown):
    (panel,) = _forces().places
    band = panel.apparent_law[1] * np.array([1 - wide, 1.0, 1 + wide])[:, None, None]
    neighbors = forces_figure.draw(replace(_forces(), places=(replace(panel, apparent_law=band),))).axes[2]
    low, high = neighbors.get_ylim()
    assert (low <= band.min() and band.max() <= high) == shown
    assert high - low < 0.3  # of a coefficient of 0.1


@pytest.mark.parametrize("trusted", [True, False])
def test_the_verdict_stands_above_the_readings(trusted):
    message = " ".join(text for text, _ in words(forces_figure.draw(_forces(trusted=trusted)))).replace("\n", " ")
    assert ("follow the fitted law (capstan)" in message) == trusted
    assert ("Not trusted. The model does not describe force runs" in message) != trusted and "and so on" not in message


@pytest.fixture(scope="module")
def drag(tmp_path_factory):
    """Two bends of a rope with a hidden tension, without noise: fits with a law that has it and with one that has not."""
    bends = [90.0, 180.0] * 2
    rows = pull(np.random.default_rng(0), bends, 0.12 * np.deg2rad(bends), (2, 4, 8, 16, 64), drag=2.0, noise=(1e-4, 1e-4))
    folder = write(tmp_path_factory.mktemp("drag"), rows)
    fits = {model: bf.fit(folder, friction=model, mcmc=False) for model in ("drag", "capstan")}
    return {model: dict(collect_figure_data(fit, ["forces"]))["forces"] for model, fit in fits.items()}


@pytest.mark.extended
def test_the_law_goes_through_the_readings_only_where_it_is_theirs(drag):
    right, wrong = drag["drag"], drag["capstan"]
    assert right.trusted and not wrong.trusted and right.logarithmic
    assert [place.label for place in right.places] == ["90 deg", "180 deg"]
    for panel in right.places:
        assert np.abs(panel.off).max() < 0.5
        for i, stroke in enumerate((1, -1)):
            mask = panel.stroke == stroke
            law = np.exp(np.interp(np.log(panel.input_force[mask]), np.log(panel.load), np.log(panel.law[0, i])))
            np.testing.assert_allclose(law, panel.output_force[mask], rtol=0.01)
    assert max(np.abs(place.off).max() for place in wrong.places) > 10


def test_apparent_friction_is_the_log_ratio_over_the_bend_and_falls_with_the_load_of_a_drag(drag):
    panel = drag["drag"].places[1]
    pulled = panel.stroke == 1
    ratio = np.log(panel.input_force[pulled] / panel.output_force[pulled])
    np.testing.assert_allclose(panel.apparent[pulled], ratio / np.pi)
    assert panel.apparent[pulled][0] > 1.5 * panel.apparent[pulled][-1]
    assert panel.apparent_law[0, 0, 0] > 1.5 * panel.apparent_law[0, 0, -1]
    level = drag["capstan"].places[1].apparent_law[0]
    assert np.ptp(level) < 1e-6 and level[0, 0] == pytest.approx(panel.capstan, rel=0.2)


@pytest.mark.extended
def test_held_readings_have_no_residual_and_of_many_some_are_shown(tmp_path):
    rows = pull(np.random.default_rng(1), [180.0] * 4, [0.4] * 4, (20, 40, 60), repeats=60, noise=(0.1, 0.1), scatter=0.01)
    stroke = np.where(np.arange(len(rows.stroke)) % 5 == 0, 0, rows.stroke)
    folder = write(tmp_path, rows)
    text = (folder / "forces.csv").read_text().splitlines()
    held = [line.replace("pull", "hold") if number == 0 else line for line, number in zip(text[1:], stroke, strict=True)]
    (folder / "forces.csv").write_text("\n".join([text[0], *held]) + "\n")
    forces = dict(collect_figure_data(bf.fit(folder, mcmc=False), ["forces"]))["forces"]
    (panel,) = forces.places
    assert forces.count == len(rows.stroke) > len(panel.stroke) == MOST_READINGS
    assert np.isnan(panel.off[panel.stroke == 0]).all() and np.isfinite(panel.off[panel.stroke != 0]).all()
