"""Which format is written by what."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any

from bowdenfit.questions.export.c import c_header
from bowdenfit.questions.export.fmu import build_fmu
from bowdenfit.questions.export.lookup import draws_table, lookup_table
from bowdenfit.questions.export.matlab import function_name, matlab_function
from bowdenfit.questions.export.mujoco import mujoco_model
from bowdenfit.questions.export.parameters import yaml_parameters
from bowdenfit.questions.export.transmission import LEVELS, TransmissionTables
from bowdenfit.results.record import Record


@dataclass(frozen=True)
class ExportRequest:
    """What is to be written.

    Args:
        fit: The fit.
        found: Its tables.
        path: The file.
        place: Where a format that holds at one place does; None for the middle of the range.
        compensation: What may be compensated, by name; None where that was not asked.
    """

    fit: Record
    tables: TransmissionTables
    path: Path
    point: float | None
    compensation: Mapping[str, Any] | None = None


@dataclass(frozen=True)
class FileContent:
    """Content of a file, and what is to be known of it."""

    content: bytes
    remarks: tuple[str, ...] = ()


def _write_c(request: ExportRequest) -> FileContent:
    return FileContent(c_header(request.tables).encode("ascii"))


def _write_csv(request: ExportRequest) -> FileContent:
    with_draws = len(request.tables.levels) > len(LEVELS)
    text = draws_table(request.tables) if with_draws else lookup_table(request.fit, request.tables)
    return FileContent(text.encode())


def _write_fmu(request: ExportRequest) -> FileContent:
    return FileContent(build_fmu(request.tables, request.fit.name))


def _write_matlab(request: ExportRequest) -> FileContent:
    return FileContent(matlab_function(request.tables, function_name(request.path)).encode("ascii"))


def _write_mujoco(request: ExportRequest) -> FileContent:
    text, remarks = mujoco_model(request.tables, request.point, request.path)
    return FileContent(text.encode("ascii"), remarks)


def _write_yaml(request: ExportRequest) -> FileContent:
    return FileContent(yaml_parameters(request.tables, request.compensation).encode("ascii"))


WRITERS: Mapping[str, Callable[[ExportRequest], FileContent]] = MappingProxyType(
    {
        "c": _write_c,
        "csv": _write_csv,
        "fmu": _write_fmu,
        "matlab": _write_matlab,
        "mujoco": _write_mujoco,
        "yaml": _write_yaml,
    }
)
