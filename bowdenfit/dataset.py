"""A data set: the description and the tables of one folder, read together and checked against each other."""

import hashlib
from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from functools import partial
from itertools import islice
from pathlib import Path
from typing import Any

from bowdenfit.description import Description, Table
from bowdenfit.description.file import load_description, overridden, parse_description
from bowdenfit.errors import DatasetError, DescriptionError
from bowdenfit.files.columns import ColumnSource
from bowdenfit.kinds.elastic_tables import read_loop, read_preload, read_stretch
from bowdenfit.kinds.measurements import Measurements
from bowdenfit.kinds.reading import read_angles, read_efficiencies, read_forces
from bowdenfit.kinds.rows import Route
from bowdenfit.kinds.wrap_angles import check_measurements

DESCRIPTION_FILE = "cable.toml"


@dataclass(frozen=True)
class Dataset:
    """A description with its measurements.

    Args:
        description: What was said about the cable.
        measurements: What was measured on it.
        sha256: Checksum of every file that was read, by file name.
    """

    description: Description
    measurements: Measurements
    sha256: dict[str, str]


def load_dataset(
    path: Path, overrides: Sequence[str] = (), channels: Mapping[str, ColumnSource] | None = None
) -> Dataset:
    """Read a folder with `cable.toml` and tables, or the `cable.toml` itself.

    Args:
        path: Folder, or description file.
        overrides: Settings that replace those of the description, such as `friction.mu1.fixed=0.1`.
        channels: Channels of recordings named on the command line.

    Raises:
        DescriptionError: The description is missing or wrong.
        DatasetError: A table is missing or wrong, or does not fit the description.
    """
    if path.suffix.lower() not in {".toml", ""} and path.is_file():
        raise DescriptionError(
            f"{path.name} is a table without a description; say the angle it was measured at, such as "
            f"--wrap-angle 180deg, or write a cable.toml beside it with `bowdenfit init`."
        )
    if path.suffix.lower() not in {".toml", ""} and not path.exists():
        raise DescriptionError(f"{path} does not exist; check the spelling and the folder.")
    file = path if path.suffix == ".toml" else path / DESCRIPTION_FILE
    description = load_description(file, overrides)
    return read_dataset(description, file.parent, {file.name: _sha256(file)}, channels)


def single_file_dataset(
    path: Path,
    wrap_angle: tuple[float, str],
    overrides: Sequence[str] = (),
    channels: Mapping[str, ColumnSource] | None = None,
    kind: str = "",
) -> Dataset:
    """A data set from one table or recording of a cable with one contact at one known wrap angle.

    Args:
        path: Table of forces or of efficiencies, or a recording.
        wrap_angle: The angle and its unit.
        overrides: Settings, as for a description.
        channels: Channels of a recording named on the command line.
        kind: "forces", "efficiencies" or "recordings"; by the file if omitted.

    Raises:
        DescriptionError, DatasetError: The angle, a setting or the file is wrong.
    """
    kind = kind or _kind_of(path, bool(channels))
    angle = {"value": wrap_angle[0], "unit": wrap_angle[1]}
    raw = {
        "name": path.stem,
        "source": path.name,
        "contact": [{"name": "cable", "friction": "mu", "wrap_angle": angle}],
        "tables": {kind: {"files" if kind == "recordings" else "file": path.name}},
    }
    return read_dataset(parse_description(overridden(raw, overrides), "--wrap-angle"), path.parent, {}, channels)


_LONG = 200  # rows beyond which a table of forces is a recording


def _kind_of(path: Path, has_channels: bool) -> str:
    """Which kind of table a file without a description is.

    A CSV file is a recording if it is long, or if its rows have a time and neither a run nor a stroke.
    """
    if has_channels or path.suffix.lower() not in {".csv", ".txt", ".tsv"}:
        return "recordings"
    from bowdenfit.files.columns import Quantity, meanings
    from bowdenfit.files.csv_table import read_csv

    with path.open("rb") if path.is_file() else nullcontext() as file:
        lines = sum(1 for _ in islice(file, _LONG + 1)) if file is not None else 0
    if lines > _LONG:
        return "recordings"
    header = read_csv(path).header
    if any("efficiency" in heading.lower() for heading in header):
        return "efficiencies"
    wanted = (Quantity("time", "time"), Quantity("run", "text"), Quantity("stroke", "text"))
    found = {quantity.name for heading in header for quantity, _ in meanings(heading, wanted)}
    return "recordings" if found == {"time"} else "forces"


