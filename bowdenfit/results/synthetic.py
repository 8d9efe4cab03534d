"""Data sets made from known truth: the plan (`bench.toml`), and the folder that comes of it."""

import json
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import jax
import numpy as np
from pydantic import BaseModel, ConfigDict, ValidationError

from bowdenfit.dataset import DESCRIPTION_FILE, Dataset
from bowdenfit.description import Description
from bowdenfit.description_file import parse_description
from bowdenfit.errors import DescriptionError
from bowdenfit.models.simulation import Design, empty_tables, simulate, true_values
from bowdenfit.results.store import write_text

TRUTH_FILE = "truth.json"
_STROKES = {"pull": 1, "return": -1}


class _DesignPage(BaseModel):
    """[design] as written: route values, input forces in N, strokes by name."""

    model_config = ConfigDict(extra="forbid", frozen=True)
    angles: tuple[float, ...] = ()
    efficiencies: tuple[float, ...] = ()
    runs: tuple[float, ...] = ()
    input_forces: tuple[float, ...] = ()
    strokes: tuple[str, ...] = ("pull", "return")


@dataclass(frozen=True)
class Bench:
    """What to simulate: the cable, what is measured, and the truth (shown units) as far as it is given."""

    text: str
    description: Description
    design: Design
    truth: Mapping[str, float]


def plan_page(path: Path) -> tuple[str, dict[str, Any]]:
    """A plan as text and as plain data.

    Raises:
        DescriptionError: The file is missing or no TOML.
    """
    try:
        text = path.read_text(encoding="utf-8-sig")
        return text, tomllib.loads(text)
    except OSError as error:
        raise DescriptionError(f"{path} cannot be read ({error.strerror}); name a bench.toml.") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise DescriptionError(f"{path.name} is not valid TOML: {error}.") from None


def read_bench(path: Path) -> Bench:
    """Read a plan.

    Raises:
        DescriptionError: The file is missing or no TOML, or a table or key in it is wrong.
    """
    text, raw = plan_page(path)
    if "design" not in raw:
        raise DescriptionError(
            f"{path.name} has no [design]: say where to measure, such as angles = [430, 440, 450], runs = [440, 470], "
            "input_forces = [20, 40, 60] (in N)."
        )
    truth = raw.pop("truth", {})
    for name, value in truth.items():
        if not isinstance(value, int | float):
            raise DescriptionError(f"{path.name}, truth.{name}: {value!r} is not a number.")
    return Bench(
        text,
        parse_description({k: v for k, v in raw.items() if k != "design"}, path.name),
        _design(raw["design"], path.name),
        truth,
    )


def _design(page: Mapping[str, Any], file: str) -> Design:
    try:
        design = _DesignPage.model_validate(dict(page))
        strokes = tuple(_STROKES[stroke] for stroke in design.strokes)
    except ValidationError as error:
        first = error.errors()[0]
        raise DescriptionError(f"{file}, design.{'.'.join(map(str, first['loc']))}: {first['msg'].lower()}.") from None
    except KeyError as error:
        raise DescriptionError(f"{file}, design.strokes: {error.args[0]!r} is not pull or return.") from None
    if design.runs and not design.input_forces:
        raise DescriptionError(f"{file}, design: runs need input_forces, such as [20, 40, 60] (in N).")
    return Design(design.angles, design.efficiencies, design.runs, design.input_forces, strokes)


def make(bench: Bench, key: jax.Array, noise: bool) -> tuple[Dataset, dict[str, float]]:
    """The data set and the true value of every parameter [shown units].

    Args:
        bench: The plan.
        key: Random key.
        noise: Whether readings scatter.
    """
    from bowdenfit.models.build import build_model

    of_truth, of_readings = jax.random.split(key)
    tables = empty_tables(bench.description, bench.design)
    values = true_values(bench.description, tables, bench.truth, of_truth)
    space = build_model(Dataset(bench.description, tables, {})).space
    shown = {p.name: values[p.name] * p.shown_scale for p in space.parameters}
    return simulate(bench.description, bench.design, values, of_readings, noise), shown


def write(bench: Bench, dataset: Dataset, truth: Mapping[str, float], folder: Path, seed: int) -> None:
    """Write cable.toml, the tables and truth.json.

    Args:
        bench: The plan.
        dataset: The data set.
        truth: True values [shown units].
        folder: Where to.
        seed: Seed it was made from.
    """
    folder.mkdir(parents=True, exist_ok=True)
    write_text(folder / DESCRIPTION_FILE, _description_only(bench.text))
    tables, measured, route = bench.description.tables, dataset.measurements, bench.description.route
    route_heading = f"{route.variable}_{route.unit}" if route else None
    if tables.angles and measured.angles:
        names = [f"{name}_deg" for name in measured.angles.names]
        shown = np.rad2deg(measured.angles.angle)
        limits = np.rad2deg(measured.angles.limit)
        cells = [
            [f"<{limits[i, k]:g}" if np.isnan(angle) else f"{angle:.1f}" for k, angle in enumerate(row)]
            for i, row in enumerate(shown)
        ]
        rows = [[f"{length:g}", *row] for length, row in zip(measured.angles.route, cells, strict=True)]
        _write_csv(folder / (tables.angles.file or "angles.csv"), [route_heading or "", *names], rows)
    if tables.efficiencies and measured.efficiencies:
        values = zip(measured.efficiencies.route, measured.efficiencies.efficiency, strict=True)
        rows = [[*([f"{length:g}"] if route else []), f"{eta:.5f}"] for length, eta in values]
        heads = [*([route_heading] if route_heading else []), "efficiency"]
        _write_csv(folder / (tables.efficiencies.file or "efficiencies.csv"), heads, rows)
    if tables.forces and measured.forces:
        table = measured.forces
        stroke_names = {1: "pull", -1: "return"}
        rows = [
            [
                *([f"{table.route[i]:g}"] if route else []),
                table.run_names[table.run[i]],
                stroke_names[int(table.stroke[i])],
                f"{table.input_force[i]:.3f}",
                f"{table.output_force[i]:.3f}",
            ]
            for i in range(len(table.run))
        ]
        heads = [*([route_heading] if route_heading else []), "run", "stroke", "input_force_N", "output_force_N"]
        _write_csv(folder / str(tables.forces.file or "forces.csv"), heads, rows)
    write_text(folder / TRUTH_FILE, json.dumps({"seed": seed, "truth": dict(truth)}, indent=1) + "\n")


def _write_csv(path: Path, heads: list[str], rows: list[list[str]]) -> None:
    write_text(path, "\n".join(",".join(row) for row in [heads, *rows]) + "\n")


def _description_only(text: str) -> str:
    """The plan's text without its opening comment and its [truth] and [design] tables."""
    lines = text.splitlines()
    while lines and lines[0].lstrip().startswith("#"):
        lines = lines[1:]
    kept, skipping = ["# Written by `bowdenfit simulate`; the truth is in truth.json."], False
    for line in lines:
        if line.strip().startswith("["):
            skipping = line.strip().strip("[]") in {"truth", "design"}
        if not skipping:
            kept.append(line)
    return "\n".join(kept).rstrip() + "\n"
