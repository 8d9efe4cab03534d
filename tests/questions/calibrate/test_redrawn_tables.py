"""Tables drawn anew for a replication: they keep the design, change the readings, and pass the rules of measured ones."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from cables import CONTACTS, cable
from conftest import ROOT
from scipy import stats

from bowdenfit.dataset import Dataset, load_dataset
from bowdenfit.errors import DatasetError
from bowdenfit.inference.compilation import compile_program
from bowdenfit.kinds import KINDS
from bowdenfit.kinds.angles.term import detection_limit
from bowdenfit.kinds.descriptions import make_design
from bowdenfit.kinds.forces.table import ForceTable
from bowdenfit.kinds.forces.term import HeldForcesTerm
from bowdenfit.kinds.recordings.term import refuse_saturated
from bowdenfit.kinds.tables import AngleTable
from bowdenfit.kinds.terms import draw_readings
from bowdenfit.models import build_model
from bowdenfit.questions.calibrate.replicator import why_implausible
from bowdenfit.questions.simulate.tables import empty_tables, replace_readings, resimulate
from bowdenfit.recordings.recording import Recordings

pytestmark = pytest.mark.extended

DATA_SETS = (
    "on-body-exoskeleton",
    "synthetic-bench",
    "synthetic-haptic-loop",
    "synthetic-recordings",
    "yarn-on-cylinder",
)


def data_set(name: str) -> Dataset:
    return load_dataset(ROOT / "datasets" / name)


def plausible_values(dataset: Dataset) -> dict[str, float]:
    """Prior medians [internal units]."""
    space = build_model(dataset).space
    return {name: float(value) for name, value in space.constrain(jnp.zeros(space.size)).items()}


def drawn_anew(dataset: Dataset, values: dict[str, float], scale: float = 1.0) -> Dataset:
    """What `resimulate` gives, compiled in one piece, which is quicker for one draw of many operations."""
    cable, tables = build_model(dataset).cable, dataset.measurements

    def readings(values, key):
        return draw_readings(cable, tables, values, key, scale)

    arguments = {name: jnp.asarray(value) for name, value in values.items()}, jax.random.key(1)
    return replace_readings(dataset, compile_program(readings, *arguments, run_once=True)(*arguments))


@pytest.mark.parametrize("name", DATA_SETS)
def test_tables_drawn_anew_keep_the_design_and_change_the_readings(name):
    dataset = data_set(name)
    again = drawn_anew(dataset, plausible_values(dataset))
    for table, columns, read in (
        ("angles", ("route",), "angle"),
        ("efficiencies", ("route",), "efficiency"),
        ("forces", ("route", "run", "stroke"), "output_force"),
        ("stretch", ("load", "wrap_angle", "unloading"), "stretch"),
        ("preload", ("wrap_angle",), "preload"),
        ("loop", ("stroke",), "output_force"),
    ):
        initial, after = (d.measurements.table(KINDS[table].table) for d in (dataset, again))
        assert (initial is None) == (after is None)
        if initial is not None:
            for column in columns:
                np.testing.assert_array_equal(getattr(initial, column), getattr(after, column))
            assert getattr(initial, read).shape == getattr(after, read).shape
            assert not np.array_equal(getattr(initial, read), getattr(after, read), equal_nan=True)
    recordings = again.measurements.table(Recordings)
    if recordings is not None:
        for first, other in zip(dataset.measurements.table(Recordings).items, recordings.items, strict=True):
            np.testing.assert_array_equal(first.blocks.time, other.blocks.time)
            assert not np.array_equal(first.blocks.output_force, other.blocks.output_force)
    build_model(again)


def test_angles_outside_the_range_of_the_curves_stay_as_measured(on_body):
    dataset = load_dataset(on_body)
    again = resimulate(dataset, plausible_values(dataset), jax.random.key(1))
    table, draws = dataset.measurements.table(AngleTable), again.measurements.table(AngleTable)
    outside = table.route > 530
    np.testing.assert_array_equal(table.angle[outside], draws.angle[outside])
    assert np.all(np.isfinite(draws.limit) == np.isnan(draws.angle))
    assert np.nanmin(draws.angle) >= np.deg2rad(10)


@pytest.mark.parametrize("name", ["on-body-exoskeleton", "synthetic-haptic-loop"])
def test_tables_drawn_without_noise_are_what_the_model_expects(name):
    dataset = data_set(name)
    values = plausible_values(dataset)
    again = drawn_anew(dataset, values, scale=0.0)
    named = {name: jnp.asarray(value) for name, value in values.items()}
    for term in build_model(again).terms:
        seen, expected = term.observed(), np.asarray(term.expected(named, jax.tree.map(jnp.asarray, term.data)))
        mask = np.isfinite(seen) & ~((seen == 0) & (expected <= 0))  # undetected angles; a slack rope
        np.testing.assert_allclose(seen[mask], expected[mask], rtol=1e-9, atol=1e-9)


def test_recordings_drawn_without_noise_show_the_friction_exponent_that_they_were_drawn_with():
    """To 1 %: strokes are found anew by the reader's own play operator, which has a weak pull toward its middle."""
    dataset = data_set("synthetic-recordings")
    values = plausible_values(dataset) | {"mu1": 0.09, "mu2": 0.12, "mu3": 0.2}
    again = drawn_anew(dataset, values, scale=0.0)
    named = {name: jnp.asarray(value) for name, value in values.items()}
    cable = build_model(dataset).cable
    for recording in again.measurements.table(Recordings).items:
        if recording.route <= 530:
            expected = float(cable.exponent_at(named, jnp.array([recording.route]))[0])
            assert recording.strokes.exponent == pytest.approx(expected, rel=0.01)


