"""Data sets made from known truth: the plan (`bench.toml`), and the folder that comes of it."""

import json
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import jax

from bowdenfit.dataset import DESCRIPTION_FILE, Dataset
from bowdenfit.description import Description
from bowdenfit.errors import DescriptionError
from bowdenfit.kinds import each_table
from bowdenfit.kinds.design import Design, read_design
from bowdenfit.kinds.kind import Page
from bowdenfit.kinds.measurements import Measurements
from bowdenfit.kinds.settings import parse_description
from bowdenfit.questions.simulate.simulation import empty_tables, simulate, true_values
from bowdenfit.results.store import write_text

TRUTH_FILE = "truth.json"


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
        read_design(raw["design"], path.name),
        truth,
    )


def make(bench: Bench, key: jax.Array, noise: bool) -> tuple[Dataset, dict[str, float]]:
    """The data set and the true value of every parameter [shown units].

    Args:
        bench: The plan.
        key: Random key.
        noise: Whether readings scatter.
    """
    from bowdenfit.model import build_model

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
    for name, (heads, rows) in table_pages(bench.description, dataset.measurements).items():
        write_text(folder / name, "\n".join(",".join(row) for row in [heads, *rows]) + "\n")
    write_text(folder / TRUTH_FILE, json.dumps({"seed": seed, "truth": dict(truth)}, indent=1) + "\n")


def table_pages(description: Description, measured: Measurements) -> dict[str, Page]:
    """Headings and rows of every table, by file name."""
    pages = {}
    for kind, table in each_table(measured):
        settings = description.tables.stated.get(kind.name)
        if settings and kind.page:
            pages[kind.file_name(settings)] = kind.page(table, description)
    return pages


def _description_only(text: str) -> str:
    """The plan's text without its opening comment and its [truth] and [design] tables."""
    lines = text.splitlines()
    while lines and lines[0].lstrip().startswith("#"):
        lines = lines[1:]
    kept, skipping = ["# Written by `bowdenfit simulate`; the truth is in truth.json."], False
    for line in lines:
        if line.strip().startswith("["):
            skipping = line.strip().strip("[]").split(".")[0] in {"truth", "design"}
        if not skipping:
            kept.append(line)
    return "\n".join(kept).rstrip() + "\n"
