"""What a description says of measurements: tables, whose kinds add settings of their own, and recordings."""

from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from bowdenfit.description.values import Code, Finite, Frozen, Name, QuantityValue, Text
from bowdenfit.units import ChannelSource, ColumnSource, conversion_factor
from bowdenfit.words import counted, listed

_MOST_EXCLUDED = 1000  # rows, and entries that name them; a judgement
MOST_FILES = 1000  # judged: of a table, or recordings of a cable; each takes some 20 ms or more to read


class TableSettings(Frozen):
    """What all that stands under [tables] has in common."""

    missing: tuple[Code, ...] = ()

    def list_excluded(self) -> list[tuple[tuple[str, str], int, str]]:
        """Return what is left out by the user: what one and several are called, how many, and which and why in words."""
        return []

    @property
    def fits_offsets(self) -> bool:
        """Whether it asks for the load cells' offsets to be parameters."""
        return False

    @property
    def measures_preload(self) -> bool:
        """Whether its readings tell how preload depends on the wrap angle."""
        return False


class ExcludedRows(Frozen):
    """Rows of a file that its user leaves out, by their numbers in the file, and why."""

    rows: Annotated[tuple[Annotated[int, Field(ge=1)], ...], Field(min_length=1, max_length=_MOST_EXCLUDED)]
    reason: Annotated[Text, Field(min_length=1)]
    file: str | None = None


class ExcludedSpan(Frozen):
    """A stretch of a recording that its user leaves out, in seconds of the recording's clock, or all of it; and why."""

    start: Finite | None = None
    end: Finite | None = None
    reason: Annotated[Text, Field(min_length=1)]
    file: str | None = None

    @model_validator(mode="after")
    def _ordered(self) -> "ExcludedSpan":
        if (self.start is None) != (self.end is None):
            raise ValueError("a stretch that is left out needs start and end, in seconds; without both all of the file is")
        if self.start is not None and self.end is not None and not self.start < self.end:
            raise ValueError("a stretch that is left out must start before it ends; start and end are in seconds")
        return self

    @property
    def span(self) -> tuple[float, float] | None:
        """Start and end [s]; None if all of the file is left out."""
        return None if self.start is None or self.end is None else (self.start, self.end)


class Table(TableSettings):
    """One table: its file or files, the sheet or sheets of a workbook, columns without the usual names, and rows left out."""

    file: str | None = None
    files: str | tuple[str, ...] | None = None
    sheet: str | tuple[str, ...] | None = None
    columns: dict[str, ColumnSource] = Field(default_factory=dict)
    exclude: Annotated[tuple[ExcludedRows, ...], Field(max_length=_MOST_EXCLUDED)] = ()

    @model_validator(mode="after")
    def _one_source(self) -> "Table":
        if self.file == "" or self.files in ("", ()):
            raise ValueError('the name of the file is empty; write file = "name.csv" or files = "folder/*.csv"')
        if (self.file is None) == (self.files is None):
            raise ValueError('write either file = "name.csv" or files = "folder/*.csv"')
        if self.sheet in ("", ()):
            raise ValueError('the title of the sheet is empty; write sheet = "Sheet1", or leave it out')
        if self.exclude and isinstance(self.sheet, tuple) and len(self.sheet) > 1:
            raise ValueError("exclude names rows of one sheet; put the sheets into files of their own to leave rows out")
        if self.file is None and not isinstance(self.files, str) and any(part.file is None for part in self.exclude):
            raise ValueError('exclude must say of which file its rows are, { file = "name.csv", rows = [7], reason = "..." }')
        return self

    def list_excluded(self) -> list[tuple[tuple[str, str], int, str]]:
        """Return the rows that are left out, such as "forces.csv, rows 7 and 9 (the rope jumped)"."""
        excluded = []
        for part in self.exclude:
            rows = sorted(set(part.rows))
            words = f"row{'s' * (len(rows) > 1)} {listed([str(row) for row in rows])} ({part.reason})"
            excluded.append((("reading", "readings"), len(rows), f"{part.file or self.file or self.files}, {words}"))
        return excluded


class Tables(Frozen):
    """The tables of a data set by their kinds, which `bowdenfit.kinds.descriptions` adds as fields."""

    @model_validator(mode="after")
    def _some(self) -> "Tables":
        if not self.model_fields_set:
            raise ValueError('name at least one table, such as efficiencies = { file = "efficiencies.csv" }')
        return self

    @property
    def stated(self) -> dict[str, Any]:
        """What is said of each table that there is, by the name of its kind."""
        return {name: settings for name in type(self).model_fields if (settings := getattr(self, name)) is not None}


    def describe_excluded(self) -> str:
        """Return how many readings the user leaves out, which, and why, in a sentence; empty where all are used."""
        excluded = [part for settings in self.stated.values() for part in settings.list_excluded()]
        totals = {word: sum(count for other, count, _ in excluded if other == word) for word, _, _ in excluded}
        counts = listed([counted(count, *word) for word, count in totals.items()])
        return f"{counts} left out by the user: {'; '.join(place for _, _, place in excluded)}." if excluded else ""


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

    `where` picks the rows of a file that holds several recordings one below the other, such as { run = 3 }, and `sheet` the
    sheet of a workbook. The file of a second logger with the output force is `output_file`; `clock_shift` is added to its
    times, so that both clocks agree.
    """

    file: str
    output_file: str | None = None
    sheet: str | None = None
    clock_shift: Literal["estimated"] | QuantityValue | None = None
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
        if self.output_file == "":
            raise ValueError('the name of the output_file is empty; write output_file = "name.csv", or leave it out')
        if self.output_file == self.file:
            raise ValueError("output_file is the same as file; leave it out where one file has both forces")
        if self.clock_shift is not None and self.output_file is None:
            raise ValueError(
                'clock_shift is the shift between the clocks of two files; name the second, output_file = "name.csv", or state '
                "how much later the output channel is by prepare = { delay = ... }"
            )
        return self
