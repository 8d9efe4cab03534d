"""Tables made from known truth: the plan (`bench.toml`), readings drawn for it, and the folder of the data set.

`simulate_design` measures a design; `resimulate` measures once more what a data set holds, at coefficients that are known.
Both draw readings as the likelihood takes them to scatter, so that a posterior can be asked to hold the truth.
"""

import json
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from bowdenfit import route_angles
from bowdenfit.csv_tables import csv_table
from bowdenfit.dataset import DESCRIPTION_FILE, Dataset
from bowdenfit.description import Description
from bowdenfit.errors import DescriptionError, UsageError
from bowdenfit.inference.compilation import compile_program
from bowdenfit.inputs import read_toml_file
from bowdenfit.kinds import KINDS, iterate_tables
from bowdenfit.kinds.angles.term import draw_angles
from bowdenfit.kinds.descriptions import parse_description, read_design
from bowdenfit.kinds.kind import Design, PlannedKind
from bowdenfit.kinds.tables import AngleTable, Measurements
from bowdenfit.kinds.term import Truth
from bowdenfit.kinds.terms import Readings, draw_readings, replace_table_readings
from bowdenfit.models import build_model
from bowdenfit.outputs import write_text
from bowdenfit.results.folder import fill_folder_atomically
from bowdenfit.words import shown

TRUTH_FILE = "truth.json"
_HEADING = re.compile(r"\s*\[\[?\s*([A-Za-z\"'][^\],]*?)\s*\]\]?\s*(#.*)?")


@dataclass(frozen=True)
class BenchPlan:
    """Data set to simulate: the cable, what is measured, and the truth (shown units) as far as it is given."""

    text: str
    description: Description
    design: Design
    truth: Mapping[str, float]


def make_data_set(path: Path, output: Path | None, seed: int, noise: bool) -> Dataset:
    """Make a data set of tables from known truth, and write it.

    Args:
        path: The plan.
        output: Folder of the data set; nothing is written without one.
        seed: Random seed.
        noise: Whether readings scatter.

    Raises:
        DescriptionError: The plan is missing or wrong.
        StoreError: The folder cannot be written.
    """
    plan = read_bench(path)
    with jax.enable_x64(True):
        dataset, truth = simulate_tables(plan, jax.random.key(seed), noise)
    if output is not None:
        write_tables(plan, dataset, truth, output, seed)
    return dataset


def read_bench(path: Path) -> BenchPlan:
    """Read a plan.

    Raises:
        DescriptionError: The file is missing or no TOML, or a table or key in it is wrong.
    """
    text, raw = read_plan_file(path)
    if "design" not in raw:
        raise DescriptionError(
            f"{path.name} has no [design]: say where to measure, such as angles = [430, 440, 450], runs = [440, 470], "
            "input_forces = [20, 40, 60] (in N)."
        )
    truth = parse_truth(raw, path.name)
    cable = {name: value for name, value in raw.items() if name not in {"design", "fleet", "truth"}}
    description = parse_description(cable, path.name)
    if description.has_routes:
        description, _, _ = route_angles.measure_routes(description, path.parent)
    if (description.sensors.input_ratio, description.sensors.output_ratio) != (1.0, 1.0):
        raise DescriptionError(
            f"{path.name}: a simulated bench writes the forces on the rope, so that [sensors] input_ratio and output_ratio "
            "would be applied to them a second time; leave both out."
        )
    return BenchPlan(text, description, read_design(raw["design"], description, path.name), truth)


def read_plan_file(path: Path) -> tuple[str, dict[str, Any]]:
    """Read a plan as text and as plain data.

    Raises:
        DescriptionError: The file is missing or no TOML.
    """
    return read_toml_file(path, "name a bench.toml")


def parse_truth(raw: Mapping[str, Any], file: str) -> Mapping[str, float]:
    """Return [truth] of a plan, all of it numbers."""
    truth: Mapping[str, float] = raw.get("truth", {})
    for name, value in truth.items():
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise DescriptionError(f"{file}, truth.{name}: {value!r} is not a number.")
    return truth


