"""What a kind of measurement declares of itself, as far as NumPy goes; its term in the likelihood is declared beside it."""

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Generic, TypeVar

import numpy as np

from bowdenfit.description import Description, Table, TableSettings
from bowdenfit.description.file import Stated
from bowdenfit.errors import DatasetError
from bowdenfit.files.row_account import RowAccount
from bowdenfit.inputs import matching
from bowdenfit.kinds.asked import Asked
from bowdenfit.kinds.coarse import Coarse
from bowdenfit.kinds.design import Design
from bowdenfit.kinds.measurements import Measurements
from bowdenfit.kinds.pages import Page
from bowdenfit.kinds.readings import Readings
from bowdenfit.kinds.rows import ForceRows
from bowdenfit.types import Vector
from bowdenfit.units import ColumnSource

AnyTable = TypeVar("AnyTable")


@dataclass(frozen=True)
class Source:
    """Where a table is to be read from, and what is said of it.

    Args:
        kind: Name of its kind.
        settings: What stands under that name in [tables].
        description: The whole description.
        folder: Where the files are.
        channels: Channels named on the command line.
    """

    kind: str
    settings: Any
    description: Description
    folder: Path
    channels: Mapping[str, ColumnSource] = field(default_factory=dict)

    @property
    def files(self) -> list[Path]:
        """Its files; patterns are expanded in sorted order.

        Raises:
            DatasetError: A pattern matches none.
        """
        stated = (getattr(self.settings, "file", None), self.settings.files)
        named = [name for part in stated if part for name in ([part] if isinstance(part, str) else part)]
        paths: list[Path] = []
        for name in named:
            is_pattern = any(c in name for c in "*?[") and not os.path.isfile(self.folder / name)  # noqa: PTH113  (any name)
            matches = matching(self.folder, name) if is_pattern else [self.folder / name]
            if not matches:
                raise DatasetError(
                    f"no file in {self.folder} matches {name!r}, which cable.toml names for the table {self.kind}."
                )
            paths += matches
        return paths

    @property
    def file(self) -> Path:
        """Its only file.

        Raises:
            DatasetError: It has several.
        """
        paths = self.files
        if len(paths) != 1:
            raise DatasetError(f"the table {self.kind} must be one file; cable.toml names {len(paths)}.")
        return paths[0]

    @property
    def columns(self) -> dict[str, ColumnSource]:
        """Columns that do not carry the usual names."""
        return self.settings.columns

    def name_of(self, path: Path) -> str:
        """A file as seen from the folder."""
        return path.relative_to(self.folder).as_posix() if path.is_relative_to(self.folder) else path.name


@dataclass(frozen=True)
class Found(Generic[AnyTable]):
    """A table that was read.

    Args:
        table: The table.
        files: The files it was read from, by name.
        remarks: What had to be assumed, in sentences.
        accounts: Where the rows of each file went.
    """

    table: AnyTable
    files: Mapping[str, Path]
    remarks: tuple[str, ...] = ()
    accounts: tuple[RowAccount, ...] = ()


@dataclass(frozen=True)
class Kind(Generic[AnyTable]):
    """A kind of measurement.

    Args:
        name: What it is called under [tables] in cable.toml, and in fit.json.
        table: The class of its tables; no two kinds share one.
        readings: What its readings are called, by the names that its terms give them.
        read: Reads its files.
        settings: What may stand under its name in [tables].
        contradiction: What a description says that cannot be, in a sentence without its full stop; its settings are None
            where there is no such table.
        quantities: Quantities in the settings, which must have the right dimensions.
        describe: What was understood of a table, for `check`, line by line.
        alone: What a file is that holds such a table alone, in words with an article.
        heading: Over these lines, where they are a section of their own.
        warnings: What a table will not be able to tell, as far as counting shows.
        check: Refuses a table that does not fit the description or the other tables.
        copies: Which readings were copied from others, in sentences without a first capital or remedy.
        coarse: What is known of a table whose repeated readings are all alike to the last digit; None of any other.
        count: How many readings were fitted, in words; empty where its term counts them.
        method: How its readings are described, in a sentence of a paper.
        implausible: Why no bench would hand in simulated readings in place of the measured ones, in a few words; empty if
            one might.
        page: Its table as the headings and rows of a file; None where it is written otherwise.
        design: What it reads of [design] in a plan.
        empty: A table of such a design with unremarkable readings, as of a file of some name; None where plans are otherwise.
        bends: Total wrap angles at which the rope itself was measured [rad]; None if it was not.
        conditions: Where and at which wrap angles friction was measured; None if it was not.
        forces: Forces that friction acted on [N].
        tensions: Tensions of the rope where nobody asked what friction did [N].
        speeds: Speeds of sliding [mm/s or rad/s].
        typical_speeds: Of its recordings or runs, in the same unit.
        velocity_unit: Which of the two; empty without velocities.
        groups: Group of each row; empty without groups.
        takes_channels: Whether channels can be named on the command line.
        asked: What is asked of its files where there is no description; None if it is never offered.
    """

    name: str
    table: type[AnyTable]
    readings: tuple[Readings, ...]
    read: Callable[[Source], Found[AnyTable]]
    describe: Callable[[AnyTable, Description], list[str]]
    alone: Callable[[AnyTable], str] = lambda _: "a table"
    settings: type[TableSettings] = Table
    contradiction: Callable[[Any, Description], str] = lambda *_: ""
    quantities: Callable[[Any, Description], list[Stated]] = lambda *_: []
    heading: str = ""
    warnings: Callable[[AnyTable, Description, Measurements], list[str]] = lambda *_: []
    check: Callable[[AnyTable, Description, Measurements], None] = lambda *_: None
    copies: Callable[[AnyTable], list[str]] = lambda _: []
    coarse: Callable[[AnyTable], Coarse | None] = lambda _: None
    count: Callable[[AnyTable], str] = lambda _: ""
    method: str = ""
    implausible: Callable[[AnyTable, AnyTable], str] = lambda *_: ""
    page: Callable[[AnyTable, Description], Page] | None = None
    design: type[Design] = Design
    empty: Callable[[Any, Description, str], AnyTable] | None = None
    bends: Callable[[AnyTable], Vector] | None = None
    conditions: Callable[[AnyTable], ForceRows] | None = None
    forces: Callable[[AnyTable], Vector] = lambda _: np.zeros(0)
    tensions: Callable[[AnyTable], Vector] = lambda _: np.zeros(0)
    speeds: Callable[[AnyTable], Vector] = lambda _: np.zeros(0)
    typical_speeds: Callable[[AnyTable], list[float]] = lambda _: []
    velocity_unit: Callable[[AnyTable], str] = lambda _: ""
    groups: Callable[[AnyTable], tuple[str, ...]] = lambda _: ()
    takes_channels: bool = False
    asked: Asked | None = None

    def file_name(self, settings: Any) -> str:
        """The file that a table is written to: as stated, or by the name of its kind."""
        return getattr(settings, "file", None) or f"{self.name}.csv"


def itself(table: AnyTable) -> AnyTable:
    """The conditions of a table whose rows carry them."""
    return table
