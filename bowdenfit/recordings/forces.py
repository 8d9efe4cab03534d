"""From the channels of a file to a recording: which channel is which force, in which unit, and on which clock."""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from bowdenfit.description.pulleys import Pulleys
from bowdenfit.errors import DatasetError, nearest
from bowdenfit.files.channels import Channel, ChannelFile
from bowdenfit.files.matching import Quantity, candidates, meanings
from bowdenfit.files.naming import parse_sources
from bowdenfit.recordings.recording import RawRecording
from bowdenfit.units import INTERNAL_UNITS, ChannelSource, ColumnSource, conversion_factor, speed_dimension
from bowdenfit.words import quoted, shown

WANTED = (
    Quantity("input_force", "force"),
    Quantity("output_force", "force"),
    Quantity("velocity", "speed"),
    Quantity("time", "time"),
)
_FORCES = WANTED[:2]
TORQUES = (Quantity("input_torque", "torque"), Quantity("output_torque", "torque"))  # of a loop's pulleys
_RATE = re.compile(r"(?P<rate>[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:e[+-]?[0-9]+)?)\s*(?P<unit>k?Hz)", re.IGNORECASE)
_FIELD = re.compile(r"\{([A-Za-z_]\w*)(?::([^}]*))?\}")
_PATH = re.compile(r"[/.]")


def to_recording(
    file: ChannelFile, name: str, sources: Mapping[str, ColumnSource], pulleys: Pulleys | None = None
) -> tuple[RawRecording, str]:
    """A recording from the channels of a file.

    Args:
        file: What was read.
        name: Name of the recording.
        sources: Channels that the user has named, by quantity; the others are found by their names. The time may also
            be given as a rate, such as "1000 Hz"; a minus sign before a unit turns the sign.
        pulleys: Of a loop, whose channels may be torques; None for a single rope.

    Returns:
        The recording, and the unit of its velocity: "mm/s", "rad/s", or empty without one.

    Raises:
        DatasetError: A channel is missing or named twice, or has no unit or clock, or a unit of another kind; a torque is
            named for a single rope, or its pulley's radius is not stated.
    """
    found = {q.name: channel for q in WANTED if (channel := _find(file, q, sources)) is not None}
    torques = _torques(file, found, sources, pulleys)
    found |= torques
    for quantity in ("input_force", "output_force"):
        if quantity not in found:
            raise _missing(file, quantity)
    _check_distinct(file, found["input_force"], found["output_force"])
    forces = {
        q: _from_torque(file, found[q], q, sources, pulleys)
        if q in torques
        else _converted(file, found[q], q, sources.get(q), "force")
        for q in ("input_force", "output_force")
    }
    clocks = {q: _clock(file, found[q], found.get("time"), sources.get("time")) for q in found if q != "time"}
    for quantity, values in forces.items():
        _same_length(file, found[quantity], values, clocks[quantity])
    velocity, unit = _velocity(file, found.get("velocity"), sources.get("velocity"))
    return (
        RawRecording(
            name,
            file.path.name,
            clocks["input_force"],
            forces["input_force"],
            clocks["output_force"],
            forces["output_force"],
            clocks.get("velocity", np.zeros(0)),
            velocity,
            pulleys is not None,
        ),
        unit,
    )


def _torques(
    file: ChannelFile, found: Mapping[str, Channel], sources: Mapping[str, ColumnSource], pulleys: Pulleys | None
) -> dict[str, Channel]:
    """Channels of torque in the place of forces, by the force that each becomes."""
    torques = {}
    for quantity in TORQUES:
        force = quantity.name.replace("torque", "force")
        if pulleys is None and quantity.name in sources:
            raise DatasetError(
                f"{file.path.name}: {quantity.name} is named for a single rope, whose ends are measured as forces; if the "
                'cable is a pull-pull loop, write kind = "loop" under [cable] in cable.toml.'
            )
        if pulleys is None or (force in sources and quantity.name not in sources):
            continue
        channel = _find(file, quantity, sources)
        if channel is not None and force in found and (force in sources or quantity.name not in sources):
            raise DatasetError(
                f"{file.path.name} has both {force} ({shown(found[force].name)}) and {quantity.name} "
                f"({shown(channel.name)}); say which is meant: --channel {force}=NAME:N or --channel {quantity.name}=NAME:N*m."
            )
        if channel is not None:
            torques[force] = channel
    return torques


