"""From the channels of a file to a recording: both forces and the velocity, each with its clock."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from bowdenfit.description.cable_parts import Pulleys, radius_setting
from bowdenfit.errors import DatasetError
from bowdenfit.files.channels import Channel, ChannelFile
from bowdenfit.files.clocks import is_clock
from bowdenfit.files.headings import find_candidates, heading_of, option_naming, rank_headings, unit_to_state
from bowdenfit.files.pieces import have_same_numbers
from bowdenfit.recordings.channel_clocks import FEW_SAMPLES, check_same_length, sample_times
from bowdenfit.recordings.named_channels import (
    INSTEAD_OF_FORCES,
    OUTPUT_CLOCK,
    WANTED,
    converted,
    find_channel,
    stated_unit,
)
from bowdenfit.recordings.recording import RawRecording
from bowdenfit.units import INTERNAL_UNITS, ColumnSource, measures, speed_dimension, usual_units
from bowdenfit.words import quoted, shown

_FORCES = ("input_force", "output_force")
_MOST_TOGETHER, _FEWEST_ROWS = 0.5, 0.9  # shares of rows with both forces, and with one, in a table that joins two clocks
_LONGEST_NAME = 80  # judged: letters of a channel's name that a message repeats


def to_recording(
    file: ChannelFile,
    name: str,
    sources: Mapping[str, ColumnSource],
    pulleys: Pulleys,
    *,
    is_loop: bool,
    output_file: ChannelFile | None = None,
) -> tuple[RawRecording, str]:
    """Return a recording from the channels of a file.

    Args:
        file: What was read.
        name: Name of the recording.
        sources: Channels that the user has named, by quantity; the others are found by their names. The time may also
            be given as a rate, such as "1000 Hz"; a minus sign before a unit turns the sign.
        pulleys: By which channels of torques and currents become forces.
        is_loop: Whether the cable is a pull-pull loop; a single rope's channels are torques or currents where they, the radius
            or a motor say so.
        output_file: What was read of the file of a second logger, where that recorded the output force.

    Returns:
        The recording, and the unit of its velocity: "mm/s", "rad/s", or empty without one.

    Raises:
        DatasetError: A channel is missing or named twice, or has no unit or clock, or a unit of another kind; or the radius
            of a torque's pulley, or the motor of a current, is not stated.
    """
    if output_file is not None:
        return _join_files(file, output_file, name, sources, pulleys, is_loop)
    _refuse_output_clock(file, sources)
    channels = _find_channels(file, sources, pulleys, is_loop)
    by_quantity = channels.by_quantity
    for quantity in _FORCES:
        if quantity not in by_quantity:
            raise _missing(file, quantity)
    _check_distinct(file, by_quantity["input_force"], by_quantity["output_force"])
    read = {q: _read_force(file, channels, q, sources, pulleys) for q in _FORCES}
    velocity, unit = _velocity(file, by_quantity.get("velocity"), sources.get("velocity"))
    clocks = {q: time for q, (time, _) in read.items()}
    if len(velocity):
        clocks["velocity"] = sample_times(file, by_quantity["velocity"], by_quantity.get("time"), sources.get("time"))
    known = {len(clock): clock for clock in clocks.values()}
    clocks = {q: known[len(clock)] if have_same_numbers(known[len(clock)], clock) else clock for q, clock in clocks.items()}
    return (
        RawRecording(
            name,
            file.path.name,
            clocks["input_force"],
            read["input_force"][1],
            clocks["output_force"],
            read["output_force"][1],
            clocks.get("velocity", np.zeros(0)),
            velocity,
            is_loop,
            channels=("", "") if channels.instead else (by_quantity["input_force"].name, by_quantity["output_force"].name),
        ),
        unit,
    )


def separate_joined_clocks(raw: RawRecording) -> tuple[RawRecording, tuple[str, ...]]:
    """Return a recording in which each force has a clock of its own, where two were joined in one table, and a remark.

    In a table that joins two clocks, each row holds the force whose clock it is of, and a blank for the other one.
    """
    if len(raw.input_time) != len(raw.output_time) or raw.input_time is not raw.output_time:
        return raw, ()
    has_input, has_output = np.isfinite(raw.input_force), np.isfinite(raw.output_force)
    fewest = min(np.count_nonzero(has_input), np.count_nonzero(has_output))
    both, either = np.count_nonzero(has_input & has_output), np.count_nonzero(has_input | has_output)
    if fewest < FEW_SAMPLES or both > _MOST_TOGETHER * fewest or either < _FEWEST_ROWS * len(has_input):
        return raw, ()
    time = raw.input_time
    separate = replace(
        raw,
        input_time=time[has_input],
        input_force=raw.input_force[has_input],
        output_time=time[has_output],
        output_force=raw.output_force[has_output],
    )
    return separate, (
        f"{raw.file}: {len(time) - both} of {len(time)} rows hold one force and a blank for the other, as two clocks joined in "
        "one table do; each force is taken on its own clock.",
    )


@dataclass(frozen=True)
class _Channels:
    """Channels of a file by what they are; torques and currents stand under the force that they become.

    Args:
        by_quantity: The channels.
        instead: What was recorded in the place of a force, such as "input_torque", by the force.
    """

    by_quantity: dict[str, Channel]
    instead: Mapping[str, str]


def _find_channels(
    file: ChannelFile, sources: Mapping[str, ColumnSource], pulleys: Pulleys, is_loop: bool
) -> _Channels:
    by_quantity = {q.name: channel for q in WANTED if (channel := find_channel(file, q, sources)) is not None}
    instead = _find_instead_of_forces(file, by_quantity, sources, pulleys, is_loop)
    channels = {force: channel for force, (_, channel) in instead.items()}
    return _Channels(by_quantity | channels, {force: quantity for force, (quantity, _) in instead.items()})


def _read_force(
    file: ChannelFile, channels: _Channels, quantity: str, sources: Mapping[str, ColumnSource], pulleys: Pulleys
) -> tuple[np.ndarray, np.ndarray]:
    """Return times [s] and forces [N] of one end."""
    channel = channels.by_quantity[quantity]
    if quantity in channels.instead:
        force = _convert_to_force(file, channel, channels.instead[quantity], sources, pulleys)
    else:
        if quantity == "input_force":
            pulleys.check_input_force(file.path.name)
        force = converted(file, channel, quantity, sources.get(quantity), "force")
    time = sample_times(file, channel, channels.by_quantity.get("time"), sources.get("time"))
    check_same_length(file, channel, force, time)
    return time, force


def _join_files(
    file: ChannelFile,
    output_file: ChannelFile,
    name: str,
    sources: Mapping[str, ColumnSource],
    pulleys: Pulleys,
    is_loop: bool,
) -> tuple[RawRecording, str]:
    """Return a recording from the files of two loggers, each force on its own clock; the velocity is that of the input's."""
    of_input = {q: source for q, source in sources.items() if not q.startswith("output_")}
    of_output = {q: source for q, source in sources.items() if q.startswith("output_") and q != OUTPUT_CLOCK}
    if (clock := sources.get(OUTPUT_CLOCK, sources.get("time"))) is not None:
        of_output["time"] = clock
    ends = {}
    for end, own, stated in (("input", file, of_input), ("output", output_file, of_output)):
        channels = _find_end(own, end, stated, pulleys, is_loop)
        start = channels.by_quantity[f"{end}_force"].start if "time" not in stated else None
        ends[end] = channels, *_read_force(own, channels, f"{end}_force", stated, pulleys), start
    (of_file, input_time, input_force, input_start), (_, output_time, output_force, output_start) = ends.values()
    if have_same_numbers(input_force, output_force):
        raise DatasetError(
            f"{file.path.name} and {output_file.path.name} hold the same forces, as if there were no friction at all; name the "
            "file that the logger at the output wrote."
        )
    velocity, unit = _velocity(file, of_file.by_quantity.get("velocity"), sources.get("velocity"))
    velocity_time = np.zeros(0)
    if len(velocity):
        time = of_file.by_quantity.get("time")
        velocity_time = sample_times(file, of_file.by_quantity["velocity"], time, sources.get("time"))
    raw = RawRecording(
        name,
        f"{file.path.name} and {output_file.path.name}",
        input_time,
        input_force,
        output_time,
        output_force,
        velocity_time,
        velocity,
        is_loop,
        input_start,
        output_start,
    )
    return raw, unit


