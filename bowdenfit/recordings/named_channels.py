"""The channels of a recording by what they are: named by the user or found by their names, in internal units.

What a recording was made at may stand in the name of its file (`match_name`).
"""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from bowdenfit.errors import DatasetError, suggest_name
from bowdenfit.files.channels import Channel, ChannelFile
from bowdenfit.files.headings import Quantity, find_candidates, meanings, parse_sources
from bowdenfit.files.pieces import subsample
from bowdenfit.units import ChannelSource, ColumnSource, contradiction, conversion_factor
from bowdenfit.words import quoted, shown

WANTED = (
    Quantity("input_force", "force"),
    Quantity("output_force", "force"),
    Quantity("velocity", "speed"),
    Quantity("time", "time"),
)
# What may be recorded in the place of a force: torques of pulleys, and the current of a motor.
INSTEAD_OF_FORCES = (
    Quantity("input_torque", "torque"),
    Quantity("output_torque", "torque"),
    Quantity("input_current", "current"),
)
OUTPUT_CLOCK = "output_time"  # of the file of a second logger, where it is called otherwise than that of the first
RATE = re.compile(r"(?P<rate>[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:e[+-]?[0-9]+)?)\s*(?P<unit>k?Hz)", re.IGNORECASE)
_SIGNALS = ("V", "mV", "uV", "mV/V", "V/V", "mA", "A")
_MOST_NEWTONS = float(1 << 17)  # judged: 13 t, which no Bowden cable bears; converters of 24 bits count beyond it
_PATH = re.compile(r"[/.](?! )")  # "Force / N" has a unit behind its line
_FIELD = re.compile(r"\{([A-Za-z_]\w*)(?::([^}]*))?\}")


def rows_where(file: ChannelFile, where: Mapping[str, float]) -> ChannelFile:
    """Return the part of a file in which channels have the given values, as where recordings stand one below the other.

    Args:
        file: What was read.
        where: Value by name of a channel, such as a number of the run.

    Raises:
        DatasetError: There is no such channel, or no row has these values.
    """
    for name, value in where.items():
        chosen = _named(file, "where", name).values == value
        if not chosen.any():
            raise DatasetError(
                f"{file.path.name}: no row has {value:g} in the channel {shown(name)}; see bowdenfit check."
            )
        channels = tuple(_rows(channel, chosen) for channel in file.channels)
        file = replace(file, channels=channels)
    return file


def _rows(channel: Channel, chosen: np.ndarray) -> Channel:
    """Return the chosen rows of a channel; one of another length is left as it is."""
    if len(channel.values) != len(chosen):
        return channel
    time = None if channel.time is None else channel.time[chosen]
    return replace(channel, values=channel.values[chosen], time=time)


def find_channel(file: ChannelFile, quantity: Quantity, sources: Mapping[str, ColumnSource]) -> Channel | None:
    """Return the channel of a quantity: the one the user names, or the only one whose name says so."""
    source = sources.get(quantity.name)
    if source is not None:
        if quantity.name == "time" and RATE.fullmatch(source.name.strip()):
            return None
        return _named(file, quantity.name, source.name)
    headings = [(_PATH.split(c.name)[-1] or c.name, c.unit) for c in file.channels]
    forces = find_candidates(headings, WANTED[:2], tuple(sources))
    spelled_at = {candidate.position for candidate in forces.get(quantity.name, ())}
    matches = [c for i, c in enumerate(file.channels) if i in spelled_at or _says(c, quantity)]
    if len(matches) > 1 and quantity.name == "time":
        return None  # each channel has the clock beside it
    if len(matches) > 1:
        raise DatasetError(
            f"{file.path.name}: the channels {quoted(tuple(c.name for c in matches))} can all be the {quantity.name}; say "
            f"which: --channel {quantity.name}={matches[0].name}, or channels = {{ {quantity.name} = {{ name = "
            f'"{matches[0].name}" }} }} in cable.toml.'
        )
    return matches[0] if matches else None


def _says(channel: Channel, quantity: Quantity) -> bool:
    """Return whether the name of a channel, or the last part of its path, is that of the quantity."""
    names = (channel.name, _PATH.split(channel.name)[-1])
    return any(meanings(name, (quantity,)) for name in names if name)