def simulate_tables(bench: BenchPlan, key: jax.Array, noise: bool) -> tuple[Dataset, dict[str, float]]:
    """Return the data set and the true value of every parameter [shown units].

    Args:
        bench: The plan.
        key: Random key.
        noise: Whether readings scatter.
    """
    truth_key, readings_key = jax.random.split(key)
    tables = empty_tables(bench.description, bench.design)
    values = draw_true_values(bench.description, tables, bench.truth, truth_key, run_once=True)
    space = build_model(Dataset(bench.description, tables, {})).space
    displayed = {p.name: values[p.name] * p.shown_scale for p in space.parameters}
    return simulate_design(bench.description, bench.design, values, readings_key, noise, run_once=True), displayed


def simulate_design(
    description: Description,
    design: Design,
    values: Mapping[str, float],
    key: jax.Array,
    noise: bool = True,
    run_once: bool = False,
) -> Dataset:
    """Return tables as a bench would give them.

    Args:
        description: The cable.
        design: Design of the measurements.
        values: True value of every parameter [internal units].
        key: Random key.
        noise: Whether readings scatter; without noise every reading is what the model expects.
        run_once: Whether this design is measured just once, so that one program of its own is compiled, in a third of the time
            of some hundred small ones, which would serve again.
    """
    dataset = Dataset(description, empty_tables(description, design), {})
    return resimulate(dataset, values, key, noise=noise, beyond_curves=True, run_once=run_once)


def resimulate(
    dataset: Dataset,
    values: Mapping[str, float],
    key: jax.Array,
    *,
    noise: bool = True,
    beyond_curves: bool = False,
    run_once: bool = False,
) -> Dataset:
    """Return the same tables, with readings drawn anew at known coefficients.

    Kept are lengths, runs, strokes, loads, the rows' own wrap angles and what is stated of their errors, and input forces,
    which stand for the true ones. Held readings are kept as they are.

    Args:
        dataset: Data set with its measurements.
        values: True value of every parameter [internal units].
        key: Random key.
        noise: Whether readings scatter.
        beyond_curves: Whether angles outside the range of the curves are drawn too, from the curves; else they are kept, as
            the rows' own wrap angles are.
        run_once: See `simulate`.

    Raises:
        DatasetError: A table cannot be drawn anew, or the recordings drawn have no strokes that could be found.
    """
    named = {name: jnp.asarray(value, dtype=float) for name, value in values.items()}
    cable, scale = build_model(dataset).cable, 1.0 if noise else 0.0
    angles, beyond = dataset.measurements.table(AngleTable), {}
    if beyond_curves and angles is not None:
        table = angles

        def draw(named: Mapping[str, jax.Array], key: jax.Array) -> dict[str, jax.Array]:
            return draw_angles(table, Truth(cable, table, named, key, scale), everywhere=True)

        beyond = {"angles": _evaluate_program(draw, named, key, run_once=run_once)}
        angle, limit = (np.asarray(beyond["angles"][name]) for name in ("angle", "limit"))
        measured = dataset.measurements.with_tables(replace(angles, angle=angle, limit=limit))
        dataset = replace(dataset, measurements=measured)
    tables = dataset.measurements

    def readings(named: Mapping[str, jax.Array], key: jax.Array) -> Readings:
        return draw_readings(cable, tables, named, key, scale)

    return replace_readings(dataset, _evaluate_program(readings, named, key, run_once=run_once) | beyond)


def draw_true_values(
    description: Description, tables: Measurements, truth: Mapping[str, float], key: jax.Array, run_once: bool = False
) -> dict[str, float]:
    """Return the true value of every parameter [internal units]: as given in shown units, else drawn from its prior.

    Angles do not depart from their curves unless that is given.

    Args:
        description: The cable.
        tables: Tables of the shape of what is measured.
        truth: True values that are stated.
        key: Random key.
        run_once: See `simulate`.

    Raises:
        UsageError: A name in `truth` is no parameter.
    """
    space = build_model(Dataset(description, tables, {})).space
    unknown = [name for name in truth if name not in {p.name for p in space.parameters}]
    if unknown:
        known = ", ".join(p.name for p in space.parameters)
        raise UsageError(f"{unknown[0]!r} is not a parameter of this cable; its parameters are {known}.")

    def draw(key: jax.Array) -> jax.Array:
        return space.vector(jax.random.normal(key, (space.size,)))

    needs_draw = any(p.name not in truth for p in space.free)
    prior_draw = np.asarray(_evaluate_program(draw, key, run_once=run_once)) if needs_draw else np.zeros(space.size)
    values = {p.name: float(v) for p, v in zip(space.free, prior_draw, strict=True)}
    values |= {p.name: float(p.fixed or 0.0) for p in space.fixed}
    values |= {p.name: 0.0 for p in space.free if p.role == "departure"}
    return values | {p.name: truth[p.name] / p.shown_scale for p in space.parameters if p.name in truth}


