"""Files of tables: where a table is read from, what reading gives, and what `bowdenfit init` asks about such files."""

import json
import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from math import inf
from pathlib import Path
from typing import Any, Generic, TypeVar

from bowdenfit.description import MOST_FILES, Description
from bowdenfit.errors import BowdenfitError, DatasetError, DescriptionError, suggest_name
from bowdenfit.files.columns import Column, Quantity, find_columns
from bowdenfit.files.excluded_rows import leave_out_rows
from bowdenfit.files.formats import WORKBOOKS
from bowdenfit.files.merged_cells import fill_merged_cells
from bowdenfit.files.missing_codes import MissingCodes, leave_out_coded_rows
from bowdenfit.files.row_account import BY_USER, RowAccount
from bowdenfit.files.tables import RawTable, read_table
from bowdenfit.inputs import match_files
from bowdenfit.units import ColumnSource
from bowdenfit.words import shown

AnyTable = TypeVar("AnyTable")


@dataclass(frozen=True)
class Source:
    """Files of a table and what the description says of it.

    Args:
        kind: Name of its kind.
        settings: Settings under that name in [tables].
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
        """Files of the table; patterns are expanded in sorted order.

        Raises:
            DatasetError: A pattern matches none.
            DescriptionError: They are too many.
        """
        stated = (getattr(self.settings, "file", None), self.settings.files)
        named = [name for part in stated if part for name in ([part] if isinstance(part, str) else part)]
        paths: list[Path] = []
        for name in named:
            is_pattern = any(c in name for c in "*?[") and not os.path.isfile(self.folder / name)  # noqa: PTH113  (any name)
            matches = match_files(self.folder, name) if is_pattern else [self.folder / name]
            if not matches:
                raise DatasetError(
                    f"no file in {self.folder} matches {name!r}, which cable.toml names for the table {self.kind}.",
                    key_path=("tables", self.kind, "file" if name == stated[0] else "files"),
                )
            paths += matches
            if len(paths) > MOST_FILES:
                raise DescriptionError(
                    f"cable.toml, tables.{self.kind}: it names {len(paths):,} files or more, and at most {MOST_FILES:,} are "
                    "read; name those of one cable, or fit them in parts."
                )
        return paths

    @property
    def file(self) -> Path:
        """The only file of the table.

        Raises:
            DatasetError: It has several.
        """
        paths = self.files
        if len(paths) != 1:
            raise DatasetError(f"the table {self.kind} must be one file; cable.toml names {len(paths)}.")
        return paths[0]

    def sheets_of(self, path: Path) -> tuple[str, ...]:
        """Return the titles of the sheets that are read of a file; one that is empty where none is stated.

        Of files of which some are workbooks, the others have no sheets.

        Args:
            path: The file.
        """
        titles, is_workbook = self.settings.sheet, path.suffix.lower() in WORKBOOKS
        if not is_workbook and any(file.suffix.lower() in WORKBOOKS for file in self.files):
            return ("",)
        return (titles,) if isinstance(titles, str) else titles or ("",)

    @property
    def columns(self) -> dict[str, ColumnSource]:
        """Columns that do not have the usual names."""
        return self.settings.columns

    def read_table(
        self, path: Path, wanted: tuple[Quantity, ...], unused: tuple[str, ...] = (), sheet: str | None = None
    ) -> tuple[RawTable, dict[str, Column]]:
        """Return one of the tables and the wanted quantities that it has, without rows that a stated code marks as missing.

        Args:
            path: The file.
            wanted: Quantities to look for.
            unused: Names that the user may give a column although nothing reads it.
            sheet: Title of the sheet of a workbook; the stated one if omitted.

        Raises:
            DatasetError: See `read_table`; or every row holds a code, or several sheets are stated.
        """
        if sheet is None:
            sheet, *more = self.sheets_of(path)
            if more:
                raise DatasetError(f"the table {self.kind} must be on one sheet; cable.toml names {len(more) + 1}.")
        codes = MissingCodes(self.settings.missing)
        with self.name_keys(path):
            table = codes.mark(read_table(path, sheet=sheet))
            table, columns = fill_merged_cells(table, find_columns(table, wanted, self.columns, unused), wanted)
            for fault in table.faults.faults:
                fault.put_below("tables", self.kind)
            excluded = {row: f"{BY_USER}{part.reason}" for part in self.find_excluded(path) for row in part.rows}
            table, columns = leave_out_rows(table, columns, excluded)
            return leave_out_coded_rows(table, columns, wanted, codes)

    @contextmanager
    def name_keys(self, path: Path | None = None) -> Iterator[None]:
        """Name the key under [tables] that an error is about; in reading a file that does not exist, the key that names it."""
        try:
            yield
        except BowdenfitError as error:
            if path is not None and not path.exists():
                error.key_path = ("file" if getattr(self.settings, "file", None) else "files",)
            error.put_below("tables", self.kind)
            raise

    def find_excluded(self, path: Path, files: Sequence[Path] = ()) -> list[Any]:
        """Return the entries of `exclude` that leave out parts of a file.

        Args:
            path: The file.
            files: All files of the table; those of the settings if omitted.

        Raises:
            DescriptionError: It is not clear of which file they are, or the table has no file of that name.
        """
        names, excluded = {self.name_of(file) for file in files or self.files}, []
        for part in self.settings.exclude:
            if part.file is None and len(names) > 1:
                example = json.dumps(min(names))
                raise DescriptionError(
                    f"cable.toml, tables.{self.kind}, exclude: the table has {len(names)} files; say of which one this is, "
                    f'such as {{ file = {example}, ..., reason = "{part.reason}" }}.',
                    key_path=("exclude",),
                )
            if part.file is not None and part.file not in names:
                raise DescriptionError(
                    f"cable.toml, tables.{self.kind}, exclude: the table has no file {shown(part.file)}"
                    f"{suggest_name(part.file, sorted(names))}",
                    key_path=("exclude",),
                )
            if part.file in (None, self.name_of(path)):
                excluded.append(part)
        return excluded

    def name_of(self, path: Path) -> str:
        """Return a file's path as seen from the folder."""
        return path.relative_to(self.folder).as_posix() if path.is_relative_to(self.folder) else path.name


