"""Recordings in Parquet files."""

from pathlib import Path
from typing import Any

import numpy as np

from bowdenfit.files.channels import (
    Channel,
    ChannelFile,
    UnreadNames,
    load_library,
    make_channel_file,
    make_names_unique,
    refuse_damage,
    refuse_too_large,
)
from bowdenfit.files.clocks import assign_clocks
from bowdenfit.files.headings import Heading, heading_of
from bowdenfit.types import Vector
from bowdenfit.words import shown

_UNIT_KEYS = (b"unit", b"units", b"Unit")


def read(path: Path) -> ChannelFile:
    """Read the numeric columns, and timestamps as seconds from the first.

    The unit is what the metadata of the column say under "unit", else what its heading says. Columns are read one by
    one, so that the memory needed is about that of the numbers, 8 bytes a cell.

    Limits: 2 GiB of numbers (`channels.LARGEST_BYTES`).

    Args:
        path: The file.

    Raises:
        DatasetError: pyarrow is not installed; the file is missing, damaged or too large, or holds no numbers.
    """
    pyarrow = load_library("pyarrow", "Parquet")
    parquet = load_library("pyarrow.parquet", "Parquet")
    with refuse_damage(path), parquet.ParquetFile(path) as file:
        fields = list(file.schema_arrow)
        used = [field for field in fields if _is_readable(pyarrow, field.type)]
        rows = file.metadata.num_rows
        refuse_too_large(path, rows * len(used), f" ({rows} rows of {len(used)} columns)")
        columns = [_values(pyarrow, file.read(columns=[field.name]).column(0)) for field in used]
    headings = [_heading(pyarrow, field) for field in used]
    channels = [
        Channel(h.name, h.unit, values, start=start) for h, (values, start) in zip(headings, columns, strict=True)
    ]
    remarks = [
        f"The column {shown(field.name)} holds no numbers ({field.type}) and was left out."
        for field in fields
        if not _is_readable(pyarrow, field.type)
    ]
    return make_channel_file(path, "Parquet", assign_clocks(make_names_unique(channels)), UnreadNames(), remarks)


def _is_readable(pyarrow: Any, kind: Any) -> bool:
    is_a = pyarrow.types
    tests = (is_a.is_integer, is_a.is_floating, is_a.is_decimal, is_a.is_timestamp, is_a.is_duration)
    return any(test(kind) for test in tests)


def _values(pyarrow: Any, column: Any) -> tuple[Vector, float | None]:
    """Return numbers of a column, NaN where it has none, times in seconds; and when dates start (`Channel.start`)."""
    kind = column.type
    if pyarrow.types.is_timestamp(kind) or pyarrow.types.is_duration(kind):
        ticks = column.cast(pyarrow.int64())
        first = next((tick.as_py() for tick in ticks if tick.is_valid), 0)
        origin = first if pyarrow.types.is_timestamp(kind) else 0
        counted = pyarrow.compute.subtract(ticks, origin).cast(pyarrow.float64(), safe=False)
        ticks_a_second = {"s": 1, "ms": 1e3, "us": 1e6, "ns": 1e9}[kind.unit]
        return counted.to_numpy() / ticks_a_second, origin / ticks_a_second if origin else None
    return np.array(column.cast(pyarrow.float64(), safe=False).to_numpy(), dtype=float), None


def _heading(pyarrow: Any, field: Any) -> Heading:
    if pyarrow.types.is_timestamp(field.type) or pyarrow.types.is_duration(field.type):
        return Heading(field.name, "s")
    metadata = field.metadata or {}
    unit = next((metadata[key].decode("utf-8", errors="replace") for key in _UNIT_KEYS if key in metadata), "")
    return Heading(field.name, unit) if unit else heading_of(field.name)