def empty_tables(description: Description, design: Design) -> Measurements:
    """Return tables of the design's shape with unremarkable readings, from which the model's parameters can be declared."""
    stated = description.tables.stated
    return Measurements(
        tuple(
            kind.empty_table(design, description, kind.file_name(stated[kind.name]))
            for kind in KINDS.values()
            if kind.name in stated and isinstance(kind, PlannedKind)
        )
    )


def replace_readings(dataset: Dataset, readings: Mapping[str, Mapping[str, jax.Array]]) -> Dataset:
    """Return the data set with what `draw_readings` gave; checksums do not hold for it.

    Raises:
        DatasetError: The strokes of a recording cannot be found.
    """
    return Dataset(dataset.description, replace_table_readings(dataset.description, dataset.measurements, readings), {})


def _evaluate_program(function: Callable[..., Any], *arguments: Any, run_once: bool) -> Any:
    """Return what a function of arrays gives, as one program where it is asked for once."""
    return (compile_program(function, *arguments, run_once=True) if run_once else function)(*arguments)


def write_tables(bench: BenchPlan, dataset: Dataset, truth: Mapping[str, float], folder: Path, seed: int) -> None:
    """Write cable.toml, the tables and truth.json, with true values in shown units and the seed they were made from."""
    cable = "\n".join(description_lines(bench.text, "bowdenfit simulate", "design")) + "\n"
    write_folder(
        folder, cable, table_texts(bench.description, dataset.measurements), {"seed": seed, "truth": dict(truth)}
    )


def write_folder(folder: Path, cable: str, files: Mapping[str, str], truth: Mapping[str, Any]) -> None:
    """Write cable.toml, the other files by their names, and truth.json; all of them or none.

    Raises:
        DescriptionError: One of them would lie elsewhere.
        StoreError: The folder cannot be written.
    """
    texts = {DESCRIPTION_FILE: cable, **files, TRUTH_FILE: json.dumps(truth, indent=1) + "\n"}
    outside = [name for name in texts if Path(name).is_absolute() or ".." in Path(name).parts or "\0" in name]
    if outside:
        raise DescriptionError(f"the plan names the file {shown(outside[0])}, outside of what is made; name one inside.")
    with fill_folder_atomically(folder) as new_folder:
        for name, text in texts.items():
            (new_folder / name).parent.mkdir(parents=True, exist_ok=True)
            write_text(new_folder / name, text)


def table_texts(description: Description, measured: Measurements) -> dict[str, str]:
    """Return every table as the text of its file, by file name."""
    texts = {}
    for kind, table in iterate_tables(measured):
        settings = description.tables.stated.get(kind.name)
        if settings and (page := kind.file_rows(table, description)):
            heads, rows = page
            texts[kind.file_name(settings)] = csv_table(heads, rows)
    return texts


def description_lines(text: str, command: str, *designs: str) -> list[str]:
    """Return the plan without its opening comment and without the tables of its truth and its designs."""
    lines = text.splitlines()
    while lines and lines[0].lstrip().startswith("#"):
        lines = lines[1:]
    kept_lines, skipping = [f"# Written by `{command}`; the truth is in truth.json."], False
    for line in lines:
        if heading := _HEADING.fullmatch(line):
            skipping = heading[1].split(".")[0].strip("\"' ") in {"truth", *designs}
        if not skipping:
            kept_lines.append(line)
    while not kept_lines[-1].strip():
        kept_lines.pop()
    return kept_lines
