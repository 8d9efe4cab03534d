"""Write a cable.toml for measured files: take what they say, ask for what they do not say.

Keys come in the order in which a person would write them.
"""

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from bowdenfit.description import SCHEMA
from bowdenfit.description.toml_text import format_toml
from bowdenfit.errors import DatasetError, Faults
from bowdenfit.kinds import KINDS
from bowdenfit.kinds.file_kind import find_stated_angle
from bowdenfit.kinds.kind import Kind
from bowdenfit.questions.start.cable_layout import CableLayout, find_layout
from bowdenfit.questions.start.measured_file import (
    MeasuredFile,
    inspect_file,
    inspect_recording,
    name_channels,
    name_columns,
)
from bowdenfit.questions.start.question import (
    Asker,
    cable_name_question,
    choice_question,
    number_question,
    quantity_question,
    text_question,
)
from bowdenfit.reading import Reading, read
from bowdenfit.recordings.named_channels import parse_channels
from bowdenfit.words import listed, shown

_REMARKS = {
    "schema": "Written by `bowdenfit init` from the files next to it; `bowdenfit check` says how it is understood.",
    "route": "What the design question varies, and where the curves of the wrap angles hold.",
    "contact": "One [[contact]] for each place where the rope rubs; contacts may share a coefficient.",
}


def write_description(paths: Sequence[Path], default_name: str, asker: Asker) -> str:
    """Write the text of a cable.toml for some files.

    Args:
        paths: The files, which are to lie beside it.
        default_name: Name of the cable if nobody states one.
        asker: Whom to ask what the files do not say.

    Raises:
        DatasetError: A file cannot be read, or holds nothing that can be used.
    """
    return describe_measured_files(inspect_files(paths, asker), default_name, asker)


def describe_measured_files(measured_files: Sequence[MeasuredFile], default_name: str, asker: Asker) -> str:
    """Write the text of a cable.toml for files that were inspected; their columns are assigned on the way.

    Args:
        measured_files: See `inspect_files`.
        default_name: Name of the cable if nobody states one.
        asker: Whom to ask what the files do not say.

    Raises:
        DatasetError: A file holds nothing that can be used.
    """
    name = asker.ask(cable_name_question("What is the cable called?", default_name))
    source = asker.ask(text_question("Who measured it, when, on which bench? (- to leave it out)", "-"))
    faults = Faults()
    for file in measured_files:
        with faults.collect():
            if file.kind and file.kind.takes_channels:
                name_channels(file, asker)
            else:
                name_columns(file, asker)
    faults.refuse()
    asker.settle()
    layout = find_layout(measured_files, asker)
    asker.settle()
    recordings = _recording_entries(
        [file for file in measured_files if file.kind and file.kind.takes_channels], layout, asker
    )
    asker.settle()
    page: dict[str, Any] = {"schema": SCHEMA, "name": name} | ({} if source == "-" else {"source": source})
    for file in measured_files:
        assert file.kind is not None and file.kind.init_questions is not None  # asked for above
        page |= file.kind.init_questions.description
    page |= {"route": layout.route} if layout.route else {}
    page |= {"contact": layout.contacts, "tables": _table_entries(measured_files)}
    return format_toml(page | ({"recording": recordings} if recordings else {}), _REMARKS)


def describe_as_read(path: Path, reading: Reading) -> str:
    """Write the text of a cable.toml for one file that is described by the options of `fit`.

    Args:
        path: The file, which is to lie beside it.
        reading: The options.

    Raises:
        BowdenfitError: The file cannot be read with them.
    """
    page = read(path, **reading).description.model_dump(mode="json", exclude_defaults=True, by_alias=True)
    if channels := parse_channels(reading.get("channels", ())):
        sources = {quantity: source.model_dump(mode="json", exclude_defaults=True) for quantity, source in channels.items()}
        recordings = {key: value for key, value in page["tables"].pop("recordings").items() if key not in ("files", "sheet")}
        page["tables"] |= {"recordings": recordings} if recordings else {}
        sheet = {"sheet": reading["sheet"]} if reading.get("sheet") else {}
        page["recording"] = [{"file": path.name, **sheet, "channels": sources}]
    if not page["tables"]:
        page.pop("tables")
    return format_toml({"schema": SCHEMA, **page}, _REMARKS)


def inspect_files(paths: Sequence[Path], asker: Asker) -> list[MeasuredFile]:
    """Inspect every file; ask for its kind where it does not say it.

    Args:
        paths: The files.
        asker: Whom to ask.

    Raises:
        DatasetError: A file cannot be read, or two hold what only one can.
    """
    faults, measured_files = Faults(), list[MeasuredFile]()
    for path in paths:
        with faults.collect():
            sheets, remarks = inspect_file(path)
            for remark in remarks:
                asker.report(remark)
            for file in [sheet if sheet.kind else _ask_kind(sheet, asker) for sheet in sheets]:
                assert file.kind is not None and file.kind.init_questions is not None
                asker.say(f"{file.name} holds {file.kind.init_questions.holds}.")
                measured_files.append(file)
    asker.settle()
    for kind in {file.kind.name: file.kind for file in measured_files if file.kind}.values():
        files = [file.name for file in measured_files if file.kind is kind]
        with faults.collect():
            questions = kind.init_questions
            if len(files) > 1 and questions is not None and not questions.several:
                raise DatasetError(
                    f"{listed(files)} both hold {questions.holds}; put them into one file, below one line of headings."
                )
    faults.refuse()
    return measured_files


