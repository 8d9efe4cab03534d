"""Fleets from known truth: many cables of one description, inspected while they wear.

    log mu_ik(c) = a_ik + b_i c / c_ref + gamma l + alpha (T - T_0),  a_ik ~ Normal(m_k, s_a),  b_i ~ Normal(m_b, s_b)

for cable i, coefficient k, c cycles, l = 1 after lubrication, and temperature T. What scatters from one mounting to the next,
and how load cells do, is the same for all.
"""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import jax
import jax.numpy as jnp
import numpy as np
from pydantic import Field, ValidationError

from bowdenfit.addons.fleet.folder import COLUMNS, FLEET_DESCRIPTION, FLEET_TABLE
from bowdenfit.csv_tables import csv_table
from bowdenfit.dataset import Dataset
from bowdenfit.description.values import Finite, Frozen, NonNegative, Positive
from bowdenfit.description.wrong_keys import explain_validation_error
from bowdenfit.errors import DescriptionError
from bowdenfit.inference.compilation import compile_program
from bowdenfit.kinds.terms import draw_readings, replace_table_readings
from bowdenfit.models import build_model
from bowdenfit.outputs import write_text
from bowdenfit.questions.simulate.tables import (
    TRUTH_FILE,
    BenchPlan,
    description_lines,
    draw_true_values,
    empty_tables,
    read_bench,
    read_plan_file,
    table_texts,
)
from bowdenfit.results.folder import fill_folder_atomically

READINGS = "readings"


class FleetDesign(Frozen):
    """[fleet] of a plan; the medians of the coefficients of new, dry cables are in [truth].

    Args:
        cables: How many.
        cycles: At which each is inspected.
        reference_cycles: Cycles that the wear rate is stated for.
        spread: Standard deviation of log coefficients between cables.
        wear: Mean growth of log coefficients in the reference cycles.
        wear_spread: Its standard deviation between cables.
        lubricated: Share of the inspections that are made after lubrication.
        lubrication: Effect of lubrication on log coefficients.
        temperature: Range that the temperature of each inspection is drawn from [°C].
        reference_temperature: Temperature that the coefficients are stated for [°C].
        per_degree: Effect of one degree on log coefficients [1/K].
    """

    cables: Annotated[int, Field(ge=1, le=1_000_000)]
    cycles: tuple[NonNegative, ...] = (0.0,)
    reference_cycles: Positive = 10_000.0
    spread: NonNegative = 0.2
    wear: Finite = 0.0
    wear_spread: NonNegative = 0.0
    lubricated: Annotated[float, Field(ge=0, le=1)] = 0.0
    lubrication: Finite = 0.0
    temperature: tuple[Finite, Finite] = (20.0, 20.0)
    reference_temperature: Finite = 20.0
    per_degree: Finite = 0.0


class _Plan(Frozen):
    """The part of a plan that is about the fleet."""

    fleet: FleetDesign


@dataclass(frozen=True)
class FleetPlan:
    """Fleet to simulate: a bench, and the cables that are measured on it."""

    bench: BenchPlan
    fleet: FleetDesign


@dataclass(frozen=True)
class SimulatedInspection:
    """One inspection of a cable.

    Args:
        cable: Name of the cable.
        cycles: It has made.
        temperature: [°C].
        lubricated: Whether it was lubricated.
        values: True parameters [shown units].
        dataset: Tables.
    """

    cable: str
    cycles: float
    temperature: float
    lubricated: bool
    values: dict[str, float]
    dataset: Dataset

    @property
    def file(self) -> str:
        """Name of its table, as seen from the folder."""
        return f"{READINGS}/{self.cable}-{self.cycles:.0f}.csv"


def read_fleet_plan(path: Path) -> FleetPlan:
    """Read a plan with [fleet].

    Raises:
        DescriptionError: The file is missing or no TOML, or a table or key in it is wrong.
    """
    _, raw = read_plan_file(path)
    if "fleet" not in raw:
        raise DescriptionError(f"{path.name} has no [fleet]: say how many cables, such as cables = 40, cycles = [0, 50000].")
    try:
        fleet = _Plan.model_validate({"fleet": raw["fleet"]}).fleet
    except ValidationError as error:
        raise explain_validation_error(error, raw, _Plan, path.name, "write it, such as cables = 40") from None
    return FleetPlan(read_bench(path), fleet)


