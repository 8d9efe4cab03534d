"""At which load and of which stroke the readings of the next run are worth most."""

import numpy as np
import pytest
from hand_bench import pull, write

import bowdenfit as bf
from bowdenfit.display import render_text
from bowdenfit.errors import UsageError
from bowdenfit.questions.next.candidates import describe_candidate, format_candidate, parse_candidates
from bowdenfit.questions.next.ranking import rank_measurements
from bowdenfit.questions.next.words import ranking_blocks

pytestmark = pytest.mark.extended

QUICK = ("sampler.n_walkers=64", "sampler.target_ess=300", "sampler.target_r_hat=1.05", "sampler.max_steps=4000")


@pytest.fixture(scope="module")
def fit(tmp_path_factory):
    """A rope with a hidden tension, which is told by what comes out at low loads."""
    rows = pull(np.random.default_rng(1), [180.0] * 4, [0.4] * 4, (4, 16, 64), drag=2.0, noise=(0.05, 0.05), scatter=0.02)
    return bf.fit(write(tmp_path_factory.mktemp("drag"), rows), friction="drag", seed=1, settings=QUICK)


@pytest.fixture(scope="module")
def advice(fit):
    """What to measure next for the hidden tension."""
    return rank_measurements(fit, "drag")


@pytest.mark.slow
def test_a_hidden_tension_is_told_by_the_lowest_load(advice):
    within = advice.within
    assert within.usual.startswith("6 readings at") and within.usual.endswith("64 N, pulling and returning")
    share = {(round(np.nan_to_num(r.candidate.load)), r.candidate.stroke): r.share for r in within.ranked}
    assert set(share) == {(0, 0), *((load, stroke) for load in (4, 16, 64) for stroke in (0, 1, -1))}
    assert share[64, 0] < share[4, 0] and share[64, 0] < share[0, 0]


@pytest.mark.slow
def test_the_advice_says_which_load_and_stroke(fit, advice):
    text = " ".join(render_text(ranking_blocks(advice, 5)).split())
    assert "That is a run like those made so far: 6 readings at" in text and "pulling and returning" in text and "64 N" in text
    assert bf.next_measurement(fit, "drag", ["force@180deg,4N,pull"]).within is None


def test_a_run_is_read_as_it_is_named(fit):
    (candidate,) = parse_candidates(fit, ["force@180deg,20N,return"])
    assert (candidate.load, candidate.stroke) == (20.0, -1)
    assert format_candidate(candidate) == "force@180deg,20N,return"
    assert describe_candidate(fit, candidate).endswith("under 20 N while returning")
    with pytest.raises(UsageError, match="pull or return"):
        parse_candidates(fit, ["force@180deg,pul"])
