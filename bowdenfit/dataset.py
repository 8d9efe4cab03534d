"""A data set: the description and the tables of one folder, read together and checked against each other."""

import glob
import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from bowdenfit import route_angles
from bowdenfit.cable.registry import check_names
from bowdenfit.description import Description, QuantityValue
from bowdenfit.description.file import check_quantities, override
from bowdenfit.display import Display, Rows
from bowdenfit.errors import DescriptionError, Faults, MissingAngleError
from bowdenfit.files import is_ros2_folder
from bowdenfit.files.headings import parse_sources
from bowdenfit.files.isolation import limits_times
from bowdenfit.files.row_account import RowAccount
from bowdenfit.inputs import refuse_special, sha256_of
from bowdenfit.kinds import KINDS, iterate_tables
from bowdenfit.kinds.descriptions import (
    add_columns,
    add_missing_codes,
    load_description,
    order_groups,
    parse_description,
)
from bowdenfit.kinds.fit_command import make_ambiguity_error, require_recordings
from bowdenfit.kinds.lone_file import WRAP_ANGLE, refuse_several_sheets, understand
from bowdenfit.kinds.measured_columns import refuse_far_forces
from bowdenfit.kinds.rows import convert_excluded
from bowdenfit.kinds.table_files import Source, TableFromFiles
from bowdenfit.kinds.tables import Measurements
from bowdenfit.recordings.named_channels import parse_channels
from bowdenfit.units import ColumnSource
from bowdenfit.words import printable

DESCRIPTION_FILE = "cable.toml"


@dataclass(frozen=True, repr=False)
class Dataset(Display):
    """A description with its measurements.

    Args:
        description: Parsed cable.toml.
        measurements: Tables of readings.
        sha256: Checksum of every file that was read, by file name.
        accounts: Where the rows of each of its tables and recordings went; empty where it was not read from files.
        folder: Folder that its files are named from; None where it was not read from files.
    """

    description: Description
    measurements: Measurements
    sha256: dict[str, str]
    accounts: tuple[RowAccount, ...] = ()
    folder: Path | None = None

    def sentences(self) -> list[str]:
        """Return what the cable is, and what was measured on it."""
        lines = [line for kind, table in iterate_tables(self.measurements) for line in kind.describe(table, self.description)]
        return [*self.description.sentences(), *(f"- {line}" for line in lines), *self.measurements.remarks]

    def _table(self) -> Rows:
        rows = [{"file": account.file, "rows": account.rows, "read": account.read} for account in self.accounts]
        return rows, {"rows": "1", "read": "1"}


def load_folder_or_file(
    path: Path,
    overrides: Sequence[str],
    channels: Sequence[str],
    columns: Sequence[str],
    missing: Sequence[str],
    wrap_angle: tuple[float, str] | None,
    reading_limit: float,
    join: Path | None = None,
    sheet: str = "",
) -> Dataset:
    """Read a folder with `cable.toml`, the `cable.toml` itself, or a lone table or recording.

    Args:
        path: Folder or file.
        overrides: Settings that replace those of the description, such as `friction.mu1.fixed=0.1`.
        channels: Channels of recordings as the command line names them, such as `input_force=ai0:lbf`.
        columns: Columns of tables, likewise.
        missing: Missing-value codes, such as "-9999".
        wrap_angle: The angle of a lone file and its unit; None where its rows have their own.
        reading_limit: So many times the usual memory and time may be taken to read a binary file.
        join: File of a second logger with the output force.
        sheet: Title of the sheet of a workbook that is a lone file.

    Raises:
        DescriptionError, DatasetError: The fault, in a sentence.
    """
    refuse_special(path)
    channel_sources, column_sources = parse_channels(channels), parse_sources(columns, "--column")
    if join is not None and not is_lone_file(path):
        raise DescriptionError(
            f"--join joins {join.name} to a single file, and {path} is none; in cable.toml write output_file = "
            f'"{join.name}" below the file of the [[recording]] with the input force.'
        )
    if sheet and not is_lone_file(path):
        raise DescriptionError(
            f"--sheet names a sheet of a single workbook, and {path} is none; in cable.toml write sheet = {json.dumps(sheet)} "
            "next to the file."
        )
    with limits_times(reading_limit):
        if wrap_angle is not None or is_lone_file(path):
            return single_file_dataset(
                path, wrap_angle, overrides, channel_sources, column_sources, missing=missing, join=join, sheet=sheet
            )
        return load_dataset(path, overrides, channel_sources, column_sources, missing)