def _from_torque(
    file: ChannelFile, channel: Channel, force: str, sources: Mapping[str, ColumnSource], pulleys: Pulleys | None
) -> np.ndarray:
    """Forces [N] from the torques of a pulley and its radius."""
    end = force.removesuffix("_force")
    torques = _converted(file, channel, f"{end}_torque", sources.get(f"{end}_torque"), "torque")
    return (pulleys or Pulleys()).forces(torques, end, file.path.name)


def _check_distinct(file: ChannelFile, one: Channel, other: Channel) -> None:
    """Refuse one channel, or a copy of it, in the place of both forces."""
    if not np.array_equal(one.values, other.values, equal_nan=True):
        return
    what = "the same channel" if one is other else f"copies of each other, {shown(other.name)} having the same numbers"
    raise DatasetError(
        f"{file.path.name}: input_force and output_force are {what} ({shown(one.name)}), as if there were no friction at "
        "all; name the channels of the two load cells: --channel input_force=NAME:N --channel output_force=NAME:N."
    )


def rows_where(file: ChannelFile, where: Mapping[str, float]) -> ChannelFile:
    """The part of a file in which channels have the given values, as where recordings stand one below the other.

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
    """The chosen rows of a channel; one of another length is left as it is."""
    if len(channel.values) != len(chosen):
        return channel
    time = None if channel.time is None else channel.time[chosen]
    return replace(channel, values=channel.values[chosen], time=time)


def _find(file: ChannelFile, quantity: Quantity, sources: Mapping[str, ColumnSource]) -> Channel | None:
    """The channel of a quantity: the one the user names, or the only one whose name says so."""
    source = sources.get(quantity.name)
    if source is not None:
        if quantity.name == "time" and _RATE.fullmatch(source.name.strip()):
            return None
        return _named(file, quantity.name, source.name)
    headings = [(_PATH.split(c.name)[-1] or c.name, c.unit) for c in file.channels]
    spelled = {each.position for each in candidates(headings, _FORCES, tuple(sources)).get(quantity.name, ())}
    matches = [c for i, c in enumerate(file.channels) if i in spelled or _says(c, quantity)]
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
    """Whether the name of a channel, or the last part of its path, is that of the quantity."""
    names = (channel.name, _PATH.split(channel.name)[-1])
    return any(meanings(name, (quantity,)) for name in names if name)


def _named(file: ChannelFile, quantity: str, name: str) -> Channel:
    wanted = " ".join(name.split())
    matches = [c for c in file.channels if c.name == wanted] or [
        c for c in file.channels if wanted == c.name.rsplit("/", 1)[-1]
    ]
    if len(matches) == 1:
        return matches[0]
    if matches:
        raise DatasetError(
            f"{file.path.name} has several channels called {shown(wanted)}: {quoted(tuple(c.name for c in matches))}; give "
            "the whole name."
        )
    raise DatasetError(
        f"{file.path.name} has no channel {shown(wanted)}, which you name as {quantity}"
        f"{nearest(wanted, [c.name for c in file.channels])}"
    )


def _missing(file: ChannelFile, quantity: str) -> DatasetError:
    return DatasetError(
        f"{file.path.name} has no channel {quantity}; it has {quoted(tuple(c.name for c in file.channels))}. Say which "
        f'it is and its unit: --channel {quantity}=NAME:N, or channels = {{ {quantity} = {{ name = "NAME", unit = '
        '"N" } } in cable.toml.'
    )


def _converted(
    file: ChannelFile, channel: Channel, quantity: str, source: ColumnSource | None, dimension: str
) -> np.ndarray:
    """Values of a channel in the internal unit."""
    sign, unit = _unit(file, channel, quantity, source)
    try:
        return _of_counts(channel, source) * (sign * conversion_factor(unit, dimension))
    except DatasetError as error:
        raise DatasetError(f"{file.path.name}, channel {shown(channel.name)}: {error}.") from None


def _of_counts(channel: Channel, source: ColumnSource | None) -> np.ndarray:
    """What a channel says, by the gain and the offset that the user gives it."""
    if not isinstance(source, ChannelSource):
        return channel.values
    return source.gain * (channel.values - source.offset)


def steady_value(
    file: ChannelFile, quantity: Quantity, source: ColumnSource | None, convert: Callable[[str], float]
) -> tuple[float, float, float] | None:
    """The middle value of a channel, and the range of nearly all of its values; None where the file has no such channel.

    Args:
        file: What was read.
        quantity: A wrap angle or the route variable.
        source: The channel that the user names.
        convert: Factor from a unit.

    Raises:
        DatasetError: The channel has no unit, one of another kind, or no number.
    """
    channel = _find(file, quantity, {quantity.name: source} if source else {})
    if channel is None:
        return None
    written = next((unit for _, unit in meanings(channel.name, (quantity,)) if unit), "")
    unit = (source.unit if source else None) or channel.unit or written
    if not unit:
        raise DatasetError(
            f"{file.path.name}: the channel {shown(channel.name)} does not say its unit; write it beside the name of the "
            f'channel, {quantity.name} = {{ name = "{channel.name}", unit = ... }}.'
        )
    try:
        values = _of_counts(channel, source) * convert(unit)
    except DatasetError as error:
        raise DatasetError(f"{file.path.name}, channel {shown(channel.name)}: {error}.") from None
    finite = values[np.isfinite(values)]
    if not len(finite):
        raise DatasetError(f"{file.path.name}: the channel {shown(channel.name)} has no number in it; name another.")
    low, middle, high = np.quantile(finite, (0.02, 0.5, 0.98))
    return float(middle), float(low), float(high)


def _unit(file: ChannelFile, channel: Channel, quantity: str, source: ColumnSource | None) -> tuple[float, str]:
    """Sign and unit of a channel, as the user says, else the file, else the channel's name."""
    named = [
        unit for q in (*WANTED, *TORQUES) if q.name == quantity for _, unit in meanings(channel.name, (q,)) if unit
    ]
    # A heading such as input_torque_N_m was read as one in m, which only the name of the quantity can tell.
    read = [*named, channel.unit] if quantity.endswith("torque") else [channel.unit, *named]
    stated = next((unit for unit in (source.unit if source else None, *read) if unit), "")
    if not stated:
        units = {"velocity": "mm/s", "time": "s", "input_torque": "N*m", "output_torque": "N*m"}
        example = units.get(quantity, "N")
        raise DatasetError(
            f"{file.path.name}: the channel {shown(channel.name)} does not say its unit; give it, such as --channel "
            f"{quantity}={channel.name}:{example}."
        )
    text = stated.strip()
    return (-1.0, text[1:]) if text.startswith(("-", "\u2212")) and len(text) > 1 else (1.0, text)