def _find_end(
    file: ChannelFile, end: str, sources: Mapping[str, ColumnSource], pulleys: Pulleys, is_loop: bool
) -> _Channels:
    """Return the channels of the logger at one end; its only channel of forces need not say that it is that.

    Raises:
        DatasetError: It has no force, several, or that of the other end.
    """
    wanted, other = (f"{e}_force" for e in ((end, "output") if end == "input" else (end, "input")))
    channels = _find_channels(file, sources, pulleys, is_loop)
    by_quantity = channels.by_quantity
    if wanted in by_quantity and other in by_quantity:
        raise DatasetError(
            f"{file.path.name} has both forces, {shown(by_quantity[wanted].name)} and {shown(by_quantity[other].name)}; give "
            "it alone, or rename the channel that is not to be read."
        )
    if other in by_quantity:
        raise DatasetError(
            f"{file.path.name} is given as the file of the {wanted}, but has the {other} ({shown(by_quantity[other].name)}); "
            "the file with the input force comes first, and that with the output force is output_file in cable.toml, or --join."
        )
    if wanted in by_quantity:
        return channels
    forces = [channel for channel in file.channels if _is_force(channel)]
    if len(forces) != 1:
        raise _missing(file, wanted)
    return _Channels(by_quantity | {wanted: forces[0]}, channels.instead)