def held_at(forces: tuple[float, ...]) -> Dataset:
    """Forces that were read while nothing slid, on a cable of one known angle."""
    description = cable(1, ("forces",), contact=[CONTACTS[2]])
    table = empty_tables(description, make_design(runs=(450.0,), input_forces=forces, strokes=("pull",))).table(
        ForceTable
    )
    held = replace(table, stroke=np.zeros(len(forces), dtype=int), output_force=np.full(len(forces), forces[0]))
    return Dataset(description, empty_tables(description, make_design()).with_tables(held), {})


def test_held_readings_slip_as_often_as_their_likelihood_says():
    """Over 2000 draws of two readings; each count is outside its 99.99 % range once in ten thousand seeds."""
    dataset = held_at((50.0, 53.0))
    model, values = build_model(dataset), plausible_values(dataset)
    named = {name: jnp.asarray(value) for name, value in values.items()}
    (term,) = model.terms
    assert isinstance(term, HeldForcesTerm)
    probability = np.exp(np.asarray(term.log_likelihood(named, jax.tree.map(jnp.asarray, term.data))))
    draw = jax.jit(
        jax.vmap(lambda key: draw_readings(model.cable, dataset.measurements, named, key)["forces"]["slipped"])
    )
    held = np.sum(~np.asarray(draw(jax.random.split(jax.random.key(2), 2000))), axis=0)
    assert 0.05 < probability[1] < 0.95
    for count, p in zip(held, probability, strict=True):
        assert stats.binomtest(int(count), 2000, float(p)).pvalue > 1e-4
    readings = draw_readings(model.cable, dataset.measurements, named, jax.random.key(1))
    forces = replace_readings(dataset, readings).measurements.table(ForceTable)
    np.testing.assert_array_equal(forces.input_force, dataset.measurements.table(ForceTable).input_force)


def test_a_table_of_several_detection_limits_is_refused_unless_one_is_stated(on_body):
    dataset = load_dataset(on_body)
    table = dataset.measurements.table(AngleTable)
    limits = np.where(np.isnan(table.limit), np.nan, np.linspace(0.1, 0.2, len(table.route))[:, None])
    assert detection_limit(dataset.description, table) == pytest.approx(np.deg2rad(10))
    silent = dataset.description.tables.angles.model_copy(update={"detection_limit": None})
    tables = dataset.description.tables.model_copy(update={"angles": silent})
    description = dataset.description.model_copy(update={"tables": tables})
    assert detection_limit(description, table) == pytest.approx(np.deg2rad(10))
    with pytest.raises(DatasetError, match="different detection limits"):
        detection_limit(description, replace(table, limit=limits))


def test_recordings_with_clipped_readings_are_refused():
    dataset = data_set("synthetic-recordings")
    recordings = dataset.measurements.table(Recordings)
    refuse_saturated(recordings)
    first = recordings.items[0]
    clipped = replace(first, blocks=replace(first.blocks, saturated=first.blocks.input_force > 100))
    with pytest.raises(DatasetError, match="end of a load cell's range"):
        refuse_saturated(replace(recordings, items=(clipped, *recordings.items[1:])))


@pytest.mark.parametrize("name", DATA_SETS)
def test_measured_tables_pass_the_rule_that_simulated_ones_must_pass(name):
    dataset = data_set(name)
    assert why_implausible(dataset, dataset) == ""


def changed(dataset: Dataset, table: str, **columns: object) -> Dataset:
    rows = dataset.measurements.table(KINDS[table].table)
    new = {name: change(getattr(rows, name)) for name, change in columns.items()}
    return replace(dataset, measurements=dataset.measurements.with_tables(replace(rows, **new)))


@pytest.mark.parametrize(
    ("name", "table", "column", "change", "reason"),
    [
        ("on-body-exoskeleton", "efficiencies", "efficiency", lambda e: 0.2 * e, "below 20 %"),
        ("on-body-exoskeleton", "efficiencies", "efficiency", lambda e: e**0.01, "above 99 %"),
        ("on-body-exoskeleton", "angles", "angle", lambda a: 40 * a, "above 2000 deg"),
        ("on-body-exoskeleton", "angles", "angle", lambda a: np.where(a > 1, a, np.nan), "too few angles"),
        ("synthetic-bench", "forces", "output_force", lambda f: -f, "not positive"),
        ("synthetic-bench", "forces", "output_force", lambda f: f * (1 + np.arange(len(f)) % 2), "scatter"),
        ("synthetic-haptic-loop", "stretch", "stretch", lambda s: 20 * s, "far from the measured"),
        ("synthetic-haptic-loop", "stretch", "stretch", lambda s: -s, "falls with the load"),
        ("synthetic-haptic-loop", "preload", "preload", lambda p: 0 * p, "slack"),
        ("synthetic-haptic-loop", "preload", "preload", lambda p: 30 * p, "far from the measured"),
        ("synthetic-haptic-loop", "loop", "stroke", lambda s: -s, "gains force"),
        ("synthetic-haptic-loop", "loop", "output_force", lambda f: 0.01 * f, "80 %"),
    ],
)  # fmt: skip
def test_tables_that_no_bench_would_hand_in_are_drawn_again(name, table, column, change, reason):
    dataset = data_set(name)
    assert reason in why_implausible(dataset, changed(dataset, table, **{column: change}))
