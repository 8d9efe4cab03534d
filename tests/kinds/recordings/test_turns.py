"""Recordings whose blocks after a turn count: how they are weighed, what is refused, and truths from another simulator."""


import jax
import jax.numpy as jnp
import numpy as np
import pytest
from cables import cable
from creeping_rope import CONTACT, SPEED, Truth, model_recordings, record

from bowdenfit.cable.friction_options import friction_options
from bowdenfit.dataset import Dataset
from bowdenfit.errors import DescriptionError
from bowdenfit.inference.interval import Interval
from bowdenfit.inference.least_squares import find_maximum_posterior, fit_least_squares
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.inference.objective import make_objective
from bowdenfit.kinds.recordings.blocks import standing_share
from bowdenfit.kinds.recordings.term import RecordingTerms
from bowdenfit.kinds.recordings.turns import TurnsTerm, _subtract_common
from bowdenfit.kinds.tables import Measurements
from bowdenfit.models import build_model
from bowdenfit.questions.recorded.presliding import Presliding


@pytest.fixture(scope="module")
def recording():
    return record(Truth(stiffness=30.0, reference_speed=SPEED), 100, 1)


def test_a_standing_phase_is_known_as_if_its_blocks_had_one_error_in_common(recording):
    """The sum of squares is that of the covariance with a common error, and the log determinant differs by a constant."""
    (term,) = model_recordings([recording], "dahl").terms
    assert isinstance(term, TurnsTerm)
    data, generator = term.data, np.random.default_rng(5)
    deviation = generator.standard_normal(data.weight.shape)
    squares = float(np.sum(data.weight * np.asarray(_subtract_common(jnp.asarray(deviation), data)) ** 2))
    share, start, expected = standing_share(recording.strokes.contact, recording.blocks.input_force), data.phase_start, 0.0
    for first in np.unique(start):
        rows = np.flatnonzero((start[:, 0] == first) & (data.weight[:, 0] > 0))
        if len(rows):
            weight, d = data.weight[rows, 0], deviation[rows, 0]
            common = (1 / share[rows[0]] - 1) / weight.sum()
            expected += d @ np.linalg.solve(np.diag(1 / weight) + common, d)
    assert squares == pytest.approx(expected, rel=1e-9)


def test_play_counts_the_same_blocks_as_dahl_and_a_capstan_fit_other_ones_with_a_remedy(recording):
    kind, names = RecordingTerms(), ("play", "dahl", "lugre", "capstan")
    models = {name: model_recordings([recording], name) for name in names}
    events = {name: kind.events(model.terms[0], model.description) for name, model in models.items()}
    np.testing.assert_array_equal(events["play"], events["dahl"])
    np.testing.assert_array_equal(events["play"], events["lugre"])
    assert not np.array_equal(events["play"], events["capstan"])
    reason = kind.why_events_differ("recorded_efficiency", {name: models[name].description for name in ("dahl", "capstan")})
    assert "--friction play" in reason


def test_friction_models_of_turns_add_their_parameters_and_need_recordings(recording):
    names = [p.name for p in model_recordings([recording], "lugre+drag").space.parameters if p.role == "friction_model"]
    assert names == ["presliding_stiffness", "stribeck", "stribeck_speed", "viscous", "bristle_damping", "drag"]
    with pytest.raises(DescriptionError, match='"dahl", which says what happens when the motion turns, and only recordings'):
        build_model(Dataset(cable(1, ("efficiencies",), contact=[CONTACT | {"wrap_angle": {"value": 90, "unit": "deg"}}],
                                  friction_model="dahl").model_copy(update={"route": None}), Measurements(()), {}))  # fmt: skip
    with pytest.raises(DescriptionError, match="in two ways what happens when the motion turns, play and dahl"):
        friction_options("play+dahl")
    with pytest.raises(DescriptionError, match="leave rate-dependent out"):
        friction_options("lugre+rate-dependent")


@pytest.mark.extended
def test_the_likelihood_has_its_top_at_the_stiffness_that_the_recording_was_made_with(recording):
    model = model_recordings([recording], "dahl")
    (term,) = model.terms

    @jax.jit
    def by_stiffness(stiffness):
        values = {"mu": 0.15, "tau": 0.02, "sigma_block": 0.05, "presliding_stiffness": stiffness}
        return term.log_likelihood({name: jnp.asarray(value) for name, value in values.items()}, term.data)[0]

    grid = np.array([20.0, 27.0, 30.0, 33.0, 45.0, 1e6])
    computed = np.array([float(by_stiffness(s)) for s in grid])
    assert grid[int(np.argmax(computed))] == 30.0 and computed[2] - computed[-1] > 100


@pytest.mark.slow
@pytest.mark.parametrize("rate", [100, 1000])
def test_least_squares_return_what_another_simulator_put_in(rate):
    truth = Truth(stiffness=25.0, reference_speed=SPEED)
    posterior = LogDensity(model_recordings([record(truth, rate, 2)], "dahl"))
    objective = make_objective(posterior)
    start = find_maximum_posterior(posterior, objective).z
    estimate = fit_least_squares(posterior, objective, start, intervals=False).estimates["presliding_stiffness"]
    assert estimate.identified and estimate.value == pytest.approx(25.0, abs=3 * estimate.standard_error)
    assert estimate.standard_error < 1.0


def test_the_summary_says_how_far_the_rope_creeps_or_that_it_cannot_be_told_from_play():
    generator = np.random.default_rng(1)
    presliding = Presliding(Interval.of(1 / (25.0 + generator.standard_normal(4000))), float("nan"))
    assert presliding.sentence().startswith(
        "After a turn friction builds up by 63 % while the output force changes by 4.0 % (90 %"
    )
    unknown = Presliding(Interval.of(np.abs(0.01 * generator.standard_normal(4000))), 50.0)
    assert unknown.is_play and not presliding.is_play
    assert "cannot tell the presliding stiffness" in unknown.sentence() and "force at 50 N" in unknown.sentence()
