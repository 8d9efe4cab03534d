"""Inspections of a fleet, listed in fleet.csv or by folder names, and their data sets; one that cannot be read is reported."""

import hashlib
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from glob import escape
from pathlib import Path
from typing import Any

from bowdenfit import route_angles
from bowdenfit.addons.fleet.answer import FailedInspection
from bowdenfit.addons.fleet.folder import COLUMNS, FLEET_DESCRIPTION, FLEET_TABLE
from bowdenfit.addons.fleet.pieces import input_hash
from bowdenfit.arguments import LARGEST_SEED
from bowdenfit.dataset import DESCRIPTION_FILE, Dataset, read_dataset
from bowdenfit.description import Description
from bowdenfit.errors import DatasetError, DescriptionError, StoreError, UsageError
from bowdenfit.files.cells import Cell
from bowdenfit.files.columns import Column, Quantity, find_columns, require_column
from bowdenfit.files.headings import parse_sources
from bowdenfit.files.tables import RawTable, read_table
from bowdenfit.inference.batch.shaped_data import ShapedDataset, shape_dataset
from bowdenfit.inputs import refuse_special
from bowdenfit.kinds.descriptions import load_description
from bowdenfit.reading import Reading, changed_settings, read
from bowdenfit.words import few, shown

_TEMPERATURES = {"temperature_degC": 0.0, "temperature_C": 0.0, "temperature_K": -273.15}  # what each adds to be in °C
_COLDEST, _HOTTEST = -100.0, 400.0  # degC, beyond which a temperature is a slip of unit; a judgement
_YES, _NO = {"yes", "y", "true", "1"}, {"no", "n", "false", "0"}
UNKNOWN = math.nan


@dataclass(frozen=True)
class Inspection:
    """One inspection of one cable.

    Args:
        cable: Name of the cable.
        cycles: That it had made; NaN where nobody says.
        temperature: [°C]; NaN where nobody says.
        lubricated: 1 if it was, 0 if not; NaN where nobody says.
        path: Folder with a cable.toml, or a table that the description of the fleet holds for.
    """

    cable: str
    cycles: float
    temperature: float
    lubricated: float
    path: Path

    @property
    def label(self) -> str:
        """The cable, and after how many cycles."""
        return self.cable if math.isnan(self.cycles) else f"{self.cable} after {self.cycles:.15g} cycles"


def read_inspections(folder: Path) -> list[Inspection]:
    """List all inspections in a folder, in the order of cables and cycles.

    Args:
        folder: With fleet.csv, or with a folder for each cable; in that either its cable.toml, or one folder for each
            inspection that is called by the number of cycles.

    Raises:
        DatasetError: There are none; or a cable stands there twice with the same cycles, or inspections in fleet.csv run
            backwards.
        UsageError: There is no such folder.
    """
    refuse_special(folder)
    if not folder.is_dir():
        raise UsageError(f"{folder} is not a folder; name the one with {FLEET_TABLE}, or with a folder for each cable.")
    table = folder / FLEET_TABLE
    inspections = _read_inspection_table(table) if table.exists() else _list_inspections(folder)
    order = {cable: i for i, cable in enumerate(sorted({inspection.cable for inspection in inspections}))}
    return sorted(
        inspections,
        key=lambda inspection: (order[inspection.cable], -1.0 if math.isnan(inspection.cycles) else inspection.cycles),
    )


def _list_inspections(folder: Path) -> list[Inspection]:
    """List inspections by the names of folders."""
    inspections = list[Inspection]()
    for cable in sorted(path for path in folder.iterdir() if path.is_dir()):
        if (cable / DESCRIPTION_FILE).is_file():
            inspections.append(Inspection(cable.name, UNKNOWN, UNKNOWN, UNKNOWN, cable))
            continue
        paths = sorted(path for path in cable.iterdir() if (path / DESCRIPTION_FILE).is_file())
        inspections += [Inspection(cable.name, _parse_folder_name(path), UNKNOWN, UNKNOWN, path) for path in paths]
    if not inspections:
        raise DatasetError(
            f"{folder} holds no fleet: write {FLEET_TABLE} with the columns {', '.join(COLUMNS)}, or a folder with "
            f"{DESCRIPTION_FILE} and tables for each cable."
        )
    _refuse_duplicates([(inspection, str(inspection.path)) for inspection in inspections])
    return inspections


def _parse_folder_name(path: Path) -> float:
    try:
        cycles = float(path.name)
    except ValueError:
        cycles = UNKNOWN
    if not (math.isfinite(cycles) and cycles >= 0):
        raise DatasetError(
            f"{path} is not a number of cycles, which the folder of an inspection is called by, such as "
            f"{path.parent.name}/25000; rename it, or write {FLEET_TABLE}."
        )
    return cycles