def _is_force(channel: Channel) -> bool:
    return measures(channel.unit, "force")


def _refuse_output_clock(file: ChannelFile, sources: Mapping[str, ColumnSource]) -> None:
    """Refuse a clock of a second file where there is none."""
    if OUTPUT_CLOCK in sources:
        raise DatasetError(
            f"{file.path.name}: {OUTPUT_CLOCK} is the clock of a second logger's file, and none is given; name that file as "
            "output_file in cable.toml, or by --join; or name the clock of both forces as time."
        )


def _find_instead_of_forces(
    file: ChannelFile,
    by_quantity: Mapping[str, Channel],
    sources: Mapping[str, ColumnSource],
    pulleys: Pulleys,
    is_loop: bool,
) -> dict[str, tuple[str, Channel]]:
    """Return what was recorded in the place of forces with its channel, by the force."""
    instead = dict[str, tuple[str, Channel]]()
    for quantity in INSTEAD_OF_FORCES:
        end = quantity.name.partition("_")[0]
        force, radius = f"{end}_force", pulleys.input_radius if end == "input" else pulleys.output_radius
        has_source = radius is not None and (quantity.dimension == "torque" or pulleys.motor is not None)
        expected = (is_loop and quantity.dimension == "torque") or has_source or quantity.name in sources
        if not expected or (force in sources and quantity.name not in sources):
            continue
        channel = find_channel(file, quantity, sources)
        if channel is not None and force in by_quantity and (force in sources or quantity.name not in sources):
            by_force, unit = by_quantity[force].name, usual_units(quantity.dimension)[0]
            raise DatasetError(
                f"{file.path.name} has both {force} ({shown(by_force)}) and {quantity.name} ({shown(channel.name)}); say which "
                f"is meant: {option_naming(force, by_force, 'N', '--channel')} or "
                f"{option_naming(quantity.name, channel.name, unit, '--channel')}."
            )
        if channel is not None and force in instead:
            raise DatasetError(
                f"{file.path.name} has both {instead[force][0]} ({shown(instead[force][1].name)}) and {quantity.name} "
                f"({shown(channel.name)}); rename the channel that is not to be read."
            )
        if channel is not None:
            instead[force] = quantity.name, channel
    return instead


