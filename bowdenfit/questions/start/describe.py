"""Write a description from files: take what they say, ask for what they do not say."""

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from bowdenfit.description import SCHEMA
from bowdenfit.errors import DatasetError, Faults
from bowdenfit.kinds import KINDS
from bowdenfit.kinds.file_kind import stated_angle
from bowdenfit.kinds.kind import Kind
from bowdenfit.questions.start.columns import name_channels, name_columns
from bowdenfit.questions.start.names import ask_cable_name
from bowdenfit.questions.start.page import toml_text
from bowdenfit.questions.start.places import CableLayout, find_layout
from bowdenfit.questions.start.question import Asker, choose, number, quantity, text
from bowdenfit.questions.start.sheet import MeasuredFile, inspect_file, inspect_recording
from bowdenfit.words import listed

_REMARKS = {
    "schema": "Written by `bowdenfit init` from the files beside it; `bowdenfit check` says how it is understood.",
    "route": "What the design question varies, and where the curves of the wrap angles hold.",
    "contact": "One [[contact]] for each place where the rope rubs; contacts may share a coefficient.",
}


def write_description(paths: Sequence[Path], default_name: str, ask: Asker) -> str:
    """Write the text of a cable.toml for some files.

    Args:
        paths: The files, which are to lie beside it.
        default_name: Name of the cable if nobody states one.
        ask: Whom to ask what the files do not say.

    Raises:
        DatasetError: A file cannot be read, or holds nothing that can be used.
    """
    sheets = _inspect_files(paths, ask)
    name = ask.ask(ask_cable_name("What is the cable called?", default_name))
    source = ask.ask(text("Who measured it, when, on which bench? (- to leave it out)", "-"))
    faults = Faults()
    for sheet in sheets:
        with faults.collect():
            if sheet.kind and sheet.kind.takes_channels:
                name_channels(sheet, ask)
            else:
                name_columns(sheet, ask)
    faults.refuse()
    ask.settle()
    layout = find_layout(sheets, ask)
    ask.settle()
    recordings = _recording_entries([each for each in sheets if each.kind and each.kind.takes_channels], layout, ask)
    ask.settle()
    page: dict[str, Any] = {"schema": SCHEMA, "name": name} | ({} if source == "-" else {"source": source})
    for sheet in sheets:
        assert sheet.kind is not None and sheet.kind.init_questions is not None  # asked for above
        page |= sheet.kind.init_questions.description
    page |= {"route": layout.route} if layout.route else {}
    page |= {"contact": layout.contacts, "tables": _table_entries(sheets)}
    return toml_text(page | ({"recording": recordings} if recordings else {}), _REMARKS)


def _inspect_files(paths: Sequence[Path], ask: Asker) -> list[MeasuredFile]:
    """What each file is; asked where it does not say."""
    faults, sheets = Faults(), list[MeasuredFile]()
    for path in paths:
        with faults.collect():
            sheet = inspect_file(path)
            if sheet.kind is None:
                sheet = _ask_kind(sheet, ask)
            assert sheet.kind is not None and sheet.kind.init_questions is not None
            ask.say(f"{sheet.file} holds {sheet.kind.init_questions.holds}.")
            sheets.append(sheet)
    ask.settle()
    for kind in {sheet.kind.name: sheet.kind for sheet in sheets if sheet.kind}.values():
        files = [sheet.file for sheet in sheets if sheet.kind is kind]
        with faults.collect():
            questions = kind.init_questions
            if len(files) > 1 and questions is not None and not questions.several:
                raise DatasetError(
                    f"{listed(files)} both hold {questions.holds}; put them into one file, below one line of headings."
                )
    faults.refuse()
    return sheets


def _ask_kind(sheet: MeasuredFile, ask: Asker) -> MeasuredFile:
    """Ask what a file holds."""
    options: list[tuple[str, Kind[Any]]] = [
        (kind.init_questions.holds, kind) for kind in KINDS.values() if kind.init_questions is not None
    ]
    default = [kind for _, kind in options].index(sheet.likely) + 1 if sheet.likely else None
    columns = listed([each.words for each in sheet.columns])
    why = (
        f"{sheet.file} does not say what it holds; name its columns for it, such as input_force_N and output_force_N, "
        "efficiency_percent, or cable_length_mm beside wrap angles in deg; or run this in a terminal, which asks."
    )
    kind = ask.ask(choose(f"{sheet.file} has the columns {columns}. What does it hold?", options, default, why))
    if kind.takes_channels:
        return inspect_recording(sheet.path, "its user says so")
    sheet.kind = kind
    return sheet


def _table_entries(sheets: Sequence[MeasuredFile]) -> dict[str, Any]:
    """[tables]: the files of each kind, with the columns that must be named."""
    tables: dict[str, Any] = {}
    for kind in {sheet.kind.name: sheet.kind for sheet in sheets if sheet.kind}.values():
        group = [sheet for sheet in sheets if sheet.kind is kind]
        if kind.takes_channels:
            tables[kind.name] = {}
            continue
        columns_by_file = [_named_sources(file) for file in group]
        settings: dict[str, object] = {}
        for file in group:
            settings |= file.settings
        if any(columns != columns_by_file[0] for columns in columns_by_file):
            raise DatasetError(
                f"the columns of {listed([file.file for file in group])} are not called alike; give them the same headings, or "
                "put them into one file."
            )
        files = [file.file for file in group]
        where: dict[str, Any] = {"files": files} if len(files) > 1 else {"file": files[0]}
        tables[kind.name] = {**where, **settings, **({"columns": columns_by_file[0]} if columns_by_file[0] else {})}
    return tables


def _named_sources(sheet: MeasuredFile) -> dict[str, Any]:
    """The columns or channels that the description must name."""
    return {name: source.model_dump(exclude_none=True) for name, source in sheet.sources.items()}


def _recording_entries(sheets: Sequence[MeasuredFile], layout: CableLayout, ask: Asker) -> list[dict[str, Any]]:
    """Every [[recording]]: its file, where it was made, and what its channels are called."""
    entries = []
    angles = [each["wrap_angle"]["column"] for each in layout.contacts if "column" in each["wrap_angle"]]
    for sheet in sheets:
        entry: dict[str, Any] = {"file": sheet.file}
        if layout.route:
            entry["at"] = _ask_length(sheet, layout, ask)
        for name in [] if layout.route else angles:
            stated = stated_angle(sheet.path)
            why = (
                f"{sheet.file} does not say its wrap angle; write it into the name of the file, such as run1_90deg.csv."
            )
            words = f"What was the wrap angle of {sheet.file}, with its unit?"
            value, unit = ask.ask(quantity(words, "angle", "90 deg", why, stated[0] if stated else None))
            entry.setdefault("wrap_angles", {})[name] = {"value": value, "unit": unit}
        channels = _named_sources(sheet)
        entries.append(entry | ({"channels": channels} if channels else {}))
    return entries


def _ask_length(sheet: MeasuredFile, layout: CableLayout, ask: Asker) -> float:
    """The length at which a recording was made; proposed where the name of its file has it."""
    unit = layout.route["unit"]
    named = re.findall(rf"(?<![\d.])(\d+(?:[.,]\d+)?)[\s_-]?{re.escape(unit)}(?![a-z])", sheet.path.stem)
    why = (
        f"{sheet.file} does not say at which length it was recorded; write it into the name of the file, such as "
        f"run1_470{unit}.csv."
    )
    words = f"At which length, in {unit}, was {sheet.file} recorded?"
    proposed = named[0].replace(",", ".") if len(named) == 1 else None
    return ask.ask(number(words, proposed, "" if proposed else why, "470"))