def _named(file: ChannelFile, quantity: str, name: str) -> Channel:
    wanted, key_path = " ".join(name.split()), ("where",) if quantity == "where" else ("channels", quantity)
    matches = [c for c in file.channels if c.name == wanted] or [
        c for c in file.channels if wanted == c.name.rsplit("/", 1)[-1]
    ]
    if len(matches) == 1:
        return matches[0]
    if matches:
        raise DatasetError(
            f"{file.path.name} has several channels called {shown(wanted)}: {quoted(tuple(c.name for c in matches))}; give "
            "the whole name.",
            key_path=key_path,
        )
    raise DatasetError(
        f"{file.path.name} has no channel {shown(wanted)}, which you name as {quantity}"
        f"{suggest_name(wanted, [c.name for c in file.channels])}",
        key_path=key_path,
    )


def stated_unit(file: ChannelFile, channel: Channel, quantity: str, source: ColumnSource | None) -> tuple[float, str]:
    """Return the sign and unit of a channel, as the user says, else the file, else the channel's name."""
    named = [
        unit for q in (*WANTED, *INSTEAD_OF_FORCES) if q.name == quantity for _, unit in meanings(channel.name, (q,)) if unit
    ]
    # A heading such as input_torque_N_m was read as one in m, which only the name of the quantity can tell.
    read = [*named, channel.unit] if quantity.endswith("torque") else [channel.unit, *named]
    counts = isinstance(source, ChannelSource) and source.gain != 1  # whose unit is that of the gain
    if source and not counts and (reason := contradiction(source.unit, next(filter(None, read), None))):
        raise DatasetError(f"{file.path.name}, channel {shown(channel.name)}: {reason}.", ("channels", quantity))
    stated = next((unit for unit in (source.unit if source else None, *read) if unit), "")
    if not stated:
        units = {"velocity": "mm/s", "time": "s", "input_torque": "N*m", "output_torque": "N*m", "input_current": "A"}
        example = units.get(quantity, "N")
        raise DatasetError(
            f"{file.path.name}: the channel {shown(channel.name)} does not state its unit; give it, such as --channel "
            f"{quantity}={channel.name}:{example}.",
            key_path=("channels", quantity),
        )
    text = stated.strip()
    return (-1.0, text[1:]) if text.startswith(("-", "\u2212")) and len(text) > 1 else (1.0, text)


def converted(
    file: ChannelFile, channel: Channel, quantity: str, source: ColumnSource | None, dimension: str
) -> np.ndarray:
    """Return values of a channel in the internal unit."""
    sign, unit = stated_unit(file, channel, quantity, source)
    try:
        values = _times(_of_counts(channel, source), sign * conversion_factor(unit, dimension))
    except DatasetError as error:
        gain = f" {_describe_gain(quantity, channel)}" if unit in _SIGNALS else ""
        raise DatasetError(f"{file.path.name}, channel {shown(channel.name)}: {error}.{gain}", ("channels", quantity)) from None
    if dimension == "force" and values is channel.values and _are_counts(values):
        raise DatasetError(
            f"{file.path.name}, channel {shown(channel.name)}: whole numbers up to {np.nanmax(np.abs(values)):.0f} are the "
            f"counts of a converter, such as an HX711, rather than newtons. {_describe_gain(quantity, channel)}",
            key_path=("channels", quantity),
        )
    return values


def _are_counts(forces: np.ndarray) -> bool:
    """Return whether forces [N] are whole numbers beyond those of any cable, as a converter of 24 bits counts."""
    some = subsample(forces)
    some = some[np.isfinite(some)]
    return len(some) > 0 and float(np.max(np.abs(some))) > _MOST_NEWTONS and bool(np.all(some == np.round(some)))


def _describe_gain(quantity: str, channel: Channel) -> str:
    """Return how to state what one count or volt is worth, and what the cell says without a load."""
    return (
        "State what one count or volt is worth, and the reading without a load, in cable.toml (bowdenfit init writes one): "
        f'channels = {{ {quantity} = {{ name = "{channel.name}", gain = ..., offset = ..., unit = "N" }} }}.'
    )


