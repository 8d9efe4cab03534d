"""Mistakes that people make in tables: columns exchanged, a wrong unit in the heading, a slipped cell, labels merged."""

import shutil
import tomllib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

Cells = list[list[str]]
Corruption = Callable[[Cells, np.random.Generator], str]
UNITS = {"_N": "_lbf", "_N_m": "_lbf_in", "_deg": "_rad", "_rad": "_deg", "_mm": "_in"}


def corrupt(dataset: Path, folder: Path, seed: int) -> str:
    """Make a copy of a data set with one mistake, drawn at random, in one of the tables that a fit reads.

    Args:
        dataset: The data set.
        folder: Where the copy goes.
        seed: Decides the mistake.

    Returns:
        The mistake in words.
    """
    generator = np.random.default_rng(seed)
    shutil.copytree(dataset, folder)
    files = read_by_a_fit(folder)
    path = files[generator.integers(len(files))]
    lines = [line for line in path.read_text().splitlines() if line]
    comments = [line for line in lines if line.startswith("#")]
    cells = [line.split(",") for line in lines if not line.startswith("#")]
    for which in generator.permutation(len(CORRUPTIONS)):
        if case := CORRUPTIONS[which](cells, generator):
            path.write_text("\n".join([*comments, *(",".join(row) for row in cells)]) + "\n")
            return f"{path.name}: {case}"
    raise AssertionError(f"no mistake can be made in {path}")


def read_by_a_fit(folder: Path) -> list[Path]:
    """The files that cable.toml names."""
    return sorted({folder / name for name in _named(tomllib.loads((folder / "cable.toml").read_text()))})


def _named(stated_value: Any) -> Iterator[str]:
    if isinstance(stated_value, dict):
        for key, value in stated_value.items():
            if key in ("file", "files"):
                yield from [value] if isinstance(value, str) else value
            else:
                yield from _named(value)
    elif isinstance(stated_value, list):
        for value in stated_value:
            yield from _named(value)


def _measured(cells: Cells) -> list[int]:
    """Columns of what was measured."""
    return [k for k, head in enumerate(cells[0]) if head.endswith(tuple(UNITS)) or "percent" in head]


def _number(cell: str) -> bool:
    return bool(cell.strip()) and not cell.startswith("<")


def exchange_forces(cells: Cells, generator: np.random.Generator) -> str:
    """Headings of input and output exchanged."""
    ends = [[k for k, head in enumerate(cells[0]) if head.startswith(end)] for end in ("input", "output")]
    if not all(ends):
        return ""
    (a,), (b,) = ends
    cells[0][a], cells[0][b] = cells[0][b], cells[0][a]
    return f"{cells[0][a]} and {cells[0][b]} exchanged"


def mistake_unit(cells: Cells, generator: np.random.Generator) -> str:
    """Another unit in the heading than the numbers have."""
    heads = [k for k, head in enumerate(cells[0]) if head.endswith(tuple(UNITS)) and "sd" not in head]
    if not heads:
        return ""
    k = heads[generator.integers(len(heads))]
    old = cells[0][k]
    ending = max((e for e in UNITS if old.endswith(e)), key=len)
    cells[0][k] = old.removesuffix(ending) + UNITS[ending]
    return f"{cells[0][k]} for {old}"


def slip_decimal_point(cells: Cells, generator: np.random.Generator) -> str:
    """One cell ten times too large or too small."""
    columns = _measured(cells)
    k, i = columns[generator.integers(len(columns))], 1 + generator.integers(len(cells) - 1)
    if not _number(cells[i][k]):
        return ""
    factor = 10 if generator.uniform() < 0.5 else 0.1
    cells[i][k] = f"{float(cells[i][k]) * factor:.6g}"
    return f"row {i}, {cells[0][k]} times {factor:g}"


def turn_sign(cells: Cells, generator: np.random.Generator) -> str:
    """A whole column with the other sign."""
    columns = _measured(cells)
    k = columns[generator.integers(len(columns))]
    for row in cells[1:]:
        row[k] = f"{-float(row[k]):g}" if _number(row[k]) else row[k]
    return f"{cells[0][k]} with the other sign"


def shift_headings(cells: Cells, generator: np.random.Generator) -> str:
    """Headings that stand one column too far to the left, the first at the end."""
    columns = _measured(cells)
    if len(columns) < 2:
        return ""
    heads = [cells[0][k] for k in columns]
    for k, head in zip(columns, [*heads[1:], heads[0]], strict=True):
        cells[0][k] = head
    return "headings shifted by a column"


def exchange_cells(cells: Cells, generator: np.random.Generator) -> str:
    """A cell that was written a row too low, and the one from there a row too high."""
    columns = _measured(cells)
    k, i = columns[generator.integers(len(columns))], 1 + generator.integers(len(cells) - 2)
    cells[i][k], cells[i + 1][k] = cells[i + 1][k], cells[i][k]
    return f"rows {i} and {i + 1}, {cells[0][k]}: exchanged"


def merge_labels(cells: Cells, generator: np.random.Generator) -> str:
    """Two runs with one label."""
    if "run" not in cells[0]:
        return ""
    k = cells[0].index("run")
    names = list(dict.fromkeys(row[k] for row in cells[1:]))
    a, b = generator.choice(len(names), 2, replace=False)
    for row in cells[1:]:
        row[k] = names[a] if row[k] == names[b] else row[k]
    return f"run {names[b]} labeled {names[a]}"


CORRUPTIONS: tuple[Corruption, ...] = (
    exchange_forces,
    mistake_unit,
    slip_decimal_point,
    turn_sign,
    shift_headings,
    exchange_cells,
    merge_labels,
)