def _read_inspection_table(path: Path) -> list[Inspection]:
    """Read the inspections listed in fleet.csv."""
    table = read_table(path)
    texts = ("cable", "file", "lubricated", *_TEMPERATURES)
    columns = find_columns(table, (*(Quantity(name, "text") for name in texts), Quantity("cycles", "ratio")))
    cables = [
        cell.text.strip()
        for cell in require_column(table, columns, "cable", "cable").read_cells(_require_text, _make_blank_cell(table))
    ]
    files = [
        cell.text.strip()
        for cell in require_column(table, columns, "file", "file").read_cells(_require_text, _make_blank_cell(table))
    ]
    unknown = [UNKNOWN] * len(table.rows)
    cycles = columns["cycles"].read_cells(_parse_cycles, UNKNOWN) if "cycles" in columns else unknown
    lubricated = columns["lubricated"].read_cells(_parse_flag, UNKNOWN) if "lubricated" in columns else unknown
    temperature = _parse_temperatures(table, columns) or unknown
    table.faults.refuse()
    rows = [row[0].row for row in table.rows]
    paths = [path.parent / file for file in files]
    inspections = list(map(Inspection, cables, cycles, temperature, lubricated, paths))
    numbered = list(zip(inspections, [f"{path.name}, row {row}" for row in rows], strict=True))
    _refuse_duplicates(numbered)
    _refuse_decreasing_cycles(numbered)
    if not inspections:
        raise DatasetError(f"{path.name} has no row; write one for each inspection.")
    return inspections


def _make_blank_cell(table: RawTable) -> Cell:
    return Cell(table.file, table.header_row, "", "")


def _require_text(cell: Cell) -> Cell:
    if cell.blank or "\0" in cell.text:
        raise cell.refuse("the cell is blank; every inspection has a cable and a file.")
    return cell


def _parse_cycles(cell: Cell) -> float:
    value = UNKNOWN if cell.blank else cell.number()
    if value < 0:
        raise cell.refuse(f"{cell.shown} cycles cannot be; write how many the cable had made, 0 when it was new.")
    return value


def _parse_flag(cell: Cell) -> float:
    answer = cell.text.strip().lower()
    if cell.blank or answer in _YES | _NO:
        return UNKNOWN if cell.blank else float(answer in _YES)
    raise cell.refuse(f"{cell.shown} does not say whether the cable was lubricated; write yes or no.")


def _parse_temperatures(table: RawTable, columns: dict[str, Column]) -> list[float]:
    """Return temperatures [°C]; empty without a column."""
    headings = [name for name in _TEMPERATURES if name in columns]
    bare = [heading for heading in table.header if heading.strip().lower() in {"temperature", "temp"}]
    if bare or len(headings) > 1:
        named = ", ".join(map(shown, bare or headings))
        raise DatasetError(
            f"{table.file}: {named} must be one column that says its unit; call it temperature_degC or temperature_K."
        )

    def read(cell: Cell) -> float:
        value = UNKNOWN if cell.blank else cell.number() + _TEMPERATURES[headings[0]]
        if value < _COLDEST or value > _HOTTEST:
            raise cell.refuse(f"{cell.shown} is not a temperature at which a cable is inspected; correct it, or its unit.")
        return value

    return columns[headings[0]].read_cells(read, UNKNOWN) if headings else []


def _refuse_duplicates(numbered: Sequence[tuple[Inspection, str]]) -> None:
    """Refuse two inspections of a cable at the same number of cycles, of which one would count as two."""
    seen: dict[str, str] = {}
    for inspection, where in numbered:
        if inspection.label in seen:
            missing = "" if math.isfinite(inspection.cycles) else " without a number of cycles"
            raise DatasetError(
                f"{inspection.label} appears twice{missing}: {seen[inspection.label]} and {where}. The usual cause is a row "
                "that was copied; delete one, correct the cycles, or put the readings of both into one table."
            )
        seen[inspection.label] = where


def _refuse_decreasing_cycles(numbered: Sequence[tuple[Inspection, str]]) -> None:
    """Refuse cycles that decrease between inspections of a cable, which stand in chronological order."""
    last: dict[str, tuple[float, str]] = {}
    wrong = list[str]()
    for inspection, where in numbered:
        before, previous = last.get(inspection.cable, (-1.0, ""))
        if inspection.cycles < before:
            wrong.append(
                f"{where} ({inspection.cable}: {inspection.cycles:.15g} after {before:.15g} in {previous.split(', ')[-1]})"
            )
        if not math.isnan(inspection.cycles):
            last[inspection.cable] = inspection.cycles, where
    if wrong:
        raise DatasetError(
            f"cycles run backwards: {few(wrong)}. The usual cause is a wrong number, or a counter that was set to 0; write the "
            "cycles that the cable had made in all, and the rows of a cable in the order of its inspections."
        )