def simulate_fleet(plan: FleetPlan, seed: int, noise: bool = True) -> tuple[list[SimulatedInspection], dict[str, Any]]:
    """Return all inspections, and the truth: of the population, and of each cable.

    Args:
        plan: Plan of the simulation.
        seed: Random seed; a cable is the same whatever others there are.
        noise: Whether readings scatter.
    """
    bench, fleet = plan.bench, plan.fleet
    tables = empty_tables(bench.description, bench.design)
    model = build_model(Dataset(bench.description, tables, {}))
    scale = {p.name: p.shown_scale for p in model.space.parameters}
    common = draw_true_values(bench.description, tables, bench.truth, jax.random.key(seed))
    worn = list(model.cable.coefficients)

    def readings(values: dict[str, jax.Array], key_words: jax.Array) -> Any:
        return draw_readings(model.cable, tables, values, jax.random.wrap_key_data(key_words), 1.0 if noise else 0.0)

    value_shapes = {name: jax.ShapeDtypeStruct((), jnp.float64) for name in common}
    program = compile_program(readings, value_shapes, jax.ShapeDtypeStruct((2,), jnp.uint32), run_once=True)
    inspections, truth, digits = list[SimulatedInspection](), dict[str, Any](), len(str(fleet.cables))
    for number in range(1, fleet.cables + 1):
        generator, name = np.random.default_rng([seed, number]), f"cable-{number:0{digits}d}"
        start = {k: np.log(common[k]) + fleet.spread * generator.standard_normal() for k in worn}
        wear = fleet.wear + fleet.wear_spread * generator.standard_normal()
        truth[name] = {"log_start": start, "wear": wear}
        for cycles in fleet.cycles:
            temperature = round(float(generator.uniform(*fleet.temperature)), 1)
            lubricated = bool(generator.uniform() < fleet.lubricated)
            change = wear * cycles / fleet.reference_cycles + fleet.lubrication * lubricated
            change += fleet.per_degree * (temperature - fleet.reference_temperature)
            values = common | {k: float(np.exp(start[k] + change)) for k in worn}
            drawn = program(values, generator.integers(2**32, size=2, dtype=np.uint32))
            dataset = Dataset(bench.description, replace_table_readings(bench.description, tables, drawn), {})
            displayed = {k: value * scale[k] for k, value in values.items()}
            inspections.append(SimulatedInspection(name, cycles, temperature, lubricated, displayed, dataset))
    return inspections, {"seed": seed, "population": fleet.model_dump() | {"truth": dict(bench.truth)}, "cables": truth}


def write_fleet(plan: FleetPlan, inspections: list[SimulatedInspection], truth: dict[str, Any], folder: Path) -> None:
    """Write the description, fleet.csv, a table for each inspection, and truth.json.

    Raises:
        DescriptionError: The bench fills several tables an inspection.
    """
    text = "\n".join(description_lines(plan.bench.text, "bowdenfit simulate --fleet", "design", "fleet")) + "\n"
    rows, files = list[tuple[str, ...]](), dict[str, str]()
    for inspection in inspections:
        texts = list(table_texts(inspection.dataset.description, inspection.dataset.measurements).values())
        if len(texts) != 1:
            raise DescriptionError("a simulated fleet has one table per inspection; leave one under [tables] of the plan.")
        files[inspection.file] = texts[0]
        lubricated = "yes" if inspection.lubricated else "no"
        numbers = f"{inspection.cycles:.0f}", f"{inspection.temperature:g}"
        rows.append((inspection.cable, *numbers, lubricated, inspection.file))
    files |= {FLEET_DESCRIPTION: text, FLEET_TABLE: csv_table(COLUMNS, rows), TRUTH_FILE: json.dumps(truth, indent=1) + "\n"}
    with fill_folder_atomically(folder) as new_folder:
        (new_folder / READINGS).mkdir()
        for name, content in files.items():
            write_text(new_folder / name, content)


def make_fleet(path: Path, output: Path | None, seed: int, noise: bool) -> Dataset:
    """Make the inspections of a fleet from known truth, write them, and return the data set of the first.

    Args:
        path: The plan.
        output: Folder of the fleet; nothing is written without one.
        seed: Random seed.
        noise: Whether readings scatter.

    Raises:
        DescriptionError: The plan is missing or wrong, or fills several tables an inspection.
        StoreError: The folder cannot be written.
    """
    plan = read_fleet_plan(path)
    with jax.enable_x64(True):
        inspections, truth = simulate_fleet(plan, seed, noise)
    if output is not None:
        write_fleet(plan, inspections, truth, output)
    return inspections[0].dataset