def load_dataset(
    path: Path,
    overrides: Sequence[str] = (),
    channels: Mapping[str, ColumnSource] | None = None,
    columns: Mapping[str, ColumnSource] | None = None,
    missing: Sequence[str] = (),
) -> Dataset:
    """Read a folder with `cable.toml` and tables, or the `cable.toml` itself.

    Args:
        path: Folder, or description file.
        overrides: Settings that replace those of the description, such as `friction.mu1.fixed=0.1`.
        channels: Channels of recordings named on the command line.
        columns: Columns of tables named there.
        missing: Missing-value codes stated there.

    Raises:
        DescriptionError: The description is missing or wrong.
        DatasetError: A table is missing or wrong, or does not fit the description.
    """
    if path.suffix.lower() not in {".toml", ""} and not path.exists():
        raise DescriptionError(f"{path} does not exist; check the spelling and the folder.")
    is_file = path.suffix.lower() == ".toml" and not path.is_dir()
    file, faults = path if is_file else path / DESCRIPTION_FILE, Faults()
    description = load_description(file, overrides, columns, faults, missing)
    return read_dataset(description, file.parent, {file.name: sha256_of(file)}, channels, faults)


def is_lone_file(path: Path) -> bool:
    """Return whether a data set is one file, or the folder of a ROS 2 bag, without a description."""
    if path.is_dir():
        return is_ros2_folder(path) and not (path / DESCRIPTION_FILE).exists()
    return path.suffix.lower() not in {".toml", ""} and path.is_file()


def single_file_dataset(
    path: Path,
    wrap_angle: tuple[float, str] | None,
    overrides: Sequence[str] = (),
    channels: Mapping[str, ColumnSource] | None = None,
    columns: Mapping[str, ColumnSource] | None = None,
    kind: str = "",
    missing: Sequence[str] = (),
    join: Path | None = None,
    sheet: str = "",
) -> Dataset:
    """Read a data set that is one table or recording of a cable with one contact.

    Args:
        path: Table of forces or of efficiencies, or a recording.
        wrap_angle: The angle and its unit; None where each row of a table has its own.
        overrides: Settings, as for a description.
        channels: Channels of a recording named on the command line.
        columns: Columns of a table named there.
        kind: Name of the kind of measurement; by the file if omitted.
        missing: Missing-value codes stated there.
        join: File of a second logger with the output force, where the first has the input force alone.
        sheet: Title of the sheet of a workbook; that with the readings if empty.

    Raises:
        DescriptionError, DatasetError: The angle, a setting or the file is wrong.
    """
    if join is not None:
        require_recordings((path, join), bool(channels), tuple(columns or ()))
        kind = "recordings"
    if not (sheet or channels or columns):
        refuse_several_sheets(path)
    file = None if kind == "recordings" else understand(path, channels, columns, is_whole=False, sheet=sheet)
    if file is not None and file.kind.other and not kind:
        raise make_ambiguity_error(file)
    kind = kind or (file.kind.kind if file else "")
    if file is not None and file.has_own_angles(wrap_angle is not None):
        angle: dict[str, Any] = {"column": WRAP_ANGLE.name}
    elif wrap_angle is None:
        raise MissingAngleError(
            f"{path.name} is a file without a description; give the angle that the cable was wrapped by, such as --wrap-angle "
            "180deg, or write a cable.toml next to it with `bowdenfit init`; `bowdenfit check` prints the whole command."
        )
    else:
        angle = {"value": wrap_angle[0], "unit": wrap_angle[1]}
        check_quantities([("contact 'cable', wrap_angle", QuantityValue(**angle), "angle")], "--wrap-angle")
    raw = {
        "name": printable(path.stem).strip()[:80] or "cable",
        "source": path.name,
        "contact": [{"name": "cable", "friction": "mu", "wrap_angle": angle}],
        "tables": {kind: {"files": glob.escape(path.name)} | ({"sheet": sheet} if sheet else {})},
    }
    if join is not None:
        recording = {"file": path.name, "output_file": Path(os.path.relpath(join, path.parent)).as_posix()}
        recording |= {"sheet": sheet} if sheet else {}
        raw |= {"tables": {kind: {}}, "recording": [recording]}
    described = add_missing_codes(add_columns(override(raw, overrides), columns or {}), missing)
    return read_dataset(parse_description(described, "--set" if overrides else path.name), path.parent, {}, channels)


