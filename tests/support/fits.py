"""Fits that many files of tests look at and none changes: made once in a run, whichever of its processes asks first."""

import os
from collections.abc import Callable
from functools import cache
from pathlib import Path

import pytest
from filelock import FileLock

import bowdenfit as bf

DATASETS = Path(__file__).resolve().parents[2] / "datasets"
# Settings with which angles follow their curves exactly, of cables whose contacts with a curve come first.
NO_DEPARTURES = tuple(f"contact.{number}.wrap_angle.departure=none" for number in range(2))


def shared_folder(factory: pytest.TempPathFactory) -> Path:
    """The temporary folder of the whole run; that of every process lies in it where there are several."""
    own_folder = factory.getbasetemp()
    return own_folder.parent if "PYTEST_XDIST_WORKER" in os.environ else own_folder


def made_once(place: Path, make: Callable[[Path], object]) -> Path:
    """A results folder, made by the first process that asks; others wait for it.

    Args:
        place: The folder.
        make: Makes a fit there.
    """
    with FileLock(place.with_suffix(".lock")):
        if not (place / "fit.json").exists():
            make(place)
    return place


def least_squares_of(factory: pytest.TempPathFactory) -> Callable[[str], bf.Fit]:
    """Least squares of a published data set, by its name."""

    @cache
    def fitted(name: str) -> bf.Fit:
        place = shared_folder(factory) / f"least-squares-of-{name}"
        return bf.load(made_once(place, lambda folder: bf.fit(DATASETS / name, seed=1, mcmc=False).save(folder)))

    return fitted