@dataclass(frozen=True)
class Case:
    """An inspection that can be fitted.

    Args:
        inspection: Which.
        dataset: Data set with its measurements.
        shaped: The same as one of many that a program serves.
        hash: Hash of the input.
    """

    inspection: Inspection
    dataset: Dataset
    shaped: ShapedDataset
    hash: str

    def seed(self, fleet_seed: int) -> int:
        """Return the seed of this case, which depends on what was measured and not on its order.

        Args:
            fleet_seed: Random seed.
        """
        digest = hashlib.sha256(f"{fleet_seed} {self.hash}".encode()).digest()
        return int.from_bytes(digest[:8], "big") % LARGEST_SEED


def read_cases(folder: Path, inspections: Iterable[Inspection], reading: Reading) -> Iterator[Case | FailedInspection]:
    """Read the data set of every inspection, or why it cannot be fitted.

    Args:
        folder: Folder of the fleet.
        inspections: Inspections of it.
        reading: Keywords of `bowdenfit.read`.

    Raises:
        DescriptionError: The description that holds for all tables of fleet.csv is missing or wrong.
    """
    descriptions: dict[Path, Description] = {}
    first_labels: dict[str, str] = {}
    for inspection in inspections:
        try:
            refuse_special(inspection.path)
        except DatasetError as error:
            yield FailedInspection(inspection.label, str(error))
            continue
        if not inspection.path.is_dir() and folder not in descriptions:
            descriptions[folder] = _read_common_description(folder, reading)
        try:
            if inspection.path.is_dir():
                dataset = read(inspection.path, **reading)
            else:
                dataset = _read_table_dataset(inspection.path, descriptions[folder], folder)
            case = Case(inspection, dataset, shape_dataset(dataset), input_hash(dataset))
        except (DatasetError, DescriptionError, StoreError) as error:
            yield FailedInspection(inspection.label, str(error))
            continue
        if case.hash in first_labels:
            yield FailedInspection(inspection.label, _describe_duplicate(inspection.label, first_labels[case.hash]))
            continue
        first_labels[case.hash] = inspection.label
        yield case


def _read_common_description(folder: Path, reading: Reading) -> Description:
    path = folder / FLEET_DESCRIPTION
    if not path.is_file():
        raise DescriptionError(
            f"{path} does not exist; it describes the cables whose tables fleet.csv names, as a {DESCRIPTION_FILE} does. Write "
            "it, or let fleet.csv name folders that have their own."
        )
    description = load_description(
        path, changed_settings(reading), parse_sources(reading.get("columns", ()), "--column")
    )
    if description.has_routes:
        description, _, _ = route_angles.measure_routes(description, folder)
    tables = description.tables.stated
    if len(tables) != 1 or not hasattr(next(iter(tables.values())), "files"):
        raise DescriptionError(
            f"{path.name} describes {len(tables)} tables, and fleet.csv names one file an inspection; leave one under "
            f"[tables], or let fleet.csv name folders, each with its tables and a {DESCRIPTION_FILE}."
        )
    return description


def _read_table_dataset(path: Path, description: Description, folder: Path) -> Dataset:
    """Read one table under the common description."""
    (kind, settings), *_ = description.tables.stated.items()
    named: dict[str, Any] = {"file": None, "files": None} | {_choose_file_key(settings): escape(_shorten_path(path, folder))}
    known = {name: value for name, value in named.items() if name in type(settings).model_fields}
    tables = description.tables.model_copy(update={kind: settings.model_copy(update=known)})
    return read_dataset(description.model_copy(update={"tables": tables}), folder, {})


def _shorten_path(path: Path, folder: Path) -> str:
    return str(path.relative_to(folder) if path.is_relative_to(folder) else path)


def _choose_file_key(settings: Any) -> str:
    """Return the key under which a table's file stands."""
    return "file" if "file" in type(settings).model_fields else "files"


def _describe_duplicate(label: str, other: str) -> str:
    return (
        f"{label} has the readings of {other} to the last digit; the usual cause is a file that was copied or is named twice: "
        "name the right file, or delete the row."
    )


def refuse_if_none_usable(cases: list[Case], failed: list[FailedInspection]) -> None:
    """Refuse a fleet without any inspection that can be fitted.

    Raises:
        DatasetError: What is wrong with the first.
    """
    if not cases:
        first = failed[0]
        raise DatasetError(f"none of {len(failed)} inspections can be fitted. {first.inspection}: {first.why}")
