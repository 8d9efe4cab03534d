"""What a description says of recordings under [tables]."""

from typing import Literal

from pydantic import Field

from bowdenfit.description import Description, Preparation, QuantityValue, TableSettings
from bowdenfit.description.file import Stated
from bowdenfit.units import ChannelSource, speed_dimension


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


def contradiction(settings: RecordingsTable | None, description: Description) -> str:
    """Recordings without a table, a table without any, or a preparation that cannot be."""
    if settings is None and description.recording:
        return "[[recording]] needs recordings = {} under [tables], where what they share can be said"
    if settings is not None and not (description.recording or settings.files):
        return 'the table recordings names no file: write files = "recordings/*.csv", or a [[recording]] with its file'
    pages = [settings.prepare] if settings is not None else []
    pages += [entry.prepare for entry in description.recording if entry.prepare is not None]
    return next((said for page in pages if (said := _impossible(page))), "")


def _impossible(page: Preparation) -> str:
    limits, block = page.limits, page.block
    if limits is not None and not limits.low < limits.high:
        return (
            f"prepare, limits: low = {limits.low:g} must be below high = {limits.high:g}; they are the lowest and "
            "the highest force that the load cells can show"
        )
    if isinstance(block, QuantityValue) and block.value <= 0:
        return (
            f"prepare, block: {block.value:g} {block.unit} is no length of a block; write a positive "
            'one, or block = "none" to average nothing'
        )
    return ""


def quantities_of(settings: RecordingsTable, description: Description) -> list[Stated]:
    """Quantities in the table of recordings and in the recordings, with where they stand and what they must measure."""
    pages = [("tables, recordings, prepare", settings.prepare)]
    quantities: list[Stated] = []
    for entry in description.recording:
        where = f"recording {entry.file!r}"
        quantities += [(f"{where}, wrap_angles, {name}", angle, "angle") for name, angle in entry.wrap_angles.items()]
        if entry.velocity is not None:
            quantities.append((f"{where}, velocity", entry.velocity, speed_dimension(entry.velocity.unit)))
        if entry.prepare is not None:
            pages.append((f"{where}, prepare", entry.prepare))
    for where, page in pages:
        for name, value in (("delay", page.delay), ("block", page.block)):
            if isinstance(value, QuantityValue):
                quantities.append((f"{where}, {name}", value, "time"))
        if page.limits is not None:
            lowest = QuantityValue(value=page.limits.low, unit=page.limits.unit)
            quantities.append((f"{where}, limits", lowest, "force"))
    return quantities
