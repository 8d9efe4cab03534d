"""The data sets of a fleet: read one by one, so that a broken one is named and the rest goes on."""

import hashlib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from glob import escape
from pathlib import Path
from typing import Any

from bowdenfit.arguments import LARGEST_SEED
from bowdenfit.dataset import DESCRIPTION_FILE, Dataset, read_dataset
from bowdenfit.description import Description
from bowdenfit.errors import DatasetError, DescriptionError, StoreError
from bowdenfit.files.naming import parse_sources
from bowdenfit.inference.batch.pieces import ShapedDataset, input_hash, shape_dataset
from bowdenfit.inputs import refuse_special
from bowdenfit.kinds.descriptions import load_description
from bowdenfit.questions.fleet.answer import FailedInspection
from bowdenfit.questions.fleet.inspections import Inspection
from bowdenfit.reading import Reading, changed_settings, read
from bowdenfit.results.fleet_folder import FLEET_DESCRIPTION


@dataclass(frozen=True)
class Case:
    """An inspection that can be fitted.

    Args:
        inspection: Which.
        dataset: What was measured.
        shaped: The same as one of many that a program serves.
        hash: Of the input.
    """

    inspection: Inspection
    dataset: Dataset
    shaped: ShapedDataset
    hash: str

    def seed(self, fleet_seed: int) -> int:
        """Its own seed: by what was measured, not by its place.

        Args:
            of_fleet: Seed of everything random.
        """
        digest = hashlib.sha256(f"{fleet_seed} {self.hash}".encode()).digest()
        return int.from_bytes(digest[:8], "big") % LARGEST_SEED


def read_cases(folder: Path, inspections: Iterable[Inspection], reading: Reading) -> Iterator[Case | FailedInspection]:
    """Every inspection, or why it cannot be fitted.

    Args:
        folder: Of the fleet.
        inspections: Of it.
        reading: Keywords of `bowdenfit.read`.

    Raises:
        DescriptionError: The description that holds for all tables of fleet.csv is missing or wrong.
    """
    descriptions: dict[Path, Description] = {}
    seen: dict[str, str] = {}
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
        if case.hash in seen:
            yield FailedInspection(inspection.label, _duplicate_message(inspection.label, seen[case.hash]))
            continue
        seen[case.hash] = inspection.label
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
    tables = description.tables.stated
    if len(tables) != 1 or not hasattr(next(iter(tables.values())), "files"):
        raise DescriptionError(
            f"{path.name} describes {len(tables)} tables, and fleet.csv names one file an inspection; leave one under "
            f"[tables], or let fleet.csv name folders, each with its tables and a {DESCRIPTION_FILE}."
        )
    return description


def _read_table_dataset(path: Path, description: Description, folder: Path) -> Dataset:
    """The data set of one table under the description of all."""
    (kind, settings), *_ = description.tables.stated.items()
    named: dict[str, Any] = {"file": None, "files": None} | {_file_key(settings): escape(_relative_to(path, folder))}
    known = {name: value for name, value in named.items() if name in type(settings).model_fields}
    tables = description.tables.model_copy(update={kind: settings.model_copy(update=known)})
    return read_dataset(description.model_copy(update={"tables": tables}), folder, {})


def _relative_to(path: Path, folder: Path) -> str:
    return str(path.relative_to(folder) if path.is_relative_to(folder) else path)


def _file_key(settings: Any) -> str:
    """Under which key a table's file stands."""
    return "file" if "file" in type(settings).model_fields else "files"


def _duplicate_message(label: str, other: str) -> str:
    return (
        f"{label} has the readings of {other} to the last digit; the usual cause is a file that was copied or is named twice: "
        "name the right file, or delete the row."
    )


def refuse_if_none_usable(cases: list[Case], failed: list[FailedInspection]) -> None:
    """Refuse a fleet of which nothing can be fitted.

    Raises:
        DatasetError: What is wrong with the first.
    """
    if not cases:
        first = failed[0]
        raise DatasetError(f"none of {len(failed)} inspections can be fitted. {first.inspection}: {first.why}")
