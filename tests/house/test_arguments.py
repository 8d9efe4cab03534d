"""Arguments of functions as notebooks write them: taken as they are meant, or refused with what to write."""

from pathlib import Path

import numpy as np
import pytest

import bowdenfit as bf
from bowdenfit.arguments import read_first

pytestmark = pytest.mark.extended


@pytest.fixture(scope="module")
def fit(quick_results):
    return bf.load(quick_results)


@pytest.mark.parametrize(
    "lengths", [470, "470", "470 mm", [470], (470,), np.array([470.0]), ["470mm"], (0.47, "m"), [(47, "cm")]]
)
def test_lengths_are_numbers_texts_or_arrays_of_them(fit, lengths):
    (row,) = bf.predict(fit, lengths, input_force="50N")
    assert row == bf.predict(fit, [470.0], input_force=(50.0, "N"))[0]


@pytest.mark.parametrize("angles", ["90deg", (90, "deg"), ["90deg"], [(90, "deg")], [(np.pi / 2, "rad")]])
def test_one_wrap_angle_need_not_be_a_list(loop_results, angles):
    (row,) = bf.predict(bf.load(loop_results), wrap_angles=angles)
    assert row["wrap_angle_deg"] == pytest.approx(90)


@pytest.mark.parametrize("make", [str, lambda text: [text], lambda text: iter([text])])
def test_one_setting_need_not_be_a_list(on_body, make):
    result = bf.check(on_body, settings=make("friction.mu1.fixed=0.1"))
    assert result.description.friction["mu1"].fixed == 0.1


@pytest.mark.parametrize(
    ("keywords", "words"),
    [
        ({"input_force": 50}, "input_force = 50 is not a number with its unit; write it as '100N', or as (100, 'N')"),
        ({"input_force": (50, 3)}, "is not a number with its unit"),
        ({"input_force": (float("nan"), "N")}, "is not a number with its unit"),
        ({"input_force": "50"}, "input_force '50' is not a number with its unit; write it as 100N"),
        ({"stroke": "push"}, "stroke = 'push' is unknown; choose one of pull, return"),
        ({"quantity": "torque"}, "quantity = 'torque' is unknown; choose one of efficiency, "),
        ({"wrap_angles": 90}, "wrap_angles = 90 is not a number with its unit; write it as '90deg', or as (90, 'deg')"),
        ({"lengths": [None]}, "lengths = [None] must be lengths, such as [455, 470]"),
        ({"lengths": "long"}, "lengths 'long' is not a number"),
        ({"lengths": []}, "lengths = [] names no length; name some, or leave it out"),
        ({"gait": 3}, "gait = 3 must be a path"),
    ],
)
def test_what_is_not_clear_is_refused_with_what_to_write(fit, keywords, words):
    with pytest.raises(bf.UsageError) as refused:
        bf.predict(fit, **keywords)
    assert words in str(refused.value)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda _: bf.fit(123), "dataset = 123 must be a path"),
        (lambda _: bf.fit(None), "dataset = None must be a path"),
        (lambda _: bf.read(123), "dataset = 123 must be a path"),
        (lambda _: bf.check([]), "dataset = [] must be a path"),
        (lambda on_body: bf.fit(on_body, seed="a"), "seed = 'a' must be a whole number from 0 to 2147483647"),
        (lambda on_body: bf.fit(on_body, seed=True), "seed = True must be a whole number"),
        (lambda on_body: bf.fit(on_body, seed=-1), "seed = -1 must be a whole number"),
        (lambda on_body: bf.fit(on_body, sampler="hmc"), "sampler = 'hmc' is unknown"),
        (lambda on_body: bf.fit(on_body, settings={"a": 1}), "must be a list of texts, such as ['name=value']"),
        (lambda on_body: bf.fit(on_body, settings=3), "settings = 3 must be a list of texts"),
        (lambda on_body: bf.read(on_body, wrap_angle=180), "wrap_angle = 180 is not a number with its unit"),
        (lambda on_body: bf.calibrate(on_body, replications=1), "replications = 1 must be a whole number from 2"),
        (lambda on_body: bf.predict(on_body), "fit must be a fit; write bowdenfit.load("),
        (lambda _: bf.compare(["a"]), "fits must be a dictionary of fits by name"),
        (lambda _: bf.compare({"one": "fits/a"}), "fits['one'] must be a fit; write bowdenfit.load('fits/a')"),
    ],
)
def test_what_cannot_be_meant_is_refused_before_anything_is_done(on_body, call, words):
    with pytest.raises(bf.UsageError) as refused:
        call(on_body)
    assert words in str(refused.value)


def test_where_a_folder_may_stand_for_its_fit_it_is_taken(quick_results, fit):
    named = {str(bf.next_measurement(result)) for result in (fit, quick_results, str(quick_results))}
    assert len(named) == 1


def test_every_public_function_reads_its_arguments():
    functions = {name for name in dir(bf) if not isinstance(getattr(bf, name), type)}
    assert {name for name in functions if not hasattr(getattr(bf, name), "__wrapped__")} == {"load"}
    with pytest.raises(TypeError, match="missing a required argument"):
        bf.predict()


def test_arguments_by_place_and_by_name_are_read_alike():
    @read_first
    def plain(dataset: Path, *, count: int = 3) -> tuple[Path, int]:
        return dataset, count

    assert plain(Path("a")) == plain(dataset=Path("a")) == (Path("a"), 3)