@dataclass(frozen=True)
class TableFromFiles(Generic[AnyTable]):
    """A table with its files, remarks and row accounts.

    Args:
        table: The table.
        files: The files it was read from, by name.
        remarks: Assumptions that were made, in sentences.
        accounts: How many rows of each file were read, and why the others were not.
    """

    table: AnyTable
    files: Mapping[str, Path]
    remarks: tuple[str, ...] = ()
    accounts: tuple[RowAccount, ...] = ()


@dataclass(frozen=True)
class WantedColumn:
    """A column of a table.

    Args:
        quantity: Quantity in the column.
        words: The same for people, such as "the force at the motor".
        also: Quantities that do instead.
        optional: Whether a table can be without it.
        numbers: The lowest and the highest number that may stand for words.
    """

    quantity: Quantity
    words: str
    also: tuple[Quantity, ...] = ()
    optional: bool = False
    numbers: tuple[float, float] = (-inf, inf)


RUN = WantedColumn(Quantity("run", "text"), "which mounting of the cable a row belongs to", optional=True)
STROKE = WantedColumn(
    Quantity("stroke", "text"), "whether a row was read while pulling or returning", optional=True, numbers=(-1, 1)
)


@dataclass(frozen=True)
class YesNoQuestion:
    """A question of `bowdenfit init` whose yes writes a setting beside the file.

    Args:
        unless: Name of the column that answers it; it is asked only where there is none.
        words: The question, with braces for the name of the file.
        key, value: The setting.
    """

    unless: str
    words: str
    key: str
    value: str


@dataclass(frozen=True)
class InitQuestions:
    """How files of a kind are recognized, and what is asked about them.

    Args:
        holds: Contents of such a file, in words.
        columns: Its columns but for lengths and wrap angles of contacts.
        yes_no: Questions beside those for its columns.
        by_length: Whether its columns are the wrap angles of contacts at several lengths.
        has_own_angles: Whether its rows may have a length, and wrap angles of contacts.
        several: Whether it may be several files.
        is_guessed: Whether a file that has the columns is taken for one.
        description: What such a table makes of the rest of the description.
    """

    holds: str
    columns: tuple[WantedColumn, ...] = ()
    yes_no: tuple[YesNoQuestion, ...] = ()
    by_length: bool = False
    has_own_angles: bool = False
    several: bool = False
    is_guessed: bool = True
    description: Mapping[str, Any] = field(default_factory=dict, hash=False)

    @property
    def required(self) -> tuple[WantedColumn, ...]:
        """The columns that a table cannot be without."""
        return tuple(column for column in self.columns if not column.optional)
