"""What a description says of recordings under [tables]."""

from typing import Literal

from pydantic import Field

from bowdenfit.description import Preparation, TableSettings
from bowdenfit.units import ChannelSource


class RecordingsTable(TableSettings):
    """Recordings that share their channels' names and their preparation.

    `pattern` reads what a file was recorded at from its name, such as "{at}mm_{velocity:r/min}rpm".
    """

    files: str | tuple[str, ...] | None = None
    pattern: str | None = None
    channels: dict[str, ChannelSource] = Field(default_factory=dict)
    likelihood: Literal["runs", "whole"] = "runs"
    prepare: Preparation = Preparation()

    @property
    def fits_offsets(self) -> bool:
        """Whether the load cells are tared by the fit."""
        return self.prepare.tare == "fitted"
