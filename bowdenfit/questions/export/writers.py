"""Which format is written by what."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any

from bowdenfit.questions.export.c import header
from bowdenfit.questions.export.fmu import unit
from bowdenfit.questions.export.lookup import lookup_table, table_of_draws
from bowdenfit.questions.export.matlab import function, function_name
from bowdenfit.questions.export.mujoco import model
from bowdenfit.questions.export.parameters import parameters
from bowdenfit.questions.export.transmission import LEVELS, Transmission
from bowdenfit.results.record import Record


@dataclass(frozen=True)
class Asked:
    """What is to be written.

    Args:
        fit: The fit.
        found: Its tables.
        path: The file.
        place: Where a format that holds at one place does; None for the middle of the range.
        compensation: What may be compensated, by name; None where that was not asked.
    """

    fit: Record
    found: Transmission
    path: Path
    place: float | None
    compensation: Mapping[str, Any] | None = None


@dataclass(frozen=True)
class Written:
    """Content of a file, and what is to be known of it."""

    content: bytes
    remarks: tuple[str, ...] = ()


def _c(asked: Asked) -> Written:
    return Written(header(asked.found).encode("ascii"))


def _csv(asked: Asked) -> Written:
    some = len(asked.found.levels) > len(LEVELS)
    text = table_of_draws(asked.found) if some else lookup_table(asked.fit, asked.found)
    return Written(text.encode())


def _fmu(asked: Asked) -> Written:
    return Written(unit(asked.found, asked.fit.name))


def _matlab(asked: Asked) -> Written:
    return Written(function(asked.found, function_name(asked.path)).encode("ascii"))


def _mujoco(asked: Asked) -> Written:
    text, remarks = model(asked.found, asked.place, asked.path)
    return Written(text.encode("ascii"), remarks)


def _yaml(asked: Asked) -> Written:
    return Written(parameters(asked.found, asked.compensation).encode("ascii"))


WRITERS: Mapping[str, Callable[[Asked], Written]] = MappingProxyType(
    {"c": _c, "csv": _csv, "fmu": _fmu, "matlab": _matlab, "mujoco": _mujoco, "yaml": _yaml}
)
