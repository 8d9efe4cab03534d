"""Data sets made from known truth: the plan (`bench.toml`), and the folder that comes of it."""

import json
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import jax

from bowdenfit.dataset import DESCRIPTION_FILE, Dataset
from bowdenfit.description import Description
from bowdenfit.errors import DescriptionError
from bowdenfit.inputs import read_toml_file
from bowdenfit.kinds import each_table
from bowdenfit.kinds.descriptions import parse_description, read_design
from bowdenfit.kinds.kind import Design
from bowdenfit.kinds.tables import Measurements
from bowdenfit.questions.simulate.simulation import draw_true_values, empty_tables, simulate
from bowdenfit.results.folder import fill_folder_atomically, write_text
from bowdenfit.words import shown

TRUTH_FILE = "truth.json"
_HEADING = re.compile(r"\s*\[\[?\s*([A-Za-z\"'][^\],]*?)\s*\]\]?\s*(#.*)?")


@dataclass(frozen=True)
class BenchPlan:
    """What to simulate: the cable, what is measured, and the truth (shown units) as far as it is given."""

    text: str
    description: Description
    design: Design
    truth: Mapping[str, float]


def read_plan_file(path: Path) -> tuple[str, dict[str, Any]]:
    """A plan as text and as plain data.

    Raises:
        DescriptionError: The file is missing or no TOML.
    """
    return read_toml_file(path, "name a bench.toml")


def parse_truth(raw: Mapping[str, Any], file: str) -> Mapping[str, float]:
    """[truth] of a plan, all of it numbers."""
    truth: Mapping[str, float] = raw.get("truth", {})
    for name, value in truth.items():
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise DescriptionError(f"{file}, truth.{name}: {value!r} is not a number.")
    return truth


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
    return BenchPlan(text, description, read_design(raw["design"], description, path.name), truth)


def simulate_tables(bench: BenchPlan, key: jax.Array, noise: bool) -> tuple[Dataset, dict[str, float]]:
    """The data set and the true value of every parameter [shown units].

    Args:
        bench: The plan.
        key: Random key.
        noise: Whether readings scatter.
    """
    from bowdenfit.model import build_model

    truth_key, readings_key = jax.random.split(key)
    tables = empty_tables(bench.description, bench.design)
    values = draw_true_values(bench.description, tables, bench.truth, truth_key, run_once=True)
    space = build_model(Dataset(bench.description, tables, {})).space
    displayed = {p.name: values[p.name] * p.shown_scale for p in space.parameters}
    return simulate(bench.description, bench.design, values, readings_key, noise, run_once=True), displayed


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
    """Every table as the text of its file, by file name."""
    texts = {}
    for kind, table in each_table(measured):
        settings = description.tables.stated.get(kind.name)
        if settings and (page := kind.file_rows(table, description)):
            heads, rows = page
            texts[kind.file_name(settings)] = "\n".join(",".join(map(_cell, row)) for row in [heads, *rows]) + "\n"
    return texts


def _cell(text: str) -> str:
    """A cell as CSV has it; a heading that holds a comma is one all the same."""
    return '"{}"'.format(text.replace('"', '""')) if set(text) & set(',"\r\n') else text


def description_lines(text: str, command: str, *designs: str) -> list[str]:
    """The plan without its opening comment and without the tables of its truth and its designs."""
    lines = text.splitlines()
    while lines and lines[0].lstrip().startswith("#"):
        lines = lines[1:]
    kept, skipping = [f"# Written by `{command}`; the truth is in truth.json."], False
    for line in lines:
        if heading := _HEADING.fullmatch(line):
            skipping = heading[1].split(".")[0].strip("\"' ") in {"truth", *designs}
        if not skipping:
            kept.append(line)
    while not kept[-1].strip():
        kept.pop()
    return kept