def _times(values: np.ndarray, factor: float) -> np.ndarray:
    """Return values in another unit; the same array in the same."""
    return values if factor == 1 else values * factor


def _of_counts(channel: Channel, source: ColumnSource | None) -> np.ndarray:
    """Return what a channel says, by the gain and the offset that the user gives it."""
    if not isinstance(source, ChannelSource):
        return channel.values
    return source.gain * (channel.values - source.offset)


def steady_value(
    file: ChannelFile, quantity: Quantity, source: ColumnSource | None, convert: Callable[[str], float]
) -> tuple[float, float, float] | None:
    """Return the middle value of a channel, and the range of nearly all of its values; None where the file has no such channel.

    Args:
        file: What was read.
        quantity: A wrap angle or the route variable.
        source: The channel that the user names.
        convert: Factor from a unit.

    Raises:
        DatasetError: The channel has no unit, one of another kind, or no number.
    """
    channel = find_channel(file, quantity, {quantity.name: source} if source else {})
    if channel is None:
        return None
    written = next((unit for _, unit in meanings(channel.name, (quantity,)) if unit), "")
    unit = (source.unit if source else None) or channel.unit or written
    if not unit:
        raise DatasetError(
            f"{file.path.name}: the channel {shown(channel.name)} does not state its unit; write it next to the name of the "
            f'channel, {quantity.name} = {{ name = "{channel.name}", unit = ... }}.'
        )
    try:
        values = _of_counts(channel, source) * convert(unit)
    except DatasetError as error:
        raise DatasetError(f"{file.path.name}, channel {shown(channel.name)}: {error}.") from None
    some = subsample(values)
    finite = some[np.isfinite(some)]
    if not len(finite):
        raise DatasetError(f"{file.path.name}: the channel {shown(channel.name)} has no number in it; name another.")
    low, middle, high = np.quantile(finite, (0.02, 0.5, 0.98))
    return float(middle), float(low), float(high)


def parse_channels(texts: Sequence[str]) -> dict[str, ColumnSource]:
    """Return channels named on the command line, such as "input_force=ai0:lbf" or "time=1000Hz".

    Raises:
        DatasetError: A text is not of that form, or names a quantity that recordings do not have.
    """
    return parse_sources(texts, "--channel", [*(quantity.name for quantity in (*WANTED, *INSTEAD_OF_FORCES)), OUTPUT_CLOCK])


def pattern_fields(pattern: str) -> tuple[tuple[str, str], ...]:
    """Return names and units of the quantities in a pattern such as "{at}mm_{velocity:r/min}rpm".

    Raises:
        DatasetError: A name stands there twice.
    """
    fields = tuple(_FIELD.findall(pattern))
    names = [name for name, _ in fields]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise DatasetError(
            f"cable.toml, tables.recordings.pattern: {shown(pattern)} has {{{twice}}} twice; keep one of them, and put * in "
            "the place of the other."
        )
    return fields


def match_name(pattern: str, path: Path) -> dict[str, tuple[str, str]]:
    """Return what a file's name says by a pattern such as "{at}mm_{velocity:r/min}rpm": text and unit by quantity.

    Raises:
        DatasetError: The name does not follow the pattern.
    """
    fields = pattern_fields(pattern)
    expression = re.escape(pattern).replace(r"\*", ".*")
    for name, unit in fields:
        written = re.escape("{" + name + (f":{unit}" if unit else "") + "}")
        kind = r".+?" if name == "run" else r"[+-]?[0-9]+(?:[.,][0-9]+)?"
        expression = expression.replace(written, f"(?P<{name}>{kind})", 1)
    match = re.fullmatch(expression, path.stem) or re.fullmatch(expression, path.name)
    if match is None:
        raise DatasetError(
            f"{path.name} does not follow the pattern {shown(pattern)} of the recordings in cable.toml; correct one of them, "
            "or describe the file in a [[recording]] of its own."
        )
    return {name: (match[name].replace(",", "."), unit) for name, unit in fields}