def read_dataset(
    description: Description,
    folder: Path,
    sha256: dict[str, str],
    channels: Mapping[str, ColumnSource] | None = None,
    faults: Faults | None = None,
) -> Dataset:
    """Read the tables that a description names.

    Args:
        description: The description.
        folder: Where its files are.
        sha256: Checksums of what has been read so far.
        channels: Channels of recordings named on the command line.
        faults: Faults of the description; raised with those of the tables.

    Raises:
        DatasetError: Tables are missing or wrong, or do not fit the description; says all that is wrong with each. Whether
            they fit is looked at where all could be read.
    """
    faults = faults or Faults()
    measurements, checksums, accounts = Measurements(), dict(sha256), tuple[RowAccount, ...]()
    if description.has_routes:
        description, routes, remarks = route_angles.measure_routes(description, folder)
        measurements = Measurements((), remarks)
        checksums |= {name: sha256_of(path) for name, path in routes.items()}
    for kind in KINDS.values():
        settings = description.tables.stated.get(kind.name)
        if settings is None:
            continue
        with faults.collect(key_path=("tables", kind.name)):
            read = kind.read(Source(kind.name, settings, description, folder, channels or {}))
            measurements = _add_table(measurements, read, kind.name, description)
            accounts += read.accounts
            checksums |= {name: sha256_of(path) for name, path in read.files.items()}
    if sentence := description.tables.describe_excluded():
        measurements = replace(measurements, remarks=(sentence, *measurements.remarks))
    faults.refuse()
    if channels and not any(kind.takes_channels for kind, _ in iterate_tables(measurements)):
        raise DescriptionError(
            "--channel names channels of recordings, but the data set has none; a column of a table is named by --column."
        )
    with faults.collect():
        check_names(description)
    with faults.collect(key_path=("friction_model",)):
        order_groups(description, measurements)
    for kind, table in iterate_tables(measurements):
        with faults.collect():
            if columns := kind.measured_columns(table):
                refuse_far_forces(columns, table.origin)
            kind.check(table, description, measurements)
    faults.refuse()
    return Dataset(description, measurements, checksums, accounts, folder)


def _add_table(
    measurements: Measurements, read: TableFromFiles[Any], kind: str, description: Description
) -> Measurements:
    """Return the measurements with one more table, with its remarks and the readings of it that the user leaves out."""
    remarks = (*(remark for account in read.accounts for remark in account.remarks), *read.remarks)
    rows = (row for account in read.accounts for row in account.excluded)
    excluded = tuple(convert_excluded(row, description) for row in rows)
    return replace(
        measurements,
        tables=(*measurements.tables, read.table),
        remarks=(*measurements.remarks, *remarks),
        excluded=measurements.excluded | ({kind: excluded} if excluded else {}),
    )
