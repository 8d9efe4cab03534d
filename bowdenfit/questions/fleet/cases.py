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
from bowdenfit.kinds.settings import load_description
from bowdenfit.questions.fleet.answer import Broken
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

    def seed(self, of_fleet: int) -> int:
        """Its own seed: by what was measured, not by its place.

        Args:
            of_fleet: Seed of everything random.
        """
        digest = hashlib.sha256(f"{of_fleet} {self.hash}".encode()).digest()
        return int.from_bytes(digest[:8], "big") % LARGEST_SEED


def read_cases(folder: Path, inspections: Iterable[Inspection], reading: Reading) -> Iterator[Case | Broken]:
    """Every inspection, or why it cannot be fitted.

    Args:
        folder: Of the fleet.
        inspections: Of it.
        reading: Keywords of `bowdenfit.read`.

    Raises:
        DescriptionError: The description that holds for all tables of fleet.csv is missing or wrong.
    """
    descriptions: dict[Path, Description] = {}
    before: dict[str, str] = {}
    for each in inspections:
        try:
            refuse_special(each.place)
        except DatasetError as error:
            yield Broken(each.label, str(error))
            continue
        if not each.place.is_dir() and folder not in descriptions:
            descriptions[folder] = _common_description(folder, reading)
        try:
            if each.place.is_dir():
                dataset = read(each.place, **reading)
            else:
                dataset = _of_table(each.place, descriptions[folder], folder)
            found = Case(each, dataset, shape_dataset(dataset), input_hash(dataset))
        except (DatasetError, DescriptionError, StoreError) as error:
            yield Broken(each.label, str(error))
            continue
        if found.hash in before:
            yield Broken(each.label, _copied(each.label, before[found.hash]))
            continue
        before[found.hash] = each.label
        yield found


def _common_description(folder: Path, reading: Reading) -> Description:
    path = folder / FLEET_DESCRIPTION
    if not path.is_file():
        raise DescriptionError(
            f"{path} does not exist; it describes the cables whose tables fleet.csv names, as a {DESCRIPTION_FILE} does. Write "
            "it, or let fleet.csv name folders that have their own."
        )
    description = load_description(path, changed_settings(reading), parse_sources(reading.get("columns", ()), "--column"))
    tables = description.tables.stated
    if len(tables) != 1 or not hasattr(next(iter(tables.values())), "files"):
        raise DescriptionError(
            f"{path.name} describes {len(tables)} tables, and fleet.csv names one file an inspection; leave one under "
            f"[tables], or let fleet.csv name folders, each with its tables and a {DESCRIPTION_FILE}."
        )
    return description


def _of_table(place: Path, description: Description, folder: Path) -> Dataset:
    """The data set of one table under the description of all."""
    (kind, settings), *_ = description.tables.stated.items()
    named: dict[str, Any] = {"file": None, "files": None} | {_key(settings): escape(_seen_from(place, folder))}
    known = {name: value for name, value in named.items() if name in type(settings).model_fields}
    tables = description.tables.model_copy(update={kind: settings.model_copy(update=known)})
    return read_dataset(description.model_copy(update={"tables": tables}), folder, {})


def _seen_from(place: Path, folder: Path) -> str:
    return str(place.relative_to(folder) if place.is_relative_to(folder) else place)


def _key(settings: Any) -> str:
    """Under which key a table's file stands."""
    return "file" if "file" in type(settings).model_fields else "files"


def _copied(label: str, other: str) -> str:
    return (
        f"{label} has the readings of {other} to the last digit; the usual cause is a file that was copied or is named twice: "
        "name the right file, or delete the row."
    )


def refuse_where_none(cases: list[Case], broken: list[Broken]) -> None:
    """Refuse a fleet of which nothing can be fitted.

    Raises:
        DatasetError: What is wrong with the first.
    """
    if not cases:
        first = broken[0]
        raise DatasetError(f"none of {len(broken)} inspections can be fitted. {first.inspection}: {first.why}")


