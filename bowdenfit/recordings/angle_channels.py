"""Channels of a recording that nobody names and that are likely to hold the wrap angle that it was made at."""

import re
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from bowdenfit.errors import DatasetError
from bowdenfit.files.channels import Channel, ChannelFile
from bowdenfit.files.clocks import is_clock
from bowdenfit.files.headings import Quantity, meanings
from bowdenfit.files.pieces import subsample
from bowdenfit.files.spellings import likely_angle_unit, likely_wrap_angle, names_bend, parse_heading
from bowdenfit.types import Vector
from bowdenfit.units import ColumnSource, conversion_factor
from bowdenfit.words import shown

SAME_BEND = float(np.deg2rad(2.0))  # difference of two readings of one wrap angle; as `SAME_BEND` of force tables
_SAME_SHARE = 0.02  # the same as a share of the angle; a judgement
_PIECES = 100  # parts of a recording in which it is seen whether an angle stands still; a judgement
_STILL = 0.9  # share of the parts with most motion in which a wrap angle stands still; a judgement
_FOLLOWS = 0.5  # correlation with the force from which an angle is that of the load; a judgement
_WRAP_ANGLE = Quantity("wrap_angle", "angle")
_PATH = re.compile(r"[/.]")


@dataclass(frozen=True)
class AngleChannel:
    """A channel that is likely to hold the wrap angle.

    Args:
        name: Its name.
        unit: Unit of its numbers, as the file says or as is likely.
        angle: Angle at the start [rad].
        later: Angle behind the first change [rad]; NaN where it is the same throughout.
        changed: Sample at which it changes, from 1; 0 where it does not.
    """

    name: str
    unit: str
    angle: float
    later: float = float("nan")
    changed: int = 0

    @property
    def option(self) -> str:
        """The angle as the option --wrap-angle takes it."""
        return f"{self._in_unit(self.angle):.4g}{'rad' if self.unit == 'rad' else 'deg'}"

    def _in_unit(self, angle: float) -> float:
        return angle if self.unit == "rad" else float(np.rad2deg(angle))

    def explain_change(self, file: str) -> str:
        """Return in a sentence that it changes; empty where it does not."""
        if not self.changed:
            return ""
        unit = "rad" if self.unit == "rad" else "deg"
        return (
            f"{file}: the channel {shown(self.name)}, which is likely to hold the wrap angle, changes from "
            f"{self._in_unit(self.angle):.4g} to {self._in_unit(self.later):.4g} {unit} at sample {self.changed}, and a "
            "recording is of one wrap angle; split the file there, and give each part its own angle. If it is another angle, "
            "say so in its name, such as joint angle, or take the channel out of the file."
        )

    def explain_contradiction(self, file: str, stated: float) -> str:
        """Return in a sentence that it is another angle than the one that is stated [rad]; empty where it is the same."""
        if abs(self.angle - stated) <= max(SAME_BEND, _SAME_SHARE * stated):
            return ""
        return (
            f"{file}: the channel {shown(self.name)} is {self.option} throughout, which is likely to be the wrap angle, and "
            f"{np.rad2deg(stated):.4g} deg is stated; the friction coefficient would be wrong by their ratio. Use --wrap-angle "
            f"{self.option}, or state that in cable.toml. If it is another angle, say so in the name of the channel, such as "
            "joint angle, or take it out of the file."
        )


def refuse_other_angle(file: ChannelFile, sources: Mapping[str, ColumnSource], force: Vector, stated: float | None) -> None:
    """Refuse a channel that is likely to hold another wrap angle than the one that is stated [rad]; None states none.

    Args:
        file, sources, force: See `find_angle_channels`.
        stated: The wrap angle.

    Raises:
        DatasetError: There is such a channel, or its angle changes inside the recording.
    """
    for channel in find_angle_channels(file, sources, force) if stated is not None else ():
        if reason := channel.explain_change(file.path.name) or channel.explain_contradiction(file.path.name, stated or 0.0):
            raise DatasetError(reason)


