"""A data set that is being brought: its files, what they say, what is asked, and what `check` says of all that."""

import re
import sys
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from bowdenfit.addons.app.brought_folder import lay_flat, put_in_place
from bowdenfit.addons.app.description_edit import Part, exclude_part, include_part, read_description_text
from bowdenfit.addons.app.form import Form, FormEntry, UnansweredError
from bowdenfit.dataset import DESCRIPTION_FILE
from bowdenfit.errors import BowdenfitError, UsageError
from bowdenfit.files import FORMATS
from bowdenfit.files.cells import Cell
from bowdenfit.files.formats import check_ending
from bowdenfit.files.tables import read_table
from bowdenfit.outputs import write_text
from bowdenfit.questions.check import check_data_set
from bowdenfit.questions.start.describe import describe_measured_files, inspect_files
from bowdenfit.questions.start.folder import copy_data_set, refuse_existing, refuse_files, write_data_set
from bowdenfit.questions.start.measured_file import MeasuredFile
from bowdenfit.words import printable, shown

if TYPE_CHECKING:
    from bowdenfit.questions.check.data_set_words import Report

_LONGEST_NAME = 60  # characters of a folder that is proposed; a judgement
_LONGEST_FILE_NAME = 120  # characters; systems take 255 bytes
_FORBIDDEN = set('/\\:*?"<>|')  # in names of files, on one system or another
_RESERVED = {"con", "prn", "aux", "nul", *(f"{port}{number}" for port in ("com", "lpt") for number in range(1, 10))}
_MOST_FILES = 300  # of a draft; a judgement: a description names 100 recordings at most
_MOST_FAULTS, _MOST_CELLS = 40, 12  # refusals beside cells, and cells of such a row; judgements


@dataclass(frozen=True)
class Refusal:
    """Why something cannot be read.

    Args:
        sentence: In words.
        file, row, column: The cell that it speaks of; empty, or 0, where it speaks of none.
        cells: That row, as (heading, cell); empty where it cannot be shown.
    """

    sentence: str
    file: str = ""
    row: int = 0
    column: str = ""
    cells: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True)
class Understanding:
    """What is understood of a draft.

    Args:
        files: Its files.
        entries: The questions.
        refusals: Why it cannot be fitted yet.
        description: Text of its cable.toml; empty where questions are open, or it cannot be read.
        report: Report of `check`; empty where it cannot be fitted.
        checked: The same as it was checked; None where it cannot be fitted.
        left_out: Files that the data set will not have, because their contents are not what their extension says.
    """

    files: tuple[MeasuredFile, ...] = ()
    entries: tuple[FormEntry, ...] = ()
    refusals: tuple[Refusal, ...] = ()
    description: str = ""
    report: str = ""
    left_out: tuple[str, ...] = ()
    checked: "Report | None" = None


