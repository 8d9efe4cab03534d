"""Rows that are added to a table of a data set: checked with all the rest of it before anything is written."""

import csv
import io
import shutil
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from tempfile import TemporaryDirectory

from bowdenfit.addons.app.draft import Refusal, list_refusals
from bowdenfit.dataset import DESCRIPTION_FILE
from bowdenfit.errors import BowdenfitError, DatasetError, Faults, UsageError
from bowdenfit.files.formats import WORKBOOKS
from bowdenfit.files.tables import RawTable, read_table
from bowdenfit.files.text_file import SEPARATORS, Line, declared_separator, first_lines, split_cells
from bowdenfit.inputs import refuse_special
from bowdenfit.kinds import KINDS
from bowdenfit.kinds.descriptions import load_description
from bowdenfit.kinds.table_files import Source
from bowdenfit.outputs import refuse_link, replace_atomically
from bowdenfit.questions.check import check_data_set
from bowdenfit.questions.watch.files import link_neighbors
from bowdenfit.words import shown


@dataclass(frozen=True)
class CheckedRows:
    """What is said of rows that are to be added.

    Args:
        count: How many they are.
        refusals: Why they are not added; those of a cell have the row of the file in which it would stand.
        report: Report of `check` on the data set with them; empty where it is refused.
    """

    count: int
    refusals: tuple[Refusal, ...] = ()
    report: str = ""


@dataclass(frozen=True)
class OpenTable:
    """A table as it lay there when it was opened.

    Args:
        folder: The data set.
        name: Name of the file, as seen from the folder.
        content: All its bytes.
        encoding: Encoding of its text.
        separator: Separator of its columns.
        headings: Heading of each column.
        rows: Its rows of readings, as text.
        last_row: Number of the last of them in the file.
        insert_at: Where the next row goes [bytes].
        line_end: How its lines end.
        is_ended: Whether the last of its rows has an end of line behind it.
    """

    folder: Path
    name: str
    content: bytes
    encoding: str
    separator: str
    headings: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    last_row: int
    insert_at: int
    line_end: str
    is_ended: bool

    @property
    def path(self) -> Path:
        """Where it lies."""
        return self.folder / self.name

    def check(self, rows: Sequence[Sequence[str]]) -> CheckedRows:
        """Return what `check` says of the data set with more rows; what it said without them counts for nothing.

        Args:
            rows: Cells of each, in the order of the headings.
        """
        if not rows:
            return CheckedRows(0)
        try:
            with self._copy_with(self._append(rows)) as copy:
                report = str(check_data_set(copy, {}))
                _refuse_unread_rows(read_table(copy / self.name), self, len(rows))
        except BowdenfitError as error:
            known = _known_refusals(self.folder)
            refusals = (refusal for refusal in list_refusals(error) if refusal.sentence not in known)
            return CheckedRows(len(rows), tuple(refusals))
        return CheckedRows(len(rows), (), report)

    def save(self, rows: Sequence[Sequence[str]]) -> None:
        """Add rows to the file, which is replaced as a whole or stays as it is.

        Args:
            rows: Cells of each, in the order of the headings.

        Raises:
            UsageError: There are none, they are refused, or the file has changed since it was opened.
            StoreError: It cannot be replaced.
        """
        if not rows:
            raise UsageError("no row is filled in; type or paste some first.")
        if refusals := self.check(rows).refusals:
            raise UsageError("\n".join([*(refusal.sentence for refusal in refusals), f"{self.name} is as it was."]))
        refuse_link(self.path)
        if self.path.read_bytes() != self.content:
            raise UsageError(f"{self.name} has changed since it was opened here, and nothing was added; load this page again.")
        with replace_atomically(self.path) as temporary:
            shutil.copymode(self.path, temporary)
            temporary.write_bytes(self._append(rows))

    def _append(self, rows: Sequence[Sequence[str]]) -> bytes:
        """Return the contents of the file with more rows.

        Raises:
            UsageError: The file is in an encoding that lacks a letter of theirs.
        """
        stream = io.StringIO()
        csv.writer(stream, delimiter=self.separator, lineterminator=self.line_end).writerows(rows)
        text = stream.getvalue() if self.is_ended else f"{self.line_end}{stream.getvalue()}"
        try:
            new = text.encode(self.encoding)
        except UnicodeEncodeError as error:
            raise UsageError(
                f"{self.name} is in {self.encoding}, which has no {shown(text[error.start])}; write it in other letters."
            ) from None
        return self.content[: self.insert_at] + new + self.content[self.insert_at :]

    @contextmanager
    def _copy_with(self, content: bytes) -> Iterator[Path]:
        """Yield a folder that reads as the data set would with other contents of this file; the rest are links to it."""
        with TemporaryDirectory(prefix="bowdenfit-") as place:
            copy = Path(place) / "bench" / (self.folder.resolve().name or "data-set")
            link_neighbors(self.folder, copy)
            _link_all(self.folder, copy, PurePosixPath(self.name).parts)
            (copy / self.name).write_bytes(content)
            yield copy


