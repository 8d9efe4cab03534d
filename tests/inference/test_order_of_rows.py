"""No answer depends on the order of a table's rows: the density is the same function, and so are verdict and estimates.

Tables whose rows are one way in time (recordings, force against displacement, a ring-down) are not among them.
"""

import shutil
from pathlib import Path

import numpy as np
import pytest
from densities import over_rows

import bowdenfit as bf
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.models import build_model

pytestmark = pytest.mark.extended

DATASETS = Path(__file__).parents[2] / "datasets"
POINTS = 0.7 * np.random.default_rng(0).standard_normal((4, 40))
CASES = {
    "efficiencies": ("on-body-exoskeleton", ()),
    "forces": ("synthetic-bench", ("friction_model=drag",)),
    "forces with robust noise": ("yarn-on-cylinder", ("noise=student",)),
    "stretch, preload and loop": ("synthetic-haptic-loop", ()),
}


def shuffled(folder: Path, name: str, seed: int) -> Path:
    """A data set with the rows of every table in another order."""
    shutil.copytree(DATASETS / name, folder)
    generator = np.random.default_rng(seed)
    for file in folder.rglob("*.csv"):
        lines = file.read_text().splitlines()
        start = 1 + next(i for i, line in enumerate(lines) if not line.startswith("#"))
        rows = [lines[start + k] for k in generator.permutation(len(lines) - start)]
        assert rows != lines[start:]
        file.write_text("\n".join([*lines[:start], *rows]) + "\n")
    return folder


@pytest.mark.parametrize("case", CASES)
def test_the_order_of_rows_leaves_the_log_density_as_it_is(case, tmp_path):
    name, settings = CASES[case]
    results = []
    for folder in (DATASETS / name, shuffled(tmp_path / "other", name, 1)):
        model = build_model(bf.read(folder, settings=list(settings)))
        density, z = LogDensity(model), POINTS[:, : model.space.size]
        results.append(over_rows(density.log_density, z, density.data))
    np.testing.assert_allclose(results[1], results[0], rtol=1e-10)


def test_the_order_of_rows_leaves_verdict_and_estimates_as_they_are(tmp_path):
    name = "synthetic-bench"
    plain, other = (bf.fit(folder, mcmc=False) for folder in (DATASETS / name, shuffled(tmp_path / "other", name, 2)))
    assert plain.verdict().trusted == other.verdict().trusted
    assert plain.verdict().troubles == other.verdict().troubles
    for name, estimate in plain.least_squares.estimates.items():
        assert other.least_squares.estimates[name].value == pytest.approx(estimate.value, rel=1e-6, nan_ok=True), name
