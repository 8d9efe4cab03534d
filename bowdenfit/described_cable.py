"""`bf.Cable`: a cable described in Python instead of in a folder with cable.toml, and its tables as data frames or arrays."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Literal, TypeAlias

import numpy as np
import pandas as pd

from bowdenfit.dataset import DESCRIPTION_FILE, Dataset, read_dataset
from bowdenfit.description import SCHEMA
from bowdenfit.description.toml_text import format_toml
from bowdenfit.display import Display, Rows
from bowdenfit.errors import UsageError, disk_error, suggest_name
from bowdenfit.frames import Frame, is_frame, write_frame
from bowdenfit.kinds import KINDS
from bowdenfit.kinds.descriptions import parse_description
from bowdenfit.outputs import write_text
from bowdenfit.words import listed, shown

CurveName: TypeAlias = Literal["gaussian", "line", "logistic", "smooth"]  # those of the registry, which a test compares
_SOURCE = "the cable"  # what refusals call the description


@dataclass(frozen=True)
class Contact:
    """A stretch where the rope is bent and rubs; see [[contact]] in docs/formats.md.

    Args:
        name: Name of the contact, such as "free sheath".
        friction: Name of its coefficient, such as "mu1"; contacts may share one.
        wrap_angle: Its wrap angle where that is the same all along the route, with the unit, such as (45, "deg").
        curve: Curve that its wrap angle follows along the route, such as "gaussian".
        column: Column of its wrap angles in the tables; by its name if omitted.
        settings: Further keys of `wrap_angle` in cable.toml, such as {"published_range": (450, 530)}.
    """

    name: str
    friction: str
    wrap_angle: tuple[float, str] | None = None
    curve: CurveName | None = None
    column: str | None = None
    settings: Mapping[str, Any] = field(default_factory=dict)

    def describe(self) -> dict[str, Any]:
        """Return the contact as cable.toml has it.

        Raises:
            UsageError: The wrap angle is no number with a unit.
        """
        angle: dict[str, Any] = {"curve": self.curve, "column": self.column}
        if self.wrap_angle is not None:
            if not isinstance(self.wrap_angle, Sequence) or isinstance(self.wrap_angle, str) or len(self.wrap_angle) != 2:
                raise UsageError(
                    f"wrap_angle = {shown(self.wrap_angle)} of the contact {shown(self.name)} must be a number and its unit, "
                    'such as (45, "deg").'
                )
            angle |= dict(zip(("value", "unit"), self.wrap_angle, strict=True))
        stated = {key: value for key, value in {**angle, **self.settings}.items() if value is not None}
        return {"name": self.name, "friction": self.friction, "wrap_angle": stated}


class Cable(Display):
    """A cable: its contacts and, by the names that cable.toml has for them, its route, friction model and whatever else differs
    from the defaults.

    `read` puts readings beside it; `bf.fit`, `bf.model` and all other functions take what it returns.

    Args:
        name: Name of the cable.
        contacts: Its contacts, in any order.
        settings: Tables and keys of cable.toml as dictionaries, such as route={"variable": "cable_length", "unit": "mm",
            "range": (430, 530)} or friction_model="load-dependent"; see docs/formats.md.

    Raises:
        UsageError: There is no contact, or something else stands among them.
    """

    def __init__(self, name: str, contacts: Sequence[Contact], **settings: Any) -> None:
        if not contacts or not all(isinstance(contact, Contact) for contact in contacts):
            raise UsageError(
                'a cable needs its contacts in a list, such as contacts=[bf.Contact("sheath", "mu", wrap_angle=(180, "deg"))].'
            )
        described = [contact.describe() for contact in contacts]
        self._stated: dict[str, Any] = {**_plain(settings), "name": name, "contact": described}

    def read(self, **tables: "Frame | Mapping[str, Any]") -> Dataset:
        """Return the readings of this cable, checked, for `bf.fit` and all other functions.

        Args:
            tables: By kind of measurement, such as angles=..., forces=..., efficiencies=..., a data frame, or arrays by the
                headings of columns with their units, such as {"input force (N)": [...], "output force (N)": [...]}.

        Raises:
            UsageError: There is no table, no such kind, or no table in the place of one.
            DescriptionError: A setting of the cable is unknown or impossible, or these tables need another; says which.
            DatasetError: A reading is wrong; says which, where and why.
        """
        if not tables:
            raise UsageError(f"there are no readings; name at least one table of {listed(_KINDS)}.")
        with TemporaryDirectory() as folder:
            return read_dataset(parse_description(self._write_tables(tables, Path(folder)), _SOURCE), Path(folder), {})

    def write(self, folder: str | Path, **tables: "Frame | Mapping[str, Any]") -> Path:
        """Write this cable and its readings as a data set, a folder with cable.toml and tables, and return the folder.

        Args:
            folder: The new folder.
            tables: See `read`.

        Raises:
            UsageError, DescriptionError, DatasetError: See `read`; or there is such a folder.
            StoreError: It cannot be written.
        """
        self.read(**tables)  # which refuses before anything is written
        place = Path(folder)
        try:
            place.mkdir(parents=True)
            page = self._write_tables(tables, place)
            ordered = dict(sorted(page.items(), key=lambda item: _place_in_toml(item[1])))
            write_text(place / DESCRIPTION_FILE, format_toml({"schema": SCHEMA, **ordered}, {}))
        except FileExistsError:
            raise UsageError(f"{place} exists already; name a folder that does not.") from None
        except OSError as error:
            raise disk_error(place, error) from None
        return place

    def _write_tables(self, tables: Mapping[str, Any], folder: Path) -> dict[str, Any]:
        """Write tables into a folder, and return the description that names them."""
        files = {kind: _write_table(kind, table, folder).name for kind, table in tables.items()}
        settings = self._stated.get("tables", {})
        unknown = {kind: keys for kind, keys in settings.items() if kind not in KINDS}  # which are refused by name
        with_files = unknown | {kind: {**settings.get(kind, {}), "file": file} for kind, file in files.items()}
        return {**self._stated, "tables": with_files}

    def sentences(self) -> list[str]:
        """Return the name and the contacts."""
        names = [f"{contact['name']} ({contact['friction']})" for contact in self._stated["contact"]]
        return [f"{self._stated['name']}: {listed(names)}."]

    def _table(self) -> Rows:
        return [{"contact": c["name"], "friction": c["friction"]} for c in self._stated["contact"]], {}


_KINDS = tuple(kind for kind in KINDS if not KINDS[kind].takes_channels)  # recordings are files of loggers


def _write_table(kind: str, table: Any, folder: Path) -> Path:
    """Write one table.

    Raises:
        UsageError: There is no such kind of table, or it is no table.
    """
    if kind not in _KINDS:
        raise UsageError(f"there is no table {kind!r}{suggest_name(kind, _KINDS)}")
    if isinstance(table, Mapping):
        try:
            table = pd.DataFrame(dict(table))
        except ValueError as error:
            raise UsageError(f"the arrays of {kind} do not make a table ({error}); all must be equally long.") from None
    if not is_frame(table):
        raise UsageError(
            f"{kind} is a {type(table).__name__} and no table; give a data frame, or a dictionary of arrays by headings with "
            'units, such as {"input force (N)": [20, 40], "output force (N)": [17.2, 34.1]}.'
        )
    return write_frame(table, folder, f"{kind}.csv")


def _place_in_toml(value: Any) -> int:
    """Return where a key comes: plain values before tables, and lists of tables last."""
    is_list = isinstance(value, list) and any(isinstance(item, Mapping) for item in value)
    return 2 if is_list else int(isinstance(value, Mapping))


def _plain(value: Any) -> Any:
    """Return settings with lists in the place of tuples, as TOML has them."""
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items() if item is not None}
    if isinstance(value, np.generic | np.ndarray):
        return value.tolist()
    return [_plain(item) for item in value] if isinstance(value, list | tuple) else value
