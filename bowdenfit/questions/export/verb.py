"""Writing a fitted cable as other programs read it."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from bowdenfit.verb import Argument, Option, Output, Reply, Verb

if TYPE_CHECKING:
    from bowdenfit.questions.export.answer import Exported
    from bowdenfit.questions.export.transmission import Transmission
    from bowdenfit.results.record import Record

Target = Literal["c", "fmu", "matlab", "yaml", "csv"]
_ENDINGS: Mapping[str, str] = {"c": ".h", "csv": ".csv", "fmu": ".fmu", "matlab": ".m", "yaml": ".yaml"}
_NOT_TRUSTED = 3


def export(
    found: Annotated["Record", Argument("RESULTS", results=True)],
    to: Annotated[Target, Option(required=True)] = "csv",
    output: Annotated[Output, Option(("-o",), metavar="FILE", default="the name of the cable, in this folder")] = None,
    *,
    points: Annotated[int, Option(least=2, most=2001)] = 101,
    draws: Annotated[int, Option(least=0, most=10_000)] = 0,
    force: Annotated[bool, Option()] = False,
) -> "Exported":
    """Write a fitted cable as another program reads it, with quantiles, and draws where some are asked for.

    Args:
        found: The fit.
        to: The format.
        output: The file.
        points: Number of lengths or wrap angles in a table.
        draws: Number of draws beside the quantiles, each of a cable in a mounting of its own; as CSV in place of them.
        force: Replace a file that is there.

    Raises:
        UsageError: There is no posterior, or the format cannot express the cable; another that can is named.
        StoreError: The file is there already, or cannot be written.
    """
    from bowdenfit.errors import StoreError
    from bowdenfit.questions.export.answer import Exported
    from bowdenfit.questions.export.refusals import refuse_what_is_not_expressed
    from bowdenfit.questions.export.tables import transmission
    from bowdenfit.questions.export.words import identifier
    from bowdenfit.questions.summary.verdict import verdict
    from bowdenfit.results.folder import folder_to_write, replace_when_whole

    path = Path(identifier(found.name) + _ENDINGS[to] if output is None else output)
    if path.exists() and not (force and path.is_file()):
        raise StoreError(f"{path} exists already; add --force to replace it, or name another file with --output.")
    found.draws()
    refuse_what_is_not_expressed(found, to, draws)
    judged = verdict(found)
    tables = transmission(found, points, draws, " and ".join(judged.troubles))
    written = _writer(to, path)(found, tables)
    with folder_to_write(path.parent), replace_when_whole(path) as temporary:
        temporary.write_bytes(written)
    return Exported(path, to, tuple(tables.sentences), judged.trusted)


def _writer(to: str, path: Path) -> "Callable[[Record, Transmission], bytes]":
    """What gives the bytes of a file in a format."""
    if to == "c":
        from bowdenfit.questions.export.c import header

        return lambda _, found: header(found).encode("ascii")
    if to == "matlab":
        from bowdenfit.questions.export.matlab import function, function_name

        name = function_name(path)
        return lambda _, found: function(found, name).encode("ascii")
    if to == "fmu":
        from bowdenfit.questions.export.fmu import unit

        return lambda fit, found: unit(found, fit.name)
    if to == "yaml":
        from bowdenfit.questions.export.parameters import parameters

        return lambda _, found: parameters(found).encode("ascii")
    from bowdenfit.questions.export.lookup import lookup_table, table_of_draws
    from bowdenfit.questions.export.transmission import LEVELS

    return lambda fit, found: (
        table_of_draws(found) if len(found.levels) > len(LEVELS) else lookup_table(fit, found)
    ).encode()


def _reply(answer: "Exported", _: Mapping[str, Any]) -> Reply:
    return Reply(f"{answer}\n", lambda: answer, exit_code=0 if answer.trusted else _NOT_TRUSTED)


VERB = Verb(
    export,
    _reply,
    "Write a fitted cable for C, MuJoCo, FMI, MATLAB, ROS or a table.",
    """Write a fitted cable as another program reads it: friction over lengths or wrap angles, with quantiles of the cable's
    mean and of any one mounting.

    \b
    c       a header (C99): output force, input force, friction while moving to and fro, compensation
    matlab  a function of MATLAB and Octave that says the same
    fmu     a functional mock-up unit (FMI 2.0, co-simulation) of that header, compiled here, with its sources
    yaml    parameters of a controller, as ROS 2 reads them: friction by place, and what may be fed forward
    csv     a lookup table that says what bowdenfit predict says; with --draws, cables drawn from the posterior

    Every file says which fit it was written from, with which seed and version, and over which range it holds. Outside that
    range the nearest end counts, and a flag tells.
    """,
    warns=True,
)
