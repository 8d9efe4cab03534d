"""One golden fit of each shipped data set: least squares, to four digits, as they were when the numbers were last looked at.

`python tests/data_sets/test_golden_fits.py` prints the numbers anew; whoever changes them says why in the commit.
"""

import json
import sys
from pathlib import Path

import numpy as np
import pytest

import bowdenfit as bf

DATASETS = Path(__file__).parents[2] / "datasets"
GOLDEN = json.loads(Path(__file__).with_name("golden.json").read_text())


def estimates(fit):
    """Least squares by parameter, to six digits; None where the readings do not determine one."""
    values = {name: estimate.value for name, estimate in fit.least_squares.estimates.items()}
    return {name: float(f"{value:.6g}") if np.isfinite(value) else None for name, value in values.items()}


def test_every_shipped_data_set_has_a_golden_fit():
    assert sorted(GOLDEN) == sorted(path.parent.name for path in DATASETS.glob("*/cable.toml"))


def least_squares(name):
    """Least squares of a data set whose angles follow their curves exactly."""
    contacts = bf.read(DATASETS / name).description.contact
    curved = [number for number, contact in enumerate(contacts) if contact.wrap_angle.curve is not None]
    settings = [f"contact.{number}.wrap_angle.departure=none" for number in curved]
    return bf.fit(DATASETS / name, seed=1, mcmc=False, settings=settings)


@pytest.mark.parametrize("name", GOLDEN)
def test_least_squares_are_the_golden_ones(name):
    fit = least_squares(name)
    assert fit.converged
    assert estimates(fit) == {parameter: value and pytest.approx(value, rel=1e-4) for parameter, value in GOLDEN[name].items()}


if __name__ == "__main__":
    names = sorted(path.parent.name for path in DATASETS.glob("*/cable.toml"))
    json.dump({name: estimates(least_squares(name)) for name in names}, sys.stdout, indent=1)