def read_dataset(
    description: Description,
    folder: Path,
    sha256: dict[str, str],
    channels: Mapping[str, ColumnSource] | None = None,
) -> Dataset:
    """Read the tables that a description names.

    Args:
        description: The description.
        folder: Where its files are.
        sha256: Checksums of what has been read so far.
        channels: Channels of recordings named on the command line.

    Raises:
        DatasetError: A table is missing or wrong, or does not fit the description.
    """
    tables = description.tables
    route = Route(description.route.variable, description.route.unit) if description.route else None
    own = description.angle_columns
    remarks: list[str] = []
    angles = efficiencies = forces = None
    checksums = dict(sha256)
    if tables.angles is not None and route is not None:
        (path,) = _paths(tables.angles, folder, "angles", one=True)
        limit = tables.angles.detection_limit
        columns = [c.wrap_angle.column for c in description.curved if c.wrap_angle.column]
        angles = read_angles(path, route, columns, limit.to("angle") if limit else None, _sources(tables.angles))
        checksums[path.name] = _sha256(path)
    if tables.efficiencies is not None:
        (path,) = _paths(tables.efficiencies, folder, "efficiencies", one=True)
        efficiencies = read_efficiencies(path, route, own, _sources(tables.efficiencies))
        checksums[path.name] = _sha256(path)
    if tables.forces is not None:
        paths = _paths(tables.forces, folder, "forces")
        forces, force_remarks = read_forces(paths, route, own, _sources(tables.forces))
        remarks += force_remarks
        checksums |= {
            p.relative_to(folder).as_posix() if p.is_relative_to(folder) else p.name: _sha256(p) for p in paths
        }
    recordings = None
    if tables.recordings is not None:
        from bowdenfit.kinds.recordings.table import check_angles, read_recordings

        patterns = Table(files=tables.recordings.files) if tables.recordings.files else None
        found = partial(_paths, patterns, folder, "recordings") if patterns else list
        recordings, files = read_recordings(description, folder, found, channels or {})
        check_angles(description, recordings, angles)
        checksums |= {name: _sha256(path) for name, path in files.items()}
        remarks += [remark for r in recordings.each for remark in (*r.account.remarks, *r.strokes.remarks)]
    elif channels:
        raise DescriptionError("--channel names channels of recordings, but the data set has none.")
    elastic, read, more = _elastic_tables(description, folder, route)
    checksums |= {path.name: _sha256(path) for path in read}
    tables_read = (angles, efficiencies, forces, recordings, *elastic)
    measurements = Measurements(tuple(table for table in tables_read if table is not None), (*remarks, *more))
    check_measurements(description, measurements)
    return Dataset(description, measurements, checksums)


def _elastic_tables(
    description: Description, folder: Path, route: Route | None
) -> tuple[list[Any], list[Path], list[str]]:
    """Tables of stretch, preload and a loop; the files that were read; remarks."""
    tables = description.tables
    read: list[Path] = []
    remarks: list[str] = []
    stretch = preload = loop = None
    if tables.stretch is not None:
        read += _paths(tables.stretch, folder, "stretch", one=True)
        stretch, more = read_stretch(read[-1], _sources(tables.stretch))
        remarks += more
    if tables.preload is not None:
        read += _paths(tables.preload, folder, "preload", one=True)
        preload = read_preload(read[-1], _sources(tables.preload))
    if tables.loop is not None:
        read += _paths(tables.loop, folder, "loop", one=True)
        columns, pulleys = description.angle_columns, description.cable.pulleys
        loop, more = read_loop(read[-1], route, columns, pulleys, _sources(tables.loop))
        remarks += more
    return [stretch, preload, loop], read, remarks


def _paths(table: Table, folder: Path, kind: str, one: bool = False) -> list[Path]:
    """The files of a table; patterns are expanded in sorted order."""
    named = [table.file] if table.file else [table.files] if isinstance(table.files, str) else list(table.files or ())
    paths: list[Path] = []
    for name in named:
        if name is None:
            continue
        matches = sorted(folder.glob(name)) if any(c in name for c in "*?[") else [folder / name]
        if not matches:
            raise DatasetError(f"no file in {folder} matches {name!r}, which cable.toml names for the table {kind}.")
        paths += matches
    if one and len(paths) != 1:
        raise DatasetError(f"the table {kind} must be one file; cable.toml names {len(paths)}.")
    return paths


def _sources(table: Table) -> dict[str, ColumnSource]:
    return {name: ColumnSource(column.name, column.unit) for name, column in table.columns.items()}


def _sha256(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
