"""What the name of a recording's file says of it."""

from pathlib import Path

from bowdenfit.description import Description, QuantityValue, RecordingFile
from bowdenfit.errors import DatasetError, DescriptionError, nearest
from bowdenfit.recordings.name_patterns import match_name, pattern_fields
from bowdenfit.units import conversion_factor, speed_dimension


def said_by_name(description: Description, pattern: str | None, path: Path, file: str) -> RecordingFile:
    """What the name of a file says, by the table's pattern."""
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
    """A pattern names only what a recording can be told, in units of the right kind."""
    known = ["at", "run", "velocity", *description.angle_columns]
    place = "cable.toml, tables.recordings.pattern"
    for name, unit in pattern_fields(pattern):
        if name not in known:
            raise DescriptionError(f"{place}: {name!r} is unknown{nearest(name, known)}")
        if unit and name != "at" and name != "run":
            dimension = speed_dimension(unit) if name == "velocity" else "angle"
            try:
                conversion_factor(unit, dimension)
            except DatasetError as error:
                raise DescriptionError(f"{place}, {{{name}:{unit}}}: {error}.") from None