def _clock(file: ChannelFile, channel: Channel, time: Channel | None, source: ColumnSource | None) -> np.ndarray:
    """Time of each sample of a channel [s]."""
    hertz = _rate(file, source)
    if hertz is not None:
        return np.arange(len(channel.values)) / hertz
    if source is None and channel.time is not None:
        return channel.time
    if time is not None:
        return _converted(file, time, "time", source, "time")
    raise DatasetError(
        f"{file.path.name}: the channel {shown(channel.name)} has no clock; name the channel of the time, --channel "
        "time=NAME:s, or state the sampling rate, --channel time=1000Hz."
    )


def _rate(file: ChannelFile, source: ColumnSource | None) -> float | None:
    """The sampling rate that the user gives in the place of a clock [1/s]."""
    rate = _RATE.fullmatch(source.name.strip()) if source is not None else None
    if rate is None:
        return None
    hertz = float(rate["rate"]) * (1000.0 if rate["unit"].lower() == "khz" else 1.0)
    if not 0 < hertz < np.inf:
        raise DatasetError(
            f"{file.path.name}: a sampling rate of {rate[0]} is not possible; it must be above 0, such as time=1000Hz."
        )
    return hertz


def _same_length(file: ChannelFile, channel: Channel, values: np.ndarray, time: np.ndarray) -> None:
    if len(values) != len(time):
        raise DatasetError(
            f"{file.path.name}: the channel {shown(channel.name)} has {len(values)} samples, but its clock has "
            f"{len(time)}; name the clock that belongs to it, or state the rate: --channel time=1000Hz."
        )


def _velocity(file: ChannelFile, channel: Channel | None, source: ColumnSource | None) -> tuple[np.ndarray, str]:
    if channel is None:
        return np.zeros(0), ""
    _, unit = _unit(file, channel, "velocity", source)
    kind = speed_dimension(unit)
    return _converted(file, channel, "velocity", source, kind), INTERNAL_UNITS[kind]


def parse_channels(texts: Sequence[str]) -> dict[str, ColumnSource]:
    """Channels named on the command line, such as "input_force=ai0:lbf" or "time=1000Hz".

    Raises:
        DatasetError: A text is not of that form, or names a quantity that recordings do not have.
    """
    return parse_sources(texts, "--channel", [quantity.name for quantity in (*WANTED, *TORQUES)])


def pattern_fields(pattern: str) -> tuple[tuple[str, str], ...]:
    """Names and units of the quantities in a pattern such as "{at}mm_{velocity:r/min}rpm".

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
    """What a file's name says by a pattern such as "{at}mm_{velocity:r/min}rpm": text and unit by quantity.

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
