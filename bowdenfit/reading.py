"""Reading a data set with changes to its description: the keywords that every verb on measurements takes."""

from collections.abc import Sequence
from os import PathLike
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Annotated, Literal, TypedDict, Unpack

from cyclopts import Parameter

from bowdenfit.arguments import (
    CODES,
    DATASET,
    PATH,
    TEXTS,
    Quantity,
    as_pair,
    number_with_unit,
    read_first,
    whole_number,
)
from bowdenfit.errors import BowdenfitError, UsageError
from bowdenfit.frames import is_frame, reword_refusal, write_frame
from bowdenfit.stages import announce_stage
from bowdenfit.words import listed

if TYPE_CHECKING:
    from bowdenfit.dataset import Dataset
    from bowdenfit.frames import Frame


class Reading(TypedDict, total=False):
    """Changes to the description of a data set.

    Args:
        settings: Change a setting of cable.toml, such as friction.mu1.fixed=0.1; may be repeated.
        channels: Which channel of a recording is input_force, output_force, velocity or time, such as input_force=ai0:lbf
            or time=1000Hz; may be repeated.
        columns: Which column of a table is input_force, output_force, stroke or another quantity, such as
            input_force='Force input (N)'; a unit that the heading lacks follows a colon, as in input_force=F1:N; may be
            repeated.
        missing: What stands in a cell whose reading is missing, such as -9999 (rows without their forces are
            left out); may be repeated.
        noise: How readings scatter: normally, or as a Student-t, with which a few bad readings or mountings hardly pull
            the fit.
        friction: How friction depends on load, stroke and speed: capstan, or drag (a hidden tension D, which costs
            D (1 - exp(-Lambda)) of the force at any load), load-dependent, stroke-dependent, rate-dependent, by-group (a
            coefficient for each group that a table names), and of recordings dahl or lugre (friction that builds up after
            a turn) or play (what these are compared with) joined by +.
        geometry: How wrap angles follow the length: one curve over the whole range, or regions with dropped angles as
            the on-body paper has them.
        undetected: How angles too small to detect enter.
        errors: Errors of the bench that no reading shows; "none" leaves them out of the intervals.
        wrap_angle: Wrap angle of a single table without cable.toml, such as 180deg.
        sheet: Title of the sheet of a workbook that is a single file.
        join: File of a second logger with the output force, where the file of the data set has the input force alone.
        reading_limit: Multiple of the usual memory and time allowed for reading a binary file of its size.
    """

    settings: Annotated[Sequence[str], Parameter("--set", metavar="KEY=VALUE"), TEXTS]
    channels: Annotated[Sequence[str], Parameter("--channel", metavar="QUANTITY=CHANNEL:UNIT"), TEXTS]
    columns: Annotated[Sequence[str], Parameter("--column", metavar="QUANTITY=COLUMN:UNIT"), TEXTS]
    missing: Annotated[Sequence[str], Parameter(metavar="CODE"), CODES]
    noise: Annotated[Literal["normal", "student"] | None, Parameter(show_default="as in cable.toml, else normal")]
    friction: Annotated[str | None, Parameter(metavar="MODEL", show_default="as in cable.toml, else capstan")]
    geometry: Annotated[
        Literal["continuous", "published"] | None, Parameter(show_default="as in cable.toml, else continuous")
    ]
    undetected: Annotated[
        Literal["censored", "zero", "dropped"] | None, Parameter(show_default="as in cable.toml, else censored")
    ]
    errors: Annotated[Literal["none"] | None, Parameter(show_default="as in cable.toml, else the usual ones")]
    wrap_angle: Annotated[Quantity | None, Parameter(metavar="ANGLE"), number_with_unit("180deg")]
    sheet: Annotated[str | None, Parameter(metavar="TITLE", show_default="the one with the readings")]
    join: Annotated["str | Path | None", Parameter(metavar="FILE"), PATH]
    reading_limit: Annotated[int | None, Parameter(metavar="TIMES", show_default="1"), whole_number(1, 1000)]


_SETTINGS = {  # keywords that stand for a setting of cable.toml
    "geometry": "geometry",
    "undetected": "tables.angles.undetected",
    "friction": "friction_model",
    "noise": "noise",
}
_ERRORS = ("angle_scale", "compression", "crosstalk", "gain", "hysteresis", "load_exponent", "wear", "zero")
_NO_ERRORS = ("errors.angle={value=0,unit='deg'}", *(f"errors.{name}=0" for name in _ERRORS))


@read_first
def read(dataset: Annotated["str | Path | Dataset | Frame", DATASET, PATH], **reading: Unpack[Reading]) -> "Dataset":
    """Read and check a data set, without fitting anything.

    Args:
        dataset: Folder with a cable.toml, the file itself, or one table or recording: a file, or a data frame of pandas or
            polars with units in its headings or in attrs["units"].
        reading: See `Reading`; `wrap_angle` is a number and its unit, needed where the rows of a lone file have none.

    Raises:
        DescriptionError, DatasetError: The fault, in a sentence.
        UsageError: There is no such keyword, it comes too late for a data set that has been read, or there is no data set.
    """
    from bowdenfit.dataset import Dataset, load_folder_or_file  # here, because --help lists `Reading` without NumPy

    if isinstance(dataset, Dataset):
        refuse_named(reading, f"{dataset.description.name} has been read already", "name that where it is read")
        return dataset
    if is_frame(dataset):
        with TemporaryDirectory() as folder:
            try:
                return read(write_frame(dataset, Path(folder)), **reading)
            except BowdenfitError as error:
                raise reword_refusal(error) from None
    if not isinstance(dataset, str | PathLike):
        raise UsageError(
            f"a {type(dataset).__name__} is not a data set; name a folder or a file, or put the readings into a pandas "
            'DataFrame whose headings are quantities with their units, such as "input force (N)".'
        )
    announce_stage(f"reading {Path(dataset).name}")
    return load_folder_or_file(
        Path(dataset),
        changed_settings(reading),
        reading.get("channels", ()),
        reading.get("columns", ()),
        reading.get("missing", ()),
        as_pair(reading.get("wrap_angle")),
        reading.get("reading_limit") or 1,
        _joined_path(reading),
        reading.get("sheet") or "",
    )


def _joined_path(reading: Reading) -> Path | None:
    """Return the file of a second logger."""
    join = reading.get("join")
    if join is not None and not isinstance(join, str | PathLike):
        raise UsageError(f"join is a {type(join).__name__}; name the file of the second logger, such as join=\"output.csv\".")
    return None if join is None else Path(join)


def changed_settings(reading: Reading) -> list[str]:
    """Return the settings of cable.toml that keywords change, as on the command line.

    Args:
        reading: The keywords.
    """
    stated = {key: reading.get(name) for name, key in _SETTINGS.items()}
    by_name = [f'{key}="{value}"' for key, value in stated.items() if value is not None]
    return [*reading.get("settings", ()), *(_NO_ERRORS if reading.get("errors") else ()), *by_name]


def refuse_named(reading: Reading, why: str, remedy: str) -> None:
    """Refuse keywords that would change nothing any more.

    Args:
        reading: The keywords.
        why: Why they would not.
        remedy: Fix, as the end of the sentence.

    Raises:
        UsageError: Something is named.
    """
    if named := [name for name, value in reading.items() if value not in (None, (), [])]:
        raise UsageError(f"{why}, and {listed(named)} would change nothing: {remedy}.")
