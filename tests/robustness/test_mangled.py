"""Valid data sets mangled at random: each is read, or refused in one sentence; never anything else."""

import random
import shutil
import time
from pathlib import Path

import pytest
from mangling import DESCRIPTIONS, TABLES

import bowdenfit as bf

DATASETS = sorted(
    path for path in (Path(__file__).resolve().parents[2] / "datasets").iterdir() if (path / "cable.toml").exists()
)
LONGEST = 900  # characters of a sentence
SLOWEST = 20.0  # seconds, on a machine that does much besides


def mangled(source, place, chance):
    """The data set with one of its files mangled, once or twice; the name of that file."""
    folder = shutil.copytree(source, place, ignore=shutil.ignore_patterns("*.md", "recordings"))
    for path in source.glob("recordings/*"):
        (folder / "recordings").mkdir(exist_ok=True)
        (folder / "recordings" / path.name).symlink_to(path)
    name = chance.choice(sorted(path.name for path in folder.iterdir() if path.suffix in {".csv", ".toml"}))
    text = (folder / name).read_text()
    for _ in range(chance.choice([1, 1, 2])):
        text = chance.choice(DESCRIPTIONS if name.endswith(".toml") else TABLES)(chance, text) or "\n"
    (folder / name).write_text(text, encoding="utf-8", errors="surrogatepass")
    return folder, name


def read_all(tmp_path, source, seeds):
    """Reads them all; how many were refused."""
    refused = 0
    for seed in seeds:
        folder, name = mangled(source, tmp_path / "cable", random.Random(f"{source.name} {seed}"))
        before, start = set(tmp_path.rglob("*")), time.monotonic()
        try:
            bf.read(folder)
        except bf.BowdenfitError as error:
            refused += 1
            said = str(error)
            lines = said.splitlines()[1:] if error.faults and "\n" in said else said.splitlines()
            is_sentence = error.exit_code == 2 and all(10 < len(one) <= LONGEST and one[-1] in ".?)" for one in lines)
            if not is_sentence:
                raise AssertionError(f"{source.name}, seed {seed}, {name}: {said}") from None
        except Exception as error:
            raise AssertionError(f"{source.name}, seed {seed}, {name}: {type(error).__name__}: {error}") from error
        assert time.monotonic() - start < SLOWEST, (seed, name)
        assert set(tmp_path.rglob("*")) == before
        shutil.rmtree(folder)
    return refused


@pytest.mark.parametrize("source", DATASETS, ids=lambda path: path.name)
def test_mangled_data_sets_are_read_or_refused_in_a_sentence(tmp_path, source):
    count = {"synthetic-recordings": 40, "synthetic-bench": 230, "synthetic-haptic-loop": 230}.get(source.name, 750)
    assert 0.2 * count < read_all(tmp_path, source, range(count)) < count


@pytest.mark.slow
@pytest.mark.parametrize("source", DATASETS, ids=lambda path: path.name)
def test_many_more_mangled_data_sets(tmp_path, source):
    count = 1_000 if (source / "recordings").exists() else 12_000
    assert read_all(tmp_path, source, range(1_000, 1_000 + count)) < count