def _convert_to_force(
    file: ChannelFile, channel: Channel, quantity: str, sources: Mapping[str, ColumnSource], pulleys: Pulleys
) -> np.ndarray:
    """Return forces [N] from torques or currents, such as "input_torque"."""
    values = converted(file, channel, quantity, sources.get(quantity), quantity.partition("_")[2])
    return pulleys.forces(values, quantity, file.path.name)


def _check_distinct(file: ChannelFile, one: Channel, other: Channel) -> None:
    """Refuse one channel, or a copy of it, in the place of both forces."""
    if not have_same_numbers(one.values, other.values):
        return
    what = "the same channel" if one is other else f"copies of each other, {shown(other.name)} having the same numbers"
    headings = [(channel.name, channel.unit) for channel in file.channels if not is_clock(channel)]
    names = one.name, other.name
    candidates = [heading for heading in headings if heading[0] not in names and len(heading[0]) < _LONGEST_NAME]
    remedy = "if this file has no other, record both ends, or join the file of the other logger (--join FILE)"
    if likely := rank_headings(candidates, "force"):
        name, below = candidates[likely[0]]
        quantity = "input_force" if find_candidates([(name, below)], WANTED).get("input_force") else "output_force"
        remedy = f"name the other cell: {option_naming(quantity, name, unit_to_state(name, below, 'N'), '--channel')}"
    raise DatasetError(
        f"{file.path.name}: input_force and output_force are {what} ({shown(one.name)}), as if there were no friction at "
        f"all; {remedy}."
    )


def _missing(file: ChannelFile, quantity: str) -> DatasetError:
    other = (
        'If a second logger recorded it, join its file: --join FILE, or output_file = "FILE" in a [[recording]] of cable.toml.'
        if quantity == "output_force"
        else "If a second logger recorded it, give its file first and join this one: bowdenfit fit FILE --join "
        f"{file.path.name}."
    )
    has = f"{file.path.name} has no channel {quantity}; it has {quoted(tuple(c.name for c in file.channels))}."
    headings = [(channel.name, channel.unit) for channel in file.channels if not is_clock(channel)]
    found_elsewhere = [matches for name, matches in find_candidates(headings, WANTED).items() if name != quantity]
    taken = {match.position for matches in found_elsewhere for match in matches}
    headings = [heading for i, heading in enumerate(headings) if i not in taken]
    if not (likely := rank_headings(headings, "force")):
        return DatasetError(f"{has} {other}")
    name, below = headings[likely[0]]
    unit = unit_to_state(name, below, "N")
    end, read_unit = quantity.removesuffix("_force"), heading_of(name, below).unit
    currents = [heading for heading in headings if measures(heading_of(*heading).unit, "current")]
    if currents == [(name, below)] and end == "input":  # several are signals of load cells
        return DatasetError(
            f"{has} If {shown(name)} is the current of the motor, name it and describe the [motor] with its torque_constant: "
            f"{option_naming('input_current', name, '', '--channel')}. {other}"
        )
    if measures(read_unit, "torque"):
        return DatasetError(
            f"{has} If {shown(name)} is the torque of the pulley at the {end}, name it and state the radius: "
            f"{option_naming(f'{end}_torque', name, '', '--channel')} --set '{radius_setting(end)}'. {other}"
        )
    in_toml = f'name = "{name}"' + (f', unit = "{unit}"' if unit else "")
    return DatasetError(
        f"{has} Say which it is and its unit: {option_naming(quantity, name, unit, '--channel')}, or channels = "
        f"{{ {quantity} = {{ {in_toml} }} }} in cable.toml. {other}"
    )


def _velocity(file: ChannelFile, channel: Channel | None, source: ColumnSource | None) -> tuple[np.ndarray, str]:
    if channel is None:
        return np.zeros(0), ""
    _, unit = stated_unit(file, channel, "velocity", source)
    kind = speed_dimension(unit)
    return converted(file, channel, "velocity", source, kind), INTERNAL_UNITS[kind]
