"""What a description says of recordings: files, channels, preparation and phases."""

from typing import Literal

from pydantic import Field, model_validator

from bowdenfit.description.values import Finite, Frozen, Name, QuantityValue
from bowdenfit.units import ChannelSource, conversion_factor


class ForceLimits(Frozen):
    """The ends of a load cell's range."""

    low: Finite
    high: Finite
    unit: str

    @property
    def newtons(self) -> tuple[float, float]:
        """Both ends [N]."""
        factor = conversion_factor(self.unit, "force")
        return self.low * factor, self.high * factor


class Preparation(Frozen):
    """How recordings are prepared; every step can be switched.

    `tare` is "fitted" where the offsets of the load cells are parameters; `saturation` is "censored" where a reading at
    the end of the range counts as one beyond it, which only whole recordings can use.
    """

    tare: Literal["none", "interval", "fitted"] = "none"
    quiet: tuple[Finite, Finite] | None = None
    delay: Literal["estimated", "none"] | QuantityValue = "estimated"
    saturation: Literal["left out", "censored", "kept"] = "left out"
    limits: ForceLimits | None = None
    dropouts: bool = True
    spikes: bool = True
    block: Literal["auto", "none"] | QuantityValue = "auto"

    @model_validator(mode="after")
    def _quiet_known(self) -> "Preparation":
        if self.tare == "interval" and self.quiet is None:
            raise ValueError('tare = "interval" needs quiet = [start, end], in seconds, when no load was on the cable')
        if self.quiet is not None and not self.quiet[0] < self.quiet[1]:
            raise ValueError("quiet must be [start, end], in seconds")
        return self


class Phase(Frozen):
    """A stretch of a recording whose stroke the user sets by hand, in seconds."""

    start: Finite
    end: Finite
    stroke: Literal["pull", "return", "hold", "ignore"]

    @model_validator(mode="after")
    def _ordered(self) -> "Phase":
        if not self.start < self.end:
            raise ValueError("a phase must start before it ends")
        return self


class RecordingFile(Frozen):
    """One recording: its file, what it was made at, and what its channels are called.

    `where` picks the rows of a file that holds several recordings one below the other, such as { run = 3 }.
    """

    file: str
    name: Name | None = None
    run: Name | None = None
    at: Finite | None = None
    wrap_angles: dict[str, QuantityValue] = Field(default_factory=dict)
    velocity: QuantityValue | None = None
    channels: dict[str, ChannelSource] = Field(default_factory=dict)
    where: dict[str, Finite] = Field(default_factory=dict)
    prepare: Preparation | None = None
    strokes: tuple[Phase, ...] = ()

    @model_validator(mode="after")
    def _named(self) -> "RecordingFile":
        if not self.file:
            raise ValueError('the name of the file is empty; write file = "name.csv"')
        return self
