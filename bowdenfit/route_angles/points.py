"""Points along a route, read from the files that `wrap_angle = { route = ... }` names, to constant wrap angles."""

from math import degrees
from pathlib import Path

import numpy as np

from bowdenfit.description import ContactSettings, Description, WrapAngle
from bowdenfit.errors import DatasetError, DescriptionError, Faults
from bowdenfit.files.columns import Column, find_columns
from bowdenfit.files.headings import Quantity
from bowdenfit.files.tables import read_table
from bowdenfit.route_angles.turning import Points, Turning, measure_polyline, measure_spline
from bowdenfit.words import shown

_AXES = tuple(Quantity(name, "length") for name in "xyz")
_MOST_POINTS = 2000  # of a route: a scan of a sheath every millimeter; a judgement
_LEAST_ERROR = 1e-6  # rad; below it an angle is exact
_LARGEST_SHARE, _LARGEST_ERROR = 0.07, 3.0  # of the angle, and deg: one of both must hold; a judgement


def measure_routes(description: Description, folder: Path) -> tuple[Description, dict[str, Path], tuple[str, ...]]:
    """Return a description with the angle of each route in place of its file, the files by name, and a remark on each.

    Args:
        description: With routes.
        folder: Where its files are.

    Raises:
        DatasetError, DescriptionError: A file cannot be used; says all that are wrong.
    """
    contacts, files, remarks, faults = [], {}, [], Faults()
    for number, contact in enumerate(description.contact):
        with faults.collect(("contact", number)):
            if contact.wrap_angle.route is not None:
                path = _path_of(contact, folder)
                points = read_points(path, 2 if contact.wrap_angle.path == "spline" else 1)
                turning = _measure(contact, points, path.name)
                files[contact.wrap_angle.route] = path
                remarks.append(_remark(contact, len(points), turning))
                contact = _with_angle(contact, turning)
            contacts.append(contact)
    faults.refuse()
    return description.model_copy(update={"contact": tuple(contacts)}), files, tuple(remarks)


def _path_of(contact: ContactSettings, folder: Path) -> Path:
    """Return the file of a route, which must be in the folder of the description."""
    path = folder / str(contact.wrap_angle.route)
    try:
        inside = path.resolve().is_relative_to(folder.resolve())
    except (OSError, ValueError, RuntimeError):  # no name of a file; reading it says so
        inside = True
    if not inside:
        raise DescriptionError(
            f"contact {contact.name!r}: the route {shown(str(contact.wrap_angle.route))} is outside the folder of the "
            "description; copy the file into it, and name the copy."
        )
    return path


def read_points(path: Path, corners: int) -> Points:
    """Return the points of a route, (points, 2 or 3) [mm].

    Args:
        path: Table with the columns x and y, and z where the route leaves a plane.
        corners: How many of its points must be between the first and the last.

    Raises:
        DatasetError: The table cannot be read, has too few or too many points, or one point twice in a row.
    """
    table = read_table(path)
    columns = find_columns(table, _AXES)
    missing = [name for name in "xy" if name not in columns]
    if missing:
        raise DatasetError(
            f"{table.file} has no column {missing[0]}; a route is a table of points with the headings x_mm, y_mm and, where it "
            "leaves a plane, z_mm."
        )
    if len(table.rows) > _MOST_POINTS:
        raise DatasetError(
            f"{table.file} has {len(table.rows):,} points, and at most {_MOST_POINTS:,} are read; a sheath needs ten a bend: "
            "leave out those between."
        )
    axes = [columns[name] for name in "xyz" if name in columns]
    points = np.array([column.read_cells(column.value, np.nan) for column in axes]).T.reshape(-1, len(axes))
    _ = table.account  # which refuses what is wrong with the file
    if len(points) < corners + 2:
        raise DatasetError(
            f"{table.file} has {len(points)} points, and a route needs {corners + 2} or more: the first, the last, and what is "
            "between; measure more points along the sheath."
        )
    _refuse_repeated(points, axes[0])
    return points


def _refuse_repeated(points: Points, column: Column) -> None:
    """Refuse a point that is there twice in a row, which has no direction."""
    same = np.flatnonzero(~np.diff(points, axis=0).any(axis=1))
    if len(same):
        cell = column.cells[same[0] + 1]
        raise cell.refuse(
            f"the point at {cell.shown} is the same as that of the row above; delete one of both, or correct it."
        )


def _measure(contact: ContactSettings, points: Points, file: str) -> Turning:
    """Return the angle of a route, unless errors of its points make up too much of it."""
    source = contact.wrap_angle
    error = source.error.to("length") if source.error is not None else 0.0
    turning = measure_spline(points, error) if source.path == "spline" else measure_polyline(points, error)
    if turning.sd > max(_LARGEST_SHARE * turning.angle, np.radians(_LARGEST_ERROR)):
        remedy = (
            "measure the points more exactly"
            if source.path == "spline"
            else 'measure points farther apart, write path = "spline", which smooths them,'
        )
        angle, sd, added = (f"{degrees(value):.2g} deg" for value in (turning.angle, turning.sd, turning.added))
        raise DatasetError(
            f"{file}: with an error of {error:.3g} mm in each coordinate the wrap angle of contact {contact.name!r} is {angle} "
            f"with a standard deviation of {sd}, and errors had added {added}: the points are too close together for their "
            f"error; {remedy} or state the angle itself, such as value = 90."
        )
    return turning


def _with_angle(contact: ContactSettings, turning: Turning) -> ContactSettings:
    """Return a contact whose wrap angle is constant."""
    sd = round(degrees(turning.sd), 4) if turning.sd > _LEAST_ERROR else None
    angle = WrapAngle(value=round(degrees(turning.angle), 4), unit="deg", sd=sd)
    return contact.model_copy(update={"wrap_angle": angle})


def _remark(contact: ContactSettings, points: int, turning: Turning) -> str:
    """Say which angle a route gave."""
    source = contact.wrap_angle
    exact = "" if source.error is not None else "; its points count as exact, since no error is stated"
    added = f", after {degrees(turning.added):.2g} deg that errors of the points add" if turning.added else ""
    sd = f" (one standard deviation {degrees(turning.sd):.2g} deg{added})" if turning.sd else ""
    return (
        f"contact {contact.name!r}: wrap angle {degrees(turning.angle):.1f} deg{sd} from {points} points of "
        f"{shown(str(source.route))}, a {source.path or 'polyline'}{exact}."
    )
