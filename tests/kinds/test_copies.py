"""Readings that were pasted twice or saved as another run are said to be copies; those that are only alike are not."""

import shutil
from pathlib import Path

import hand_bench
import numpy as np
import pytest

import bowdenfit as bf
from bowdenfit.kinds.plausibility import ComparedReadings, describe_copies
from bowdenfit.questions.check.data_set_words import describe_copied_readings, describe_data_set
from bowdenfit.questions.summary.brief import summary_text
from bowdenfit.questions.summary.verdict import COPIED

pytestmark = pytest.mark.extended

DATASETS = Path(__file__).parents[2] / "datasets"
LOADS = (10.0, 20.0, 40.0, 60.0, 80.0)
TABLES = (
    ("on-body-exoskeleton", "angles.csv"), ("synthetic-bench", "forces.csv"), ("synthetic-haptic-loop", "loop.csv"),
    ("synthetic-haptic-loop", "stretch.csv"), ("synthetic-catheter", "displacement.csv"), ("yarn-on-cylinder", "forces.csv"),
)  # fmt: skip


def bench(runs=4, seed=3, repeats=2, bend=180.0):
    """Rows of a bench of some mountings, both strokes."""
    return hand_bench.pull(
        np.random.default_rng(seed), [bend] * runs, [0.12 * np.deg2rad(bend)] * runs, LOADS, repeats=repeats,
        noise=(0.3, 0.3), scatter=0.02,
    )  # fmt: skip


def pasted(folder, name, file):
    """A published data set, one of its tables with all rows once more."""
    shutil.copytree(DATASETS / name, folder / name)
    path = folder / name / file
    lines = path.read_text().splitlines()
    heading = next(i for i, line in enumerate(lines) if not line.startswith("#"))
    path.write_text("\n".join([*lines, *lines[heading + 1 :]]) + "\n")
    return bf.read(folder / name)


@pytest.mark.parametrize(("name", "file"), TABLES)
def test_a_table_that_was_pasted_twice_is_said_to_be(tmp_path, name, file):
    (sentence,) = describe_copied_readings(pasted(tmp_path, name, file))
    assert sentence.startswith("Every reading") and f"{file} stands there twice, to the last digit: rows " in sentence
    assert f" of {file} are copies of rows " in sentence
    assert "leave them out" in sentence


def test_no_published_table_is_said_to_be_copied():
    for path in sorted(DATASETS.glob("*/cable.toml")):
        assert describe_copied_readings(bf.read(path.parent)) == (), path.parent.name


def test_a_run_that_was_saved_as_another_one_is_named_and_its_fit_is_not_trusted(tmp_path):
    """Even where it is said to be read at another bend; without the copy the fit is trusted."""
    rows = bench()
    first = np.flatnonzero(rows.label == "1")
    again = np.r_[np.arange(len(rows.label)), first]
    copied = hand_bench.Readings(*(field[again] for field in vars(rows).values()))
    copied.label[-len(first) :], copied.place[-len(first) :] = "5", 90.0
    fit = bf.fit(hand_bench.write(tmp_path / "copied", copied), mcmc=False)
    (sentence,) = fit.verdict().troubles[COPIED]
    assert sentence.startswith("Run 5 of forces.csv holds the same 20 readings as run 1, to the last digit.")
    assert "some of the readings are copies of others" in summary_text(fit).splitlines()[0]
    assert "1 warning" in describe_data_set(fit.dataset)
    clean = bf.fit(hand_bench.write(tmp_path / "clean", rows), mcmc=False)
    assert COPIED not in clean.verdict().troubles


def test_a_recording_under_another_name_is_said_to_be_the_same(tmp_path):
    folder = tmp_path / "recordings"
    shutil.copytree(DATASETS / "synthetic-recordings", folder)
    names = sorted(path.name for path in (folder / "recordings").glob("*.csv"))
    shutil.copy(folder / "recordings" / names[0], folder / "recordings" / names[1])
    (sentence,) = describe_copied_readings(bf.read(folder))
    assert sentence.startswith(
        "The recording 470 mm, 20 r/min holds the same forces as the recording 440 mm, 20 r/min, to"
    )


