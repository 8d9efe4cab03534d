"""No mistake in a table ends with a wrong answer that says all is well."""

import shutil
from pathlib import Path

import pytest
from corruptions import CORRUPTIONS, corrupt, read_by_a_fit
from mistaken_data_sets import HARMLESS, NOT_TRUSTED, REFUSED, WRONG, answers, end_of

import bowdenfit as bf

pytestmark = pytest.mark.extended

DATASETS = Path(__file__).parents[2] / "datasets"
ON_BODY, BENCH, CATHETER, LOOP, RECORDINGS, YARN = sorted(path.parent.name for path in DATASETS.glob("*/cable.toml"))
MISTAKES = {
    (3, RECORDINGS): REFUSED,  # input and output exchanged
    (4, YARN): NOT_TRUSTED,  # input_force_lbf for N
    (7, LOOP): REFUSED,  # bends with the other sign
    (30, ON_BODY): REFUSED,  # rad for deg
    (41, BENCH): REFUSED,  # output_force_lbf for N
    (45, ON_BODY): NOT_TRUSTED,  # an efficiency of a tenth
    (65, ON_BODY): HARMLESS,  # lengths exchanged by a row
    (74, YARN): REFUSED,  # headings shifted by a column
    (79, YARN): HARMLESS,  # two runs with one label
    (96, BENCH): REFUSED,  # output_force with the other sign
}


@pytest.fixture(scope="module")
def clean(least_squares_of):
    """Answers by least squares of the data sets without a mistake, and of the rest none are needed."""
    return {name: answers(least_squares_of(name)) for name in (ON_BODY, YARN)}


@pytest.mark.parametrize(("seed", "name"), MISTAKES)
def test_a_mistake_is_refused_or_not_trusted_or_does_no_harm(tmp_path, clean, seed, name):
    corrupt(DATASETS / name, tmp_path / name, seed)
    end, reason = end_of(tmp_path / name, clean.get(name, {}), mcmc=False)
    assert end == MISTAKES[seed, name], reason


def test_a_mistake_that_no_table_shows_counts_as_wrong(tmp_path, clean):
    """An output cell whose gain is a twelfth too small."""
    shutil.copytree(DATASETS / YARN, tmp_path / YARN)
    path = tmp_path / YARN / "forces.csv"
    lines = path.read_text().splitlines()
    start = next(i for i, line in enumerate(lines) if not line.startswith("#"))
    k = lines[start].split(",").index("output_force_N")
    rows = [line.split(",") for line in lines[start + 1 :]]
    scaled = [",".join([*row[:k], f"{float(row[k]) / 1.08:.6g}", *row[k + 1 :]]) for row in rows]
    path.write_text("\n".join([*lines[: start + 1], *scaled]) + "\n")
    end, reason = end_of(tmp_path / YARN, clean[YARN], mcmc=False)
    assert end == WRONG
    assert reason.startswith("mu ")


def test_every_kind_of_mistake_is_made_in_files_that_a_fit_reads(tmp_path):
    assert [path.name for path in read_by_a_fit(DATASETS / ON_BODY)] == ["angles.csv", "efficiencies.csv"]
    made = " ".join(corrupt(DATASETS / BENCH, tmp_path / str(seed), seed) for seed in range(60))
    kinds = ("exchanged", "_lbf for ", "times", "other sign", "shifted", "rows ", "labeled")
    assert len(kinds) == len(CORRUPTIONS) and all(kind in made for kind in kinds)


@pytest.mark.slow
def test_none_of_a_hundred_mistakes_ends_trusted_and_wrong(tmp_path):
    """And every data set is trusted without one."""
    folders = sorted(path.parent for path in DATASETS.glob("*/cable.toml"))
    fits = [bf.fit(folder, seed=1) for folder in folders]
    assert all(fit.verdict().trusted for fit in fits)
    clean_answers, wrong = [answers(fit) for fit in fits], []
    for seed in range(100):
        which, folder = seed % len(folders), tmp_path / str(seed)
        corruption = corrupt(folders[which], folder, seed)
        end, reason = end_of(folder, clean_answers[which], mcmc=True)
        wrong += [f"{seed} {corruption}: {reason}"] if end == WRONG else []
    assert not wrong
