"""What `bowdenfit check FILE` says of a table alone: what it is and why, its columns and rows, and the command that fits it."""

import re
from collections.abc import Mapping, Sequence

from bowdenfit.dataset import Dataset
from bowdenfit.files.headings import Quantity, find_candidates, heading_of
from bowdenfit.files.tables import RawTable
from bowdenfit.kinds import iterate_tables
from bowdenfit.kinds.file_kind import FileKind, columns_of_kind
from bowdenfit.kinds.fit_command import FitCommand, list_number_columns
from bowdenfit.questions.check.row_words import describe_first_and_last_rows, describe_row_account
from bowdenfit.words import WIDTH, counted, filled, listed, narrow_table

_LEFT = ("column", "unit", "read as")


def describe_table_file(
    raw: RawTable,
    file: FileKind,
    commands: Sequence[FitCommand],
    data: Dataset | None,
    obstacle: str,
    named: Mapping[str, str],
    usable: bool = True,
) -> str:
    """What a table is, and how to fit it.

    Args:
        raw: The file as read.
        file: What it is taken for.
        commands: What fits it; two where it could be either.
        data: The data set that it makes; None if it makes none yet.
        obstacle: What keeps it from that, in a sentence.
        named: Quantities whose columns the user has named, by heading.
        usable: Whether the command can fit it as it stands.
    """
    title = f"{raw.file}: {_kind_in_words(raw, data)}, because {file.why}."
    if file.other:
        title = f"{raw.file}: a table of readings or a recording; {file.why}."
    lines = [filled(title), "", _column_table(raw, columns_of_kind(file.kind), named)]
    if data is not None:
        lines += ["", *describe_first_and_last_rows(data)]
    lines += ["", *describe_row_account(raw.lines)]
    if data is not None:
        lines += [filled(f"Note: {remark}") for remark in data.measurements.remarks if remark not in raw.lines.remarks]
    if obstacle:
        lines += ["", *map(filled, f"As it stands it cannot be fitted: {obstacle}".splitlines())]
    return "\n".join([*lines, "", *describe_commands(commands, usable)]) + "\n"


def describe_commands(commands: Sequence[FitCommand], usable: bool = True) -> list[str]:
    """The command on a line of its own, so that it can be pasted, and what it takes for granted.

    Args:
        commands: What fits a file; two where it could be either of two kinds.
        usable: Whether it can be fitted as it stands.
    """
    lines, when = list[str](), "" if usable else " once that is mended"
    for what, command in zip(("a table", "a recording") if len(commands) > 1 else ("",), commands, strict=True):
        lines += [f"To fit it{f' as {what}' if what else ''}{when}:", wrap_command(command.text)]
        granted = listed([f"that {each}" for each in command.provided])
        lines += [filled(f"This takes for granted {granted}; change what is not so.")] if granted else []
    return lines


def wrap_command(command: str) -> str:
    """A command that can be pasted, in lines that fit into a terminal where its options let it."""
    lines = ["  "]
    for i, part in enumerate(re.split(r" (?=--)", command)):
        if i and len(lines[-1]) + len(part) + 3 > WIDTH:
            lines[-1] += " \\"
            lines.append(f"    {part}")
        else:
            lines[-1] += f" {part}" if i else part
    return "\n".join(lines)


def _kind_in_words(raw: RawTable, data: Dataset | None) -> str:
    for kind, table in iterate_tables(data.measurements) if data else ():
        return kind.describe_single_file(table)
    return f"a table of {counted(len(raw.rows), 'row')}"


def _column_table(raw: RawTable, wanted: tuple[Quantity, ...], named: Mapping[str, str]) -> str:
    """Every column: its unit, what it is read as, and its range."""
    can_be = find_candidates(list(zip(raw.header, raw.units, strict=True)), wanted, tuple(named.values()))
    read_as = dict(named)
    for quantity, columns in can_be.items():
        for candidate in columns:
            read_as[raw.header[candidate.position]] = quantity if len(columns) == 1 else f"{quantity}?"
    numbers = {candidate.name: candidate for candidate in list_number_columns(raw)}
    rows = []
    for heading, below in zip(raw.header, raw.units, strict=True):
        if heading:
            column = numbers.get(heading)
            spread = [f"{column.low:.5g}", f"{column.high:.5g}"] if column else ["", ""]
            rows.append([heading, heading_of(heading, below).unit or "-", read_as.get(heading, "-"), *spread])
    return narrow_table(["column", "unit", "read as", "lowest", "highest"], rows, left=_LEFT)
