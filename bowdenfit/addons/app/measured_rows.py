"""The rows of a data set as they stand in its files, and what was read of them: before a fit, and although some are refused."""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from bowdenfit.addons.app.draft import Refusal
from bowdenfit.dataset import DESCRIPTION_FILE, Dataset, read_dataset
from bowdenfit.description import Description, Table
from bowdenfit.description.measurements import ExcludedRows
from bowdenfit.errors import BowdenfitError, Faults
from bowdenfit.files.tables import read_table
from bowdenfit.kinds.descriptions import load_description
from bowdenfit.kinds.recordings.reader import RecordingsTable
from bowdenfit.kinds.table_files import Source
from bowdenfit.recordings.recording import Recordings

READ: Final = "read"
LEFT_OUT: Final = "left out"
REFUSED: Final = "refused"


@dataclass(frozen=True)
class FileRow:
    """A row of readings as it stands in its file.

    Args:
        row: Its number there.
        cells: Its cells.
        state: Whether it is read, left out by the user, or refused.
        why: Why it is left out or refused; empty where it is read.
    """

    row: int
    cells: tuple[str, ...]
    state: str = READ
    why: str = ""


@dataclass(frozen=True)
class FileRows:
    """The rows of readings of one file.

    Args:
        kind: Kind of its table.
        file: Its name, as seen from the data set.
        headings: Headings of its columns.
        rows: The rows.
    """

    kind: str
    file: str
    headings: tuple[str, ...]
    rows: tuple[FileRow, ...]


@dataclass(frozen=True)
class UnusedRow:
    """What can be drawn of a row that is not used.

    Args:
        kind: Kind of its table.
        file: Name of its file, without folders.
        row: Its number there.
        state: Whether it is left out by the user, or refused.
        values: Numbers in it by quantity, in internal units.
    """

    kind: str
    file: str
    row: int
    state: str
    values: dict[str, float]


@dataclass(frozen=True)
class RecordedFile:
    """A file of a recording.

    Args:
        file: Its name, as seen from the data set.
        excluded: Stretches that the user leaves out [s], None for all of it, each with the reason.
    """

    file: str
    excluded: tuple[tuple[tuple[float, float] | None, str], ...] = ()


@dataclass(frozen=True)
class MeasuredRows:
    """What there is to draw of a data set.

    Args:
        dataset: What is read, without the rows that are refused; None where the rest is refused too.
        files: The rows of its tables.
        unused: What can be drawn of the others.
        recorded: The files of its recordings.
    """

    dataset: Dataset | None = None
    files: tuple[FileRows, ...] = ()
    unused: tuple[UnusedRow, ...] = ()
    recorded: tuple[RecordedFile, ...] = ()

    def find_recorded(self, number: int) -> RecordedFile | None:
        """Return the file of a recording by its number among those that are read; None where it cannot be told."""
        recordings = self.dataset.measurements.table(Recordings) if self.dataset is not None else None
        if recordings is None or number >= len(recordings.items):
            return None
        named = [file for file in self.recorded if Path(file.file).name == Path(recordings.items[number].file).name]
        return named[0] if len(named) == 1 else None


def collect_rows(folder: Path, refusals: Sequence[Refusal] = ()) -> MeasuredRows:
    """Return the rows of a data set.

    Args:
        folder: The data set.
        refusals: Why it is refused.
    """
    refusals = [refusal for refusal in refusals if refusal.row]
    try:
        description = load_description(folder / DESCRIPTION_FILE, faults=Faults())
    except BowdenfitError:
        return MeasuredRows()
    sources = [
        Source(kind, settings, description, folder)
        for kind, settings in description.tables.stated.items()
        if isinstance(settings, Table)
    ]
    files = list[FileRows]()
    for source in sources:
        with suppress(BowdenfitError):
            files += [_list_file_rows(source, path, refusals) for path in source.files]
    recorded = tuple(_list_recorded(description, folder))
    with suppress(BowdenfitError):
        dataset = read_dataset(_without_refused(description, sources, refusals), folder, {})
        return MeasuredRows(dataset, tuple(files), tuple(_list_unused(dataset, files)), recorded)
    return MeasuredRows(None, tuple(files), recorded=recorded)


def _list_recorded(description: Description, folder: Path) -> list[RecordedFile]:
    """Return the files of the recordings, with what is left out of each."""
    settings = description.table(RecordingsTable)
    if settings is None:
        return []
    source = Source("recordings", settings, description, folder)
    names = [entry.file for entry in description.recording]
    seconds = {entry.output_file for entry in description.recording}
    with suppress(BowdenfitError):
        names += [source.name_of(path) for path in source.files]
    parts = settings.exclude
    return [
        RecordedFile(name, tuple((part.span, part.reason) for part in parts if part.file in (None, name)))
        for name in dict.fromkeys(names)
        if name not in seconds
    ]


def _list_file_rows(source: Source, path: Path, refusals: Sequence[Refusal]) -> FileRows:
    """Return the rows of readings of a file, with what becomes of each."""
    table = read_table(path, sheet=source.sheets_of(path)[0])
    own_entries = [part for part in source.settings.exclude if part.file in (None, source.name_of(path))]
    excluded = {row: part.reason for part in own_entries for row in part.rows}
    refused = {refusal.row: refusal.sentence for refusal in refusals if refusal.file == path.name}
    rows = []
    for cells in table.rows:
        number = cells[0].row
        state = LEFT_OUT if number in excluded else REFUSED if number in refused else READ
        reason = excluded.get(number) or refused.get(number, "")
        rows.append(FileRow(number, tuple(cell.text for cell in cells), state, reason))
    return FileRows(source.kind, source.name_of(path), table.header, tuple(rows))


def _list_unused(dataset: Dataset, files: Sequence[FileRows]) -> list[UnusedRow]:
    """Return what can be drawn of the rows that are not used: those that the user leaves out, and those that are refused."""
    states = {(file.kind, Path(file.file).name, row.row): row.state for file in files for row in file.rows}
    return [
        UnusedRow(kind, row.file, row.row, states.get((kind, row.file, row.row), LEFT_OUT), row.values)
        for kind, rows in dataset.measurements.excluded.items()
        for row in rows
    ]


def _without_refused(description: Description, sources: Sequence[Source], refusals: Sequence[Refusal]) -> Description:
    """Return a description that leaves out the rows that are refused, so that the others can be drawn."""
    tables = description.tables
    for source in sources:
        names = {path.name: source.name_of(path) for path in source.files}
        refused = [
            ExcludedRows(rows=(refusal.row,), reason=REFUSED, file=names[refusal.file])
            for refusal in refusals
            if refusal.file in names
        ]
        if refused:
            settings = source.settings.model_copy(update={"exclude": (*source.settings.exclude, *refused)})
            tables = tables.model_copy(update={source.kind: settings})
    return description.model_copy(update={"tables": tables})