@dataclass
class Draft:
    """Files on their way to a data set, in a folder of their own that goes with the app.

    Args:
        folder: Where they lie.
        answers: Answers of the user, by question.
        stated: What was stated of columns, as (quantity, unit), by file and heading.
        typed: Cells that are typed, the headings first; empty where nobody types.
        excluded: What is left out, as (kind of table, file, part), with the reason; of a cable.toml that was brought, that
            says it itself.
        understanding: What was understood when it was last looked at.
        is_described: Whether a cable.toml was brought with the files.
        cable: What that calls the cable.
        is_arriving: Whether files are on their way into it, so that it is not read yet.
    """

    folder: Path
    answers: dict[str, str] = field(default_factory=dict)
    stated: dict[str, dict[str, tuple[str, str]]] = field(default_factory=dict)
    typed: list[list[str]] = field(default_factory=list)
    excluded: dict[tuple[str, str, Part], str] = field(default_factory=dict)
    understanding: Understanding = Understanding()
    is_described: bool = False
    cable: str = ""
    is_arriving: bool = False

    @property
    def key(self) -> str:
        """By which the address of its page names it."""
        return self.folder.name

    @property
    def files(self) -> list[Path]:
        """Its measured files, without cable.toml."""
        return [path for path in sorted(self.folder.rglob("*")) if path.is_file() and path != self.folder / DESCRIPTION_FILE]

    @property
    def proposed_name(self) -> str:
        """What its folder may be called: after its cable, or after its first file."""
        checked = self.understanding.checked
        name = checked.description.name if checked else self.cable if self.is_described else Path(self.files[0].name).stem
        name = re.sub(r"[^\w.()+-]+", "-", name).strip("-._")[:_LONGEST_NAME] or "my-cable"
        return f"{name}-cable" if is_module_name(name) else name

    def new_file(self, name: str, rows: int = 0) -> Path:
        """Return where a file of a name is to be written; what was left out of it before is used again.

        Args:
            name: The name.
            rows: Rows at its top that stay as they are, so that those of them that are left out stay so.

        Raises:
            UsageError: The name is not one of a file that may lie in a data set, or there are too many.
        """
        if name == DESCRIPTION_FILE:
            self.is_described = True
            return self.folder / name
        refuse_file_name(name)
        if Path(name).suffix.lower() not in FORMATS:
            extensions = ", ".join(FORMATS)
            raise UsageError(f"{shown(name)} is left out, because its extension is not one of measured files: {extensions}.")
        if len(self.files) >= _MOST_FILES:
            raise UsageError(f"{shown(name)} is one file more than the {_MOST_FILES} that are taken; leave some out first.")
        self._forget_excluded(name, rows)
        return self.folder / name

    def _forget_excluded(self, name: str, rows: int = 0) -> None:
        entries = self.excluded.items()
        self.excluded = {
            key: reason for key, reason in entries if key[1] != name or (isinstance(key[2], int) and key[2] <= rows)
        }

    def remove_file(self, name: str) -> None:
        """Remove one of the files; without a cable.toml of its own it is understood by its files again."""
        if name == DESCRIPTION_FILE:
            self.is_described = False
            (self.folder / name).unlink(missing_ok=True)
        for path in [path for path in self.files if path.name == name]:
            path.unlink()
        self.stated.pop(name, None)
        self._forget_excluded(name)

    def change_part(self, kind: str, file: str, part: Part, reason: str | None) -> None:
        """Leave a part of a table out with a reason, or take it in again without one.

        Args:
            kind, file, part, reason: See `exclude_part`.

        Raises:
            UsageError, DescriptionError, StoreError: cable.toml cannot be changed so.
        """
        if reason is None:
            include_part(self.folder, kind, file, part)
            self.excluded.pop((kind, file, part), None)
            return
        exclude_part(self.folder, kind, file, part, reason)
        if not self.is_described:
            self.excluded[kind, file, part] = reason

    def state(self, file: str, heading: str, quantity: str | None = None, unit: str | None = None) -> None:
        """State what a column holds, or its unit; the other stays as it is.

        Args:
            file, heading: Which column.
            quantity: Quantity in the column; empty if its heading says so.
            unit: Its unit; empty for what its heading says.
        """
        of_file = self.stated.setdefault(file, {})
        before = of_file.get(heading, ("", ""))
        of_file[heading] = (before[0] if quantity is None else quantity, before[1] if unit is None else unit)

    def understand(self) -> Understanding:
        """Return what is understood now: columns, questions, and what `check` says where all are answered."""
        lay_flat(self.folder)
        if self.is_described:
            return self._understand_description()
        form, measured_files, description, checked = Form(self.answers), list[MeasuredFile](), "", None
        refusals: tuple[Refusal, ...] = ()
        try:
            refuse_files(self.files)
            measured_files = inspect_files(self.files, form) if self.files else []
            self._state_columns(measured_files)
            if measured_files:
                description = describe_measured_files(measured_files, _cable_name(measured_files), form)
                write_text(self.folder / DESCRIPTION_FILE, description)
                for (kind, name, part), reason in self.excluded.items():
                    with suppress(UsageError):  # no such table any more, as answers are now
                        exclude_part(self.folder, kind, name, part, reason)
                description = read_description_text(self.folder)
                checked = check_data_set(self.folder, {})
        except UnansweredError:
            pass
        except BowdenfitError as error:
            refusals = add_cells(list_refusals(error), self.files)
        report = str(checked) if checked is not None else ""
        self.understanding = Understanding(
            tuple(measured_files), tuple(form.entries), refusals, description, report, checked=checked
        )
        return self.understanding

    def _understand_description(self) -> Understanding:
        """Return what `check` says of files that were brought with their own cable.toml."""
        description, checked, refusals, left_out = "", None, tuple[Refusal, ...](), tuple[str, ...]()
        try:
            refuse_files(self.files)
            self.cable = put_in_place(self.folder).name
            description = read_description_text(self.folder)
            left_out = tuple(path.name for path in self.files if not _is_measured(path))
            checked = check_data_set(self.folder, {})
        except BowdenfitError as error:
            refusals = add_cells(list_refusals(error), self.files)
        report = str(checked) if checked is not None else ""
        self.understanding = Understanding((), (), refusals, description, report, left_out, checked)
        return self.understanding

    def _state_columns(self, measured_files: Sequence[MeasuredFile]) -> None:
        """Take what was stated of columns."""
        for file in measured_files:
            for heading, (quantity, unit) in self.stated.get(file.name, {}).items():
                file.state(heading, quantity, unit)

    def write(self, folder: Path) -> None:
        """Write it as a data set, as `bowdenfit init` does; with its own cable.toml as it was brought.

        Args:
            folder: The new folder.

        Raises:
            UsageError, StoreError: It exists, or cannot be written; or questions are open.
        """
        if self.is_arriving:
            raise UsageError("files are still on their way; write the data set when they are listed above.")
        if self.understanding.checked is None:
            raise UsageError("it cannot be read yet, or questions are still open; see above, and answer them first.")
        refuse_existing(folder)
        if self.is_described:
            copy_data_set(self.folder, folder, self.understanding.left_out)
        else:
            write_data_set(folder, self.understanding.description, self.files)