def find_angle_channels(file: ChannelFile, sources: Mapping[str, ColumnSource], force: Vector) -> tuple[AngleChannel, ...]:
    """Return the channels that are likely to hold the wrap angle, of those that the user names for nothing.

    An angle that moves with the force is that of a motor or of a joint, unless the channel says that it is a wrap angle.

    Args:
        file: The rows of the recording.
        sources: Channels that the user names, by quantity.
        force: The force at the input, over the same time.
    """
    named = {source.name for source in sources.values()}
    channels = [c for c in file.channels if not ({c.name, _last_part(c.name)} & named) and not is_clock(c)]
    likely = (_read_channel(channel, force) for channel in channels)
    return tuple(channel for channel in likely if channel is not None)


def _last_part(name: str) -> str:
    """Return a name without the sheet, group or message before it."""
    return _PATH.split(name)[-1] or name


def _read_channel(channel: Channel, force: Vector) -> AngleChannel | None:
    """Return what a channel says of the wrap angle; None where it is likely to be something else."""
    name = _last_part(channel.name)
    spelling = parse_heading(name, channel.unit)
    is_sure = bool(meanings(name, (_WRAP_ANGLE,)))
    is_sure = is_sure or (spelling is not None and spelling.quantity == "wrap_angle" and not spelling.pair)
    likely = likely_wrap_angle(name, channel.unit)
    values = np.abs(subsample(channel.values))
    finite = np.isfinite(values)
    if (likely is None and not is_sure) or not finite.any():
        return None
    are_whole = bool(np.all(values[finite] == np.round(values[finite])))
    unit = (likely.unit if likely else None) or likely_angle_unit(name, float(values[finite].max()), are_whole)
    if not unit:
        return None
    angles = values * conversion_factor(unit, "angle")
    low, middle, high = np.quantile(angles[finite], (0.02, 0.5, 0.98))
    is_bend = is_sure or names_bend(name)
    if high - low <= max(SAME_BEND, _SAME_SHARE * middle):
        follows = middle <= SAME_BEND or abs(_correlation(angles, force)) > _FOLLOWS
        return None if follows and not is_bend else AngleChannel(channel.name, unit, float(middle))
    if not is_sure and not _stands_still(angles, force):
        return None
    return _locate_change(channel, unit, angles)


def _pieces(values: Vector) -> list[np.ndarray]:
    """Return parts of a series without what is missing."""
    parts = (part[np.isfinite(part)] for part in np.array_split(values, min(_PIECES, len(values))))
    return [part if len(part) else np.zeros(1) for part in parts]


def _stands_still(angles: Vector, force: Vector) -> bool:
    """Return whether an angle stays as it is in nearly all parts of the recording in which the force changes most."""
    moves = np.array([np.ptp(part) for part in _pieces(subsample(force))])
    spreads = np.array([np.ptp(np.quantile(part, (0.02, 0.98))) for part in _pieces(angles)])
    if len(moves) != len(spreads):
        return False
    return bool(np.mean(spreads[moves >= np.median(moves)] <= SAME_BEND) >= _STILL)


def _correlation(angles: Vector, force: Vector) -> float:
    """Return the correlation of an angle with the force; 0 where either is constant."""
    one, other = (np.array([np.median(part) for part in _pieces(series)]) for series in (angles, subsample(force)))
    if len(one) != len(other) or np.ptp(one) == 0 or np.ptp(other) == 0:
        return 0.0
    return float(np.corrcoef(one, other)[0, 1])


def _locate_change(channel: Channel, unit: str, angles: Vector) -> AngleChannel:
    """Return a channel with the first of its changes, and the angle from there to the next."""
    medians = [float(np.median(part)) for part in _pieces(angles)]
    later = next((median for median in medians if abs(median - medians[0]) > SAME_BEND), medians[-1])
    exact = np.abs(channel.values) * conversion_factor(unit, "angle")
    nearer = np.abs(exact - later) < np.abs(exact - medians[0])
    return AngleChannel(channel.name, unit, medians[0], later, int(np.argmax(nearer)) + 1)
