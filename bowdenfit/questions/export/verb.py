"""The verb `export`: write a fitted cable as other programs read it."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Parameter

from bowdenfit.arguments import (
    FIT,
    PATH,
    RESULTS,
    Output,
    Quantity,
    as_pair,
    number_with_unit,
    read_first,
    whole_number,
)
from bowdenfit.questions import export as _export
from bowdenfit.verb import NOT_TRUSTED, Reply, Verb

if TYPE_CHECKING:
    from bowdenfit.questions.export.writers import ExportedFile
    from bowdenfit.results.record import Record

_FILE = "the name of the cable, in this folder"
_PLACE = Parameter(metavar="PLACE", show_default="the middle of the range")
Target = Literal["c", "fmu", "mujoco", "matlab", "python", "yaml", "csv"]


@read_first
def export(
    fit: Annotated["Record", RESULTS, FIT],
    to: Annotated[Target, Parameter(required=True)] = "csv",
    output: Annotated[Output, Parameter(metavar="FILE", show_default=_FILE)] = None,
    *,
    points: Annotated[int, Parameter(metavar="NUMBER"), whole_number(2, 2001)] = 101,
    draws: Annotated[int, Parameter(metavar="NUMBER"), whole_number(0, 10_000)] = 0,
    at: Annotated[Quantity | None, _PLACE, number_with_unit("90deg")] = None,
    device: Annotated[str | Path | None, Parameter(metavar="FILE"), PATH] = None,
    force: bool = False,
) -> "ExportedFile":
    """Write a fitted cable as another program reads it, with quantiles, and draws where some are asked for.

    Args:
        fit: The fit.
        to: The format.
        output: The file.
        points: Number of lengths or wrap angles in a table.
        draws: Number of draws beside the quantiles, each of a cable in a mounting of its own; as CSV in place of them.
        at: Wrap angle, or length, at which a model for MuJoCo holds.
        device: A device.toml, of which YAML then has what may be compensated, too: see `bowdenfit compensate`.
        force: Replace a file that is there.

    Raises:
        UsageError: There is no posterior, or the format cannot express the cable or what may be compensated; another that can
            is named.
        DescriptionError: The device does not say what is needed.
        StoreError: The file is there already, or cannot be written.
    """
    options = _export.ExportOptions(to, points, draws, as_pair(at), None if device is None else Path(device), force)
    return _export.export_fit(fit, None if output is None else Path(output), options)


def _reply(answer: "ExportedFile", _: Mapping[str, Any]) -> Reply:
    return Reply(f"{answer}\n", lambda: answer, exit_code=0 if answer.trusted else NOT_TRUSTED)


VERB = Verb(
    export,
    _reply,
    """Write a fitted cable for C, MuJoCo, FMI, MATLAB, Python, ROS or as CSV.

    The file tabulates friction over lengths or wrap angles, with quantiles of the
    cable's mean and of any one mounting.

      c       a header (C99): output force, input force, friction while moving to
              and fro, compensation, and friction followed online
      mujoco  a loop that stays taut as MJCF (cable.xml), or any cable whose stretch
              is known as a callback (--output cable.py)
      matlab  a function for MATLAB and Octave with the same answers
      python  a module without dependencies, with what the header has
      fmu     a functional mock-up unit (FMI 2.0, co-simulation) of that header,
              compiled here, with its sources
      yaml    parameters of a controller, as ROS 2 reads them: friction by place,
              and what may be fed forward; with --device the largest safe share
              and gain, too
      csv     a lookup table of what bowdenfit predict answers; with --draws,
              cables drawn from the posterior

    Every file says which fit it was written from, with which seed and version, and
    over which range it holds. Outside that range the value at the nearest end is
    used, and a flag says so.
    """,
    warns=True,
    needs_coefficients=True,
)
