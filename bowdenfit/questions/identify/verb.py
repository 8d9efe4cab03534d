"""What measurements determine: of a fit, of tables before sampling, or of a plan before anything is measured."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Unpack

from cyclopts import Parameter

from bowdenfit.arguments import PATH, Output, read_first
from bowdenfit.questions import identify as room
from bowdenfit.questions.writing import answer_files, write_answer
from bowdenfit.reading import Reading
from bowdenfit.verb import Reply, Verb

if TYPE_CHECKING:
    from bowdenfit.dataset import Dataset
    from bowdenfit.frames import Frame
    from bowdenfit.questions.identify.answer import Identifiability
    from bowdenfit.results.record import Record

NAME = "identifiability"
NOT_IDENTIFIABLE = "not identifiable"  # what a fit is whose measurements do not tell every coefficient


@read_first
def identify(
    source: Annotated[
        "str | Path | Dataset | Frame | Record",
        Parameter("SOURCE", help="Such as fits/my-cable, the results of a fit, or my-cable, a data set."),
        PATH,
    ],
    *,
    output: Output = None,
    **reading: Unpack[Reading],
) -> "Identifiability":
    """What measurements determine of a cable's parameters, and what rests on the priors.

    Args:
        source: A fit or its results folder; a data set (fitted by least squares only); or a plan, a cable.toml with
            [design] (and [truth], where not given at the priors' medians), before anything is measured.
        output: Folder for identifiability.json, .txt and figures.
        reading: Keywords of `bowdenfit.read`, for a data set.

    Raises:
        BowdenfitError: The fault, in a sentence.
    """
    result = room.identify_source(source, reading)
    if output is not None:
        figures = {NAME: room.identifiability_figure}
        write_answer(output, NAME, result, f"{result}\n", figures, result.name)
    return result


def _reply(result: "Identifiability", options: dict[str, Any]) -> Reply:
    """Return what the command line prints."""
    notes = tuple(f"Wrote {path}." for path in answer_files(options["output"], NAME)) if options["output"] else ()
    return Reply(f"{result}\n", lambda: result, notes, csv=result.to_csv)


def _reply_from_stored(answers: Mapping[str, Any], options: Mapping[str, Any]) -> Reply | None:
    """Return the reply of a stored answer, for people alone: profiles need the model."""
    if "identify" not in answers or any(value for name, value in options.items() if name != "source"):
        return None
    return Reply(f"{room.rebuild_identifiability(answers['identify'])}\n")


VERB = Verb(
    identify,
    _reply,
    """Say which coefficients the measurements determine.

    SOURCE is a plan, before anything is measured (a cable.toml with [design], the
    lengths and forces that you intend to measure at, such as
    datasets/synthetic-bench/bench.toml); a data set; or the results folder of a
    fit. The answer says which friction coefficients, or which sums of them, SOURCE
    determines, how well, and which rest on the prior.
    """,
    csv="Print the parameters as CSV, one a row.",
    warns=True,
    explains=NOT_IDENTIFIABLE,
    kept=_reply_from_stored,
)
