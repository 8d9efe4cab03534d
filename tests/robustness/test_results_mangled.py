"""Whatever is done to the files of a results folder: `--resume` and later questions read them, or refuse them in a sentence."""

import random
import shutil
from pathlib import Path

import pytest
from fuzzing_results import (
    ask_fit,
    begun_calibration,
    begun_fleet,
    interrupted_fit,
    mangle,
    read_mangled_results,
    resume_calibration,
    resume_fit,
    resume_fleet,
)

import bowdenfit as bf

pytestmark = pytest.mark.extended

YARN = Path(__file__).resolve().parents[2] / "datasets" / "yarn-on-cylinder"
FLEET = {"kept/*.npz": 25, "kept/begun.json": 20}
MANY = 1000


def refused(count, *of_case):
    return sum(read_mangled_results(*of_case[:3], number, *of_case[3:]).refused for number in range(count))


@pytest.fixture(scope="module")
def interrupted(tmp_path_factory):
    data = bf.read(YARN)
    return interrupted_fit(tmp_path_factory.mktemp("interrupted") / "fit", data), lambda folder: resume_fit(
        folder, data
    )


@pytest.fixture(scope="module")
def calibration(tmp_path_factory):
    return begun_calibration(tmp_path_factory.mktemp("begun") / "calibration")


@pytest.fixture(scope="module")
def fleet(tmp_path_factory):
    return begun_fleet(tmp_path_factory.mktemp("begun") / "fleet")


@pytest.fixture(scope="module")
def finished(least_squares_of, tmp_path_factory):
    folder = tmp_path_factory.mktemp("finished") / "fit"
    least_squares_of("yarn-on-cylinder").save(folder)
    return folder


@pytest.mark.parametrize("count", [60, pytest.param(MANY, marks=pytest.mark.slow)])
def test_a_mangled_checkpoint_is_resumed_or_refused(tmp_path, interrupted, count):
    folder, resume = interrupted
    assert 0.4 * count < refused(count, tmp_path, folder, "chain.checkpoint", resume) < count


@pytest.mark.parametrize("count", [60, pytest.param(MANY, marks=pytest.mark.slow)])
def test_mangled_replications_are_resumed_or_refused(tmp_path, calibration, count):
    records = refused(count, tmp_path, calibration, "replications.jsonl", resume_calibration, str(tmp_path))
    assert 0.4 * count < records < count


@pytest.mark.parametrize("times", [1, pytest.param(30, marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", FLEET)
def test_a_mangled_fleet_is_resumed_or_refused(tmp_path, fleet, name, times):
    resume_fleet(shutil.copytree(fleet, tmp_path / "whole"))
    refused(times * FLEET[name], tmp_path, fleet, name, resume_fleet)  # in a sentence, or read: asked of every case


@pytest.mark.parametrize("times", [1, pytest.param(30, marks=pytest.mark.slow)])
def test_draws_of_a_fleet_are_refused_as_soon_as_a_byte_differs(tmp_path, fleet, times):
    """HDF5 goes in circles for ever over some of them (number 5892), so that it must not be asked to open them."""
    for number in (*range(times * 25), 5892):
        shutil.copy(fleet / "fleet.nc", tmp_path / "fleet.nc")
        mangle(random.Random(f"fleet.nc {number}"), tmp_path / "fleet.nc")
        differs = (tmp_path / "fleet.nc").read_bytes() != (fleet / "fleet.nc").read_bytes()
        assert read_mangled_results(tmp_path, fleet, "fleet.nc", number, resume_fleet).refused == differs, number


@pytest.mark.parametrize("times", [1, pytest.param(30, marks=pytest.mark.slow)])
def test_a_mangled_fit_is_refused(tmp_path, finished, times):
    assert refused(times * 20, tmp_path, finished, "fit.json", ask_fit) > 0.9 * times * 20  # a value may be as it was


@pytest.mark.parametrize("times", [1, pytest.param(30, marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", ["answers.json", "summary.json"])
def test_a_fit_whose_answers_are_mangled_is_read(tmp_path, finished, name, times):
    assert refused(times * 20, tmp_path, finished, name, ask_fit) == 0