def simulated(generator):
    """Forces of a bench: loads, strokes, repeats, scatter, noise and last digit; and the noise in last digits."""
    loads = np.sort(generator.choice([5, 10, 20, 30, 40, 60, 80, 100, 120], generator.integers(1, 8), replace=False))
    runs, repeats, strokes = generator.integers(1, 8), generator.integers(1, 4), generator.integers(1, 3)
    noise, digit = generator.choice([0.0, 0.03, 0.1, 0.3, 1.0]), 10.0 ** generator.uniform(-3, 1)
    hung, scatter = generator.random() < 0.5, generator.choice([0.0, 0.005, 0.02, 0.1])
    run, load, stroke, _ = (
        part.ravel() for part in np.meshgrid(range(runs), loads, (1, -1)[:strokes], range(repeats), indexing="ij")
    )
    loss = 0.3 + scatter * generator.standard_normal(runs)[run]
    out = load * np.exp(-stroke * loss) * (1 + 0.0005 * load)
    fed, out = (force + noise * generator.standard_normal(len(load)) for force in (1.0 * load, out))
    fed, out = (np.round(force / digit) * digit for force in (1.0 * load if hung else fed, out))
    return np.column_stack([run, stroke, fed, out]), noise / digit


def compared(rows):
    run = rows[:, 0].astype(int)
    names = tuple(f"run {k}" for k in range(run.max() + 1))
    return ComparedReadings("forces.csv", run, names, rows[:, 1:2], rows[:, 2:], rows[:, 2], 3 * run + rows[:, 1].astype(int))


def test_readings_that_are_only_alike_are_never_called_copies_and_most_copies_are_found():
    """Of 400 healthy benches none, by design one of a million each. Of pasted tables of 30 readings and more, whose noise is
    five last digits or more, nine in ten are found, and of copied runs of ten readings and more. Of 2000 benches 96 and 99 of
    100 were, so that chance fails this once in 100 seeds or less.
    """
    generator, computed = np.random.default_rng(7), {"pasted": [], "saved": []}
    for _ in range(400):
        rows, fineness = simulated(generator)
        assert describe_copies(compared(rows)) == []
        if len(rows) >= 30 and fineness > 5:
            first = rows[rows[:, 0] == 0].copy()
            computed["pasted"].append(bool(describe_copies(compared(np.vstack([rows, rows])))))
            if len(first) >= 10:
                first[:, 0] = rows[:, 0].max() + 1
                computed["saved"].append(bool(describe_copies(compared(np.vstack([rows, first])))))
    assert all(len(hits) > 30 and np.mean(hits) > 0.9 for hits in computed.values()), computed


def test_a_pasted_table_of_three_loads_in_each_run_is_said_to_be_where_no_load_repeats():
    """Three readings show no noise about a curve, and do about a line; the runs of one who sets loads without noise do not."""
    generator, run = np.random.default_rng(5), np.repeat(np.arange(6), 3)
    loads = generator.uniform(30, 60, 18)
    out = (loads * np.exp(-0.3) + 0.2 * generator.standard_normal(18)).round(2)
    rows = np.column_stack([run, np.ones(18), loads.round(2), out])
    assert len(describe_copies(compared(np.vstack([rows, rows])))) == 1
    assert describe_copies(compared(rows)) == []
    set_loads = np.tile([20.0, 40.0, 60.0], 6)
    exact = np.column_stack([run, np.ones(18), set_loads, (0.7 * set_loads * (1 + 0.001 * set_loads)).round(2)])
    assert describe_copies(compared(np.vstack([exact, exact]))) == []


def test_readings_without_noise_are_no_copies():
    """Two mountings of a computed bench are the same to the last digit; so are readings of a coarse display."""
    loads = np.repeat(np.array(LOADS), 4)
    for out in (0.7 * loads * (1 + 0.001 * loads), np.round(0.7 * loads)):
        run_rows = np.column_stack([np.zeros(20), np.ones(20), loads, out])
        assert describe_copies(compared(np.vstack([run_rows, run_rows + np.eye(4)[0]]))) == []