def _ask_kind(file: MeasuredFile, asker: Asker) -> MeasuredFile:
    """Return a file with its kind, as answered."""
    options: list[tuple[str, Kind[Any]]] = [
        (kind.init_questions.holds, kind) for kind in KINDS.values() if kind.init_questions is not None
    ]
    default = [kind for _, kind in options].index(file.likely) + 1 if file.likely else None
    columns = listed([column.words for column in file.columns])
    reason = (
        f"{file.name} does not say what it holds; name its columns for it, such as input_force_N and output_force_N, "
        "efficiency_percent, or cable_length_mm next to wrap angles in deg; or run this in a terminal, which asks."
    )
    kind = asker.ask(
        choice_question(f"{file.name} has the columns {columns}. What does it hold?", options, default, reason)
    )
    if kind.takes_channels:
        return inspect_recording(file.path, "its user says so", file.sheet)
    file.kind = kind
    return file


def _table_entries(measured_files: Sequence[MeasuredFile]) -> dict[str, Any]:
    """Return [tables]: the files of every kind, with the columns that must be named."""
    tables: dict[str, Any] = {}
    for kind in {file.kind.name: file.kind for file in measured_files if file.kind}.values():
        group = [file for file in measured_files if file.kind is kind]
        if kind.takes_channels:
            tables[kind.name] = {}
            continue
        columns_by_file = [_named_sources(file) for file in group]
        settings: dict[str, object] = {}
        for file in group:
            settings |= file.settings
        if any(columns != columns_by_file[0] for columns in columns_by_file):
            raise DatasetError(_describe_other_headings(group))
        place = _files_and_sheets(group)
        tables[kind.name] = {**place, **settings, **({"columns": columns_by_file[0]} if columns_by_file[0] else {})}
    return tables


def _describe_other_headings(group: Sequence[MeasuredFile]) -> str:
    """Say which columns of tables that belong together have other headings."""
    differing = [
        name
        for name in dict.fromkeys(name for file in group for name in file.assigned)
        if len({_named_sources(file).get(name, {}).get("name") for file in group}) > 1
    ]
    clauses = []
    for name in differing:
        by_heading: dict[str, list[str]] = {}
        for file in group:
            by_heading.setdefault(file.assigned.get(name, ""), []).append(file.name)
        places = [f"{shown(heading) if heading else 'no column'} in {listed(files)}" for heading, files in by_heading.items()]
        clauses.append(f"{name} is {'; '.join(places)}")
    files = listed([file.name for file in group])
    which = f": {'. '.join(clauses)}" if clauses else ""
    return (
        f"the columns of {files} are not called alike{which}. The usual cause is a heading that somebody typed again; give "
        "these columns the same heading in all files, or leave a file out and fit it by itself."
    )


def _files_and_sheets(group: Sequence[MeasuredFile]) -> dict[str, Any]:
    """Return the keys of [tables] that name the files of a kind, and their sheets.

    Raises:
        DatasetError: Sheets of several workbooks have different titles.
    """
    files = list(dict.fromkeys(file.path.name for file in group))
    sheets = list(dict.fromkeys(file.sheet for file in group if file.sheet))
    on_sheets = [file for file in group if file.sheet]
    if len({file.path.name for file in on_sheets}) * len(sheets) != len(on_sheets):
        raise DatasetError(
            f"the sheets of {listed([file.name for file in group])} have different titles; give them the same, or leave a "
            "file out."
        )
    entries: dict[str, Any] = {"files": files} if len(files) > 1 else {"file": files[0]}
    return entries | ({"sheet": sheets[0] if len(sheets) == 1 else sheets} if sheets else {})


def _named_sources(file: MeasuredFile) -> dict[str, Any]:
    """Return the columns or channels that the description must name, as plain data."""
    return {name: source.model_dump(exclude_none=True) for name, source in file.sources.items()}


def _recording_entries(
    measured_files: Sequence[MeasuredFile], layout: CableLayout, asker: Asker
) -> list[dict[str, Any]]:
    """Return every [[recording]]: its file, where it was made, and what its channels are called."""
    entries = []
    angles = [contact["wrap_angle"]["column"] for contact in layout.contacts if "column" in contact["wrap_angle"]]
    for file in measured_files:
        entry: dict[str, Any] = {"file": file.path.name} | ({"sheet": file.sheet} if file.sheet else {})
        if layout.route:
            entry["at"] = _ask_length(file, layout, asker)
        for name in [] if layout.route else angles:
            stated = find_stated_angle(file.path)
            reason = (
                f"{file.name} does not say its wrap angle; write it into the name of the file, such as run1_90deg.csv."
            )
            words = f"What was the wrap angle of {file.name}, with its unit?"
            if stated:
                reason = f"{file.name}: {stated[0]} is what {stated[1]} says; confirm it, or write the right one."
            value, unit = asker.ask(quantity_question(words, "angle", "90 deg", reason, stated[0] if stated else None))
            entry.setdefault("wrap_angles", {})[name] = {"value": value, "unit": unit}
        channels = _named_sources(file)
        entries.append(entry | ({"channels": channels} if channels else {}))
    return entries


def _ask_length(file: MeasuredFile, layout: CableLayout, asker: Asker) -> float:
    """Ask for the length at which a recording was made; proposed where the name of its file has it."""
    unit = layout.route["unit"]
    named = re.findall(rf"(?<![\d.])(\d+(?:[.,]\d+)?)[\s_-]?{re.escape(unit)}(?![a-z])", file.path.stem)
    reason = (
        f"{file.name} does not say at which length it was recorded; write it into the name of the file, such as "
        f"run1_470{unit}.csv."
    )
    words = f"At which length, in {unit}, was {file.name} recorded?"
    proposed = named[0].replace(",", ".") if len(named) == 1 else None
    return asker.ask(number_question(words, proposed, "" if proposed else reason, "470"))