def _is_measured(path: Path) -> bool:
    """Whether a file is one of measurements by its extension and its first bytes."""
    try:
        check_ending(path)
    except BowdenfitError:
        return False
    return True


def refuse_file_name(name: str) -> None:
    """Refuse the name of a file that comes from elsewhere where it could lead out of its folder, or steer what shows it.

    Raises:
        UsageError: It does.
    """
    has_odd_end = name.startswith((".", "-", " ")) or name.endswith((" ", "."))
    is_odd = has_odd_end or not name.isprintable() or _FORBIDDEN.intersection(name)
    if is_odd or is_reserved(name) or not 0 < len(name) <= _LONGEST_FILE_NAME or name.lower() == DESCRIPTION_FILE:
        raise UsageError(
            f"{shown(name)} cannot be the name of a measured file here; rename it: letters, digits, blanks and - _ . do, "
            f"{_LONGEST_FILE_NAME} of them at most."
        )


def is_reserved(name: str) -> bool:
    """Whether Windows keeps a name for a device, whatever its extension."""
    return name.partition(".")[0].strip().lower() in _RESERVED


def is_module_name(name: str) -> bool:
    """Whether Python has a module of this name."""
    return name.isidentifier() and (name in sys.stdlib_module_names or find_spec(name) is not None)


def list_refusals(error: BowdenfitError) -> tuple[Refusal, ...]:
    """Return the refusals that an error combines, each with the cell that it speaks of."""
    faults = error.faults or (error,)
    return tuple(_refusal(fault) for fault in faults[:_MOST_FAULTS])


def add_cells(refusals: Sequence[Refusal], files: Sequence[Path]) -> tuple[Refusal, ...]:
    """Return refusals with the rows that they speak of.

    Args:
        refusals: The refusals.
        files: The files.
    """
    rows: dict[str, dict[int, tuple[Cell, ...]]] = {}
    refused_files = {refusal.file for refusal in refusals if refusal.row}
    for path in [path for path in files if path.name in refused_files]:
        with suppress(BowdenfitError):
            rows[path.name] = {row[0].row: row for row in read_table(path).rows}
    with_cells = []
    for refusal in refusals:
        row = rows.get(refusal.file, {}).get(refusal.row, ())
        shown_cells = tuple((cell.column, cell.text) for cell in row[:_MOST_CELLS])
        with_cells.append(replace(refusal, cells=shown_cells))
    return tuple(with_cells)


def _refusal(fault: BowdenfitError) -> Refusal:
    """Return a refusal with the cell that it speaks of."""
    key = fault.fault_key
    if isinstance(key, tuple) and len(key) == 3 and fault.row:
        return Refusal(str(fault), str(key[0]), fault.row, str(key[1]))
    return Refusal(str(fault))


def _cable_name(measured_files: Sequence[MeasuredFile]) -> str:
    """Return the name that is proposed for the cable: that of its first file."""
    stem = printable(measured_files[0].path.stem.replace("-", " ").replace("_", " "))[:80]
    return stem.strip() or "cable"
