"""Valid tables, descriptions, options and files mangled at random: each is read, or refused in sentences; never anything else.

Usually some 1,000 cases; with the marker `slow` 100,000 others. `./scripts/test -m slow tests/robustness --cases 500
--first-case 90000` tries 500 new ones of each kind.
"""

import resource

import pytest
from fuzzing import (
    DATASETS,
    check_strange_data_set,
    read_mangled_data_set,
    read_mangled_file,
    run_mangled_options,
    try_cases,
    valid_files,
)
from fuzzing_folders import FOLDERS, read_mangled_folder
from limited_processes import Attempts
from recorded_files import WRITERS

pytestmark = pytest.mark.extended

OF_TABLES = {"synthetic-recordings": 6, "synthetic-bench": 30, "synthetic-haptic-loop": 30}
MOST_MEMORY = 600 << 20  # bytes by which all of them may raise what the process holds


@pytest.fixture(scope="module")
def valid(tmp_path_factory):
    return valid_files(tmp_path_factory.mktemp("valid") / "files")


@pytest.fixture(scope="module")
def attempts():
    server = Attempts()
    yield server
    server.end()


@pytest.fixture(autouse=True)
def bounded(capfd):
    usage_at_start = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
    yield
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 < usage_at_start + MOST_MEMORY
    assert capfd.readouterr() == ("", "")


def options_of(attempts, place):
    def run(arguments):
        files_at_start = set(place.rglob("*"))
        done = attempts(*arguments, folder=place)
        assert set(place.rglob("*")) == files_at_start
        assert done.seconds < 10
        assert done.memory < MOST_MEMORY
        return done.code, done.out, done.err

    return run


@pytest.mark.parametrize("name", [path.name for path in DATASETS])
def test_mangled_data_sets_are_read_or_refused_in_sentences(tmp_path, name):
    count = OF_TABLES.get(name, 50)
    refused = sum(read_mangled_data_set(tmp_path, name, number).refused for number in range(count))
    assert 0.2 * count < refused < count


@pytest.mark.parametrize("name", [path.name for path in DATASETS])
def test_strange_data_sets_are_checked_or_refused_in_sentences(tmp_path, name):
    count = 2 if name == "synthetic-recordings" else 10
    try_cases(range(count), lambda number: check_strange_data_set(tmp_path, name, number))


@pytest.mark.parametrize("name", WRITERS)
def test_mangled_files_of_every_kind_are_read_or_refused_in_sentences(tmp_path, valid, name):
    outcomes = [read_mangled_file(tmp_path, valid, name, number) for number in range(25)]
    refused = sum(outcome.refused for outcome in outcomes)
    assert refused > 3 and (refused < 25 or name == "zip.xlsx")  # else what is mangled was none of ours to begin with


@pytest.mark.parametrize("name", FOLDERS)
def test_mangled_devices_studies_and_fleets_are_read_or_refused_in_sentences(tmp_path, name):
    count = 40 if name == "fleet" else 70
    refused = sum(read_mangled_folder(tmp_path, name, number).refused for number in range(count))
    assert 0.2 * count < refused < count


def test_mangled_options_are_taken_or_refused_in_sentences(tmp_path, attempts):
    outcomes = [run_mangled_options(options_of(attempts, tmp_path), number) for number in range(120)]
    assert 66 < sum(outcome.refused for outcome in outcomes) < 120


@pytest.mark.slow
@pytest.mark.parametrize("name", [path.name for path in DATASETS])
def test_many_more_mangled_data_sets(tmp_path, cases, name):
    numbers = cases(range(OF_TABLES.get(name, 50), 2000 if name == "synthetic-recordings" else 7000))
    try_cases(numbers, lambda number: read_mangled_data_set(tmp_path, name, number))


@pytest.mark.slow
@pytest.mark.parametrize("name", [path.name for path in DATASETS])
def test_many_more_strange_data_sets(tmp_path, cases, name):
    numbers = cases(range(10, 200 if name == "synthetic-recordings" else 5000))
    try_cases(numbers, lambda number: check_strange_data_set(tmp_path, name, number))


@pytest.mark.slow
@pytest.mark.parametrize("name", WRITERS)
def test_many_more_mangled_files(tmp_path, valid, cases, name):
    try_cases(cases(range(1000, 2000)), lambda number: read_mangled_file(tmp_path, valid, name, number))


@pytest.mark.slow
@pytest.mark.parametrize("name", FOLDERS)
def test_many_more_mangled_devices_studies_and_fleets(tmp_path, cases, name):
    try_cases(cases(range(1000, 3000)), lambda number: read_mangled_folder(tmp_path, name, number))


@pytest.mark.slow
def test_many_more_mangled_options(tmp_path, attempts, cases):
    try_cases(cases(range(120, 4000)), lambda number: run_mangled_options(options_of(attempts, tmp_path), number))
