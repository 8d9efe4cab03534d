"""Where a recording was made: its wrap angles and length, as stated, by its file's name, or by channels of its own."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from bowdenfit.description import Description, QuantityValue, RecordingFile, Route
from bowdenfit.errors import DatasetError, DescriptionError, suggest_name
from bowdenfit.files.channels import ChannelFile
from bowdenfit.files.headings import Quantity
from bowdenfit.recordings.angle_channels import SAME_BEND
from bowdenfit.recordings.named_channels import match_name, pattern_fields, steady_value
from bowdenfit.units import ColumnSource, conversion_factor, route_conversion_factor, speed_dimension

_SAME_LENGTH = 0.005  # change of a length over the range of the route; as `SAME_LENGTH` of force tables


def parse_file_name(description: Description, pattern: str | None, path: Path, file: str) -> RecordingFile:
    """Return what the name of a file states, by the table's pattern."""
    if pattern is None:
        return RecordingFile(file=file)
    _check_pattern(description, pattern)
    values = match_name(pattern, path)
    angles = {
        name: QuantityValue(value=float(text), unit=unit or "deg")
        for name, (text, unit) in values.items()
        if name in description.angle_columns
    }
    velocity = values.get("velocity")
    return RecordingFile(
        file=file,
        run=values["run"][0] if "run" in values else None,
        at=float(values["at"][0]) if "at" in values else None,
        velocity=QuantityValue(value=float(velocity[0]), unit=velocity[1] or "mm/s") if velocity else None,
        wrap_angles=angles,
    )


def _check_pattern(description: Description, pattern: str) -> None:
    """Refuse a pattern that names what a recording does not have, or a unit of the wrong kind."""
    known_names = ["at", "run", "velocity", *description.angle_columns]
    key = "cable.toml, tables.recordings.pattern"
    for name, unit in pattern_fields(pattern):
        if name not in known_names:
            raise DescriptionError(f"{key}: {name!r} is unknown{suggest_name(name, known_names)}")
        if unit and name != "at" and name != "run":
            dimension = speed_dimension(unit) if name == "velocity" else "angle"
            try:
                conversion_factor(unit, dimension)
            except DatasetError as error:
                raise DescriptionError(f"{key}, {{{name}:{unit}}}: {error}.") from None


def location_names(description: Description) -> tuple[str, ...]:
    """Return the names of the quantities that say where a recording was made."""
    return (*description.angle_columns, *([description.route.variable] if description.route else []))


def locate_by_channels(
    description: Description, file: ChannelFile, entry: RecordingFile, sources: Mapping[str, ColumnSource]
) -> RecordingFile:
    """Complete a recording's entry with wrap angles and length from its channels, where it does not state them itself.

    A channel is looked for by its name where a contact has no curve, and is that which the user names in any case.

    Args:
        description: The cable.
        file: The rows of the recording.
        entry: Entry of the recording in cable.toml.
        sources: Channels that the user names.

    Raises:
        DatasetError: A channel changes during the recording, or is named beside a value.
    """
    angles, at = dict(entry.wrap_angles), entry.at
    for contact in description.contact:
        column = contact.wrap_angle.column
        if column is None or (column not in sources and (contact.wrap_angle.curve or column in angles)):
            continue
        if column in angles:
            raise _make_duplicate_error(entry, column)
        angle = _read_steady_angle(file, column, sources.get(column))
        if angle is not None:
            angles[column] = QuantityValue(value=angle, unit="rad")
    route = description.route
    if route is not None and (route.variable in sources or at is None):
        length = _read_steady_length(file, route, sources.get(route.variable))
        if length is not None and at is not None:
            raise _make_duplicate_error(entry, route.variable)
        at = length if length is not None else at
    return entry.model_copy(update={"wrap_angles": angles, "at": at})


def _read_steady_angle(file: ChannelFile, column: str, source: ColumnSource | None) -> float | None:
    """Return a wrap angle from its channel [rad]; None without such a channel."""
    steady = steady_value(file, Quantity(column, "angle"), source, lambda unit: conversion_factor(unit, "angle"))
    if steady is None:
        return None
    value, low, high = steady
    if high - low > SAME_BEND:
        raise _make_change_error(file, column, float(np.rad2deg(low)), float(np.rad2deg(high)), "deg")
    if value < 0:
        raise DatasetError(
            f"{file.path.name}: {column} is {np.rad2deg(value):.4g} deg; wrap angles add up without sign, so invert the "
            "channel with a negative gain."
        )
    return value


def _read_steady_length(file: ChannelFile, route: Route, source: ColumnSource | None) -> float | None:
    """Return the route value from its channel, in the route's unit; None without such a channel."""
    quantity = Quantity(route.variable, "route", route.unit)
    steady = steady_value(file, quantity, source, lambda unit: route_conversion_factor(unit, route.unit))
    if steady is None:
        return None
    value, low, high = steady
    if high - low > _SAME_LENGTH * abs(route.range[1] - route.range[0]):
        raise _make_change_error(file, route.variable, low, high, route.unit)
    return float(f"{value:.12g}")


def _make_change_error(file: ChannelFile, name: str, low: float, high: float, unit: str) -> DatasetError:
    return DatasetError(
        f"{file.path.name}: {name} changes from {low:.4g} to {high:.4g} {unit} during the recording, which is of one bend; "
        "choose its rows by where = { ... } in a [[recording]] for each, or state the value there and rename the channel."
    )


def _make_duplicate_error(entry: RecordingFile, name: str) -> DatasetError:
    return DatasetError(
        f"{entry.file}: {name} is stated in its [[recording]], and a channel is named for it too; keep one of the two."
    )