def list_tables(folder: Path) -> list[str]:
    """Return the tables of a data set that lie in its folder, as its description names them; none of one that is refused.

    Args:
        folder: The data set.
    """
    try:
        description = load_description(folder / DESCRIPTION_FILE, faults=Faults())
        stated = description.tables.stated
        sources = [
            Source(kind.name, stated[kind.name], description, folder)
            for kind in KINDS.values()
            if not kind.takes_channels and stated.get(kind.name) is not None
        ]
        paths = [path for source in sources for path in source.files]
    except BowdenfitError:
        return []
    own = folder.resolve()
    inside = [path.relative_to(folder) for path in dict.fromkeys(paths) if path.is_relative_to(folder) and path.is_file()]
    return [path.as_posix() for path in inside if ".." not in path.parts and (folder / path).resolve().is_relative_to(own)]


def open_table(folder: Path, name: str) -> OpenTable:
    """Return a table of a data set, to which rows can be added.

    Args:
        folder: The data set.
        name: Name of the file, as seen from the folder.

    Raises:
        UsageError: The data set has no such table in its folder, or it is not one whose rows are lines below one row of
            headings.
        DatasetError: It cannot be read.
        StoreError: It is a link.
    """
    if name not in list_tables(folder):
        raise UsageError(f"the data set {folder.name} has no table {shown(name)} in its folder; go back to it, and choose one.")
    path = folder / name
    refuse_special(path)
    refuse_link(path)
    if path.suffix.lower() in WORKBOOKS:
        raise UsageError(f"{name} is a workbook; add the rows in the program that wrote it, and save it there.")
    table, content = read_table(path), path.read_bytes()
    encoding, lines = first_lines(content, path.name, whole=True)
    separator = _find_separator(table, lines)
    last_row = table.rows[-1][0].row
    last_line = lines[last_row - 1]
    line_end = next((end for end in ("\r\n", "\n", "\r") if lines[0].text.endswith(end)), "\n")
    insert_at = lines[last_row].start if last_row < len(lines) else len(content)
    rows = tuple(tuple(cell.text for cell in row) for row in table.rows)
    return OpenTable(
        folder, name, content, encoding, separator, table.header, rows, last_row, insert_at, line_end, last_line.ended
    )


def _find_separator(table: RawTable, lines: Sequence[Line]) -> str:
    """Return what stands between the columns of a table, whose headings and last row are a line each.

    Raises:
        UsageError: They are not.
    """
    declared, _ = declared_separator(list(lines), table.file)
    last_row = table.rows[-1]
    for separator in [declared] if declared else SEPARATORS:
        heads, cells = (split_cells(lines[row - 1].text, separator) for row in (table.header_row, last_row[0].row))
        is_heading = [head.strip() for head in heads[: len(table.header)]] == list(table.header)
        if is_heading and [cell.strip() for cell in cells] == [cell.text.strip() for cell in last_row][: len(cells)]:
            return separator
    raise UsageError(
        f"{table.file} is not laid out as one row of headings with a line for each reading below; add the rows with the "
        "program that wrote it."
    )


def _refuse_unread_rows(table: RawTable, before: OpenTable, count: int) -> None:
    """Refuse new rows that are not read as readings, such as one that begins with #.

    Raises:
        DatasetError: One is not.
    """
    read = {row[0].row for row in table.rows}
    first = before.last_row + 1
    if unread := [row for row in range(first, first + count) if row not in read]:
        error = DatasetError(
            f"{before.name}, row {unread[0]}: it is not read as readings but as a remark; fill in its numbers, or clear it."
        )
        error.fault_key, error.row = (before.name, before.headings[0], "unread"), unread[0]
        raise error


def _known_refusals(folder: Path) -> set[str]:
    """Return why a data set is refused as it is; empty where it is not."""
    try:
        check_data_set(folder, {})
    except BowdenfitError as error:
        return {refusal.sentence for refusal in list_refusals(error)}
    return set()


def _link_all(folder: Path, copy: Path, but: tuple[str, ...]) -> None:
    """Link what lies in a folder into a copy of it, but for one path, whose folders are made.

    Args:
        folder: The folder.
        copy: Which has nothing of it yet.
        but: Names along the path that is left out.
    """
    for path in folder.iterdir():
        if path.name != but[0]:
            (copy / path.name).symlink_to(path.resolve())
        elif len(but) > 1:
            (copy / path.name).mkdir()
            _link_all(path, copy / path.name, but[1:])
