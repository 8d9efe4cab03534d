"""What load cells show of the true forces, there and back, and that every table's likelihood counts on it."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from cables import cable, measured
from elastic_cables import TRUTH, bench, elastic_cable

from bowdenfit.cable.sensors import DELAY_ERROR, GAIN_ERROR, INPUT_OFFSET, OUTPUT_OFFSET, LoadCells
from bowdenfit.dataset import Dataset
from bowdenfit.kinds import KINDS
from bowdenfit.models import build_model

ERRORS = {INPUT_OFFSET: 0.7, OUTPUT_OFFSET: -0.4, GAIN_ERROR: 0.03, DELAY_ERROR: 0.002}
LEAST_FORCE = 1e-3
FORCES = jnp.array([0.5, 3.0, 20.0, 60.0])
SENSORS = {"input_gain_error_sd": 0, "output_gain_error_sd": 0.05, "offset_sd": {"value": 1.0, "unit": "N"}}


def test_what_the_cells_show_leads_back_to_the_true_forces():
    cells = LoadCells.of(ERRORS)
    np.testing.assert_allclose(cells.true_input(cells.shown_input(FORCES)), FORCES, rtol=1e-14)
    np.testing.assert_allclose(cells.true_output(cells.shown_output(FORCES)), FORCES, rtol=1e-14)
    np.testing.assert_allclose(cells.shown_input(FORCES), FORCES + 0.7, rtol=1e-15)
    np.testing.assert_allclose(cells.shown_output(FORCES), FORCES / np.exp(0.03) - 0.4, rtol=1e-15)
    change = cells.shown_output(FORCES + 1.0) - cells.shown_output(FORCES)
    np.testing.assert_allclose(cells.shown_change(jnp.ones(4)), change, rtol=1e-13)
    np.testing.assert_allclose(cells.late(FORCES), 0.002 * FORCES, rtol=1e-15)


def test_cells_of_which_nothing_is_said_show_the_true_forces():
    cells = LoadCells.of({"mu": 0.1})
    for function in (cells.true_input, cells.true_output, cells.shown_input, cells.shown_output, cells.shown_change):
        np.testing.assert_array_equal(function(FORCES), FORCES)
    assert not np.any(cells.late(FORCES))


def test_an_offset_leaves_a_rope_s_reading_some_force():
    cells, low = LoadCells.of(ERRORS | {OUTPUT_OFFSET: 5.0}), jnp.array([0.2])
    assert cells.true_input(low, LEAST_FORCE) == LEAST_FORCE
    np.testing.assert_allclose(cells.true_output(low, LEAST_FORCE), LEAST_FORCE * np.exp(0.03))
    assert LoadCells.of({OUTPUT_OFFSET: -5.0}).shown_output(low, LEAST_FORCE) == LEAST_FORCE


def _shown(table):
    """The table as cells with `ERRORS` show it, by the formula on paper."""
    if hasattr(table, "efficiency"):
        return replace(table, efficiency=table.efficiency * np.exp(-ERRORS[GAIN_ERROR]))
    return replace(
        table,
        input_force=table.input_force + ERRORS[INPUT_OFFSET],
        output_force=table.output_force * np.exp(-ERRORS[GAIN_ERROR]) + ERRORS[OUTPUT_OFFSET],
    )


def _bench(table: str) -> tuple[Dataset, dict[str, float]]:
    """Readings without noise of cells without errors, of a cable that is said to have such errors."""
    none = dict.fromkeys((INPUT_OFFSET, OUTPUT_OFFSET, GAIN_ERROR), 0.0)
    if table == "loop":
        return bench(elastic_cable(("loop",), sensors=SENSORS), TRUTH | none, noise=False)
    conditions = {name: value for name, value in none.items() if table == "forces" or name == GAIN_ERROR}
    return measured(cable(3, ("angles", table), sensors=SENSORS), noise=False, **conditions)


@pytest.mark.parametrize("table", ["efficiencies", "forces", "loop"])
def test_every_table_of_forces_expects_what_its_cells_show(table):
    dataset, values = _bench(table)
    shown = _shown(dataset.measurements.table(KINDS[table].table))
    model = build_model(replace(dataset, measurements=dataset.measurements.with_tables(shown)))
    terms = [term for term in model.terms if term.name != "wrap_angle"]
    assert terms
    for term in terms:
        residuals = jax.jit(term.residuals)
        right = residuals({name: jnp.asarray(v) for name, v in (values | ERRORS).items() if name in values}, term.data)
        wrong = residuals({name: jnp.asarray(value) for name, value in values.items()}, term.data)
        assert np.max(np.abs(right)) < 1e-6
        assert np.max(np.abs(wrong)) > 0.05
