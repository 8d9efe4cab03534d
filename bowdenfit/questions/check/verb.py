"""Check a data set: say what was understood of it, and look at its priors, before anything is fitted."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Unpack, cast

from cyclopts import Parameter

from bowdenfit.arguments import DATASET, PATH, read_first
from bowdenfit.errors import DatasetError, MissingAngleError
from bowdenfit.questions import check as room
from bowdenfit.reading import Reading
from bowdenfit.verb import Reply, Verb

if TYPE_CHECKING:
    from bowdenfit.dataset import Dataset
    from bowdenfit.frames import Frame
    from bowdenfit.questions.check.data_set_words import Report
    from bowdenfit.questions.check.lone_report import LoneReport


@read_first
def check(
    dataset: Annotated["str | Path | Dataset | Frame", DATASET, PATH], **reading: Unpack[Reading]
) -> "Report | LoneReport":
    """Read a data set, and build the model where only that can tell whether the description makes sense.

    Args:
        dataset: See `bowdenfit.read`; its keywords are taken too.
        reading: Keywords of `bowdenfit.read`.

    Returns:
        The data set, which shows itself as the command does; of a file or data frame that does not state its wrap angle, what
        it holds, and the call that fits it.

    Raises:
        DescriptionError, DatasetError: The fault, in a sentence.
    """
    try:
        return room.check_data_set(dataset, reading)
    except MissingAngleError:
        return room.describe_lone_table(cast("str | Path | Frame", dataset), reading)


@read_first
def describe(
    dataset: Annotated[Path, DATASET, PATH],
    *,
    prior_predictive: Annotated[Path | None, Parameter(metavar="FOLDER"), PATH] = None,
    **reading: Unpack[Reading],
) -> Reply:
    """Report how a data set was read; of a single file, what it is and the command that fits it.

    Args:
        dataset: Folder, description or file.
        prior_predictive: Also draw into FOLDER what the priors alone hold possible beside what was measured, and say which
            readings lie outside; a wrong unit shows here before anything is fitted.
        reading: Keywords of `bowdenfit.read`.
    """
    if room.is_single_file(dataset) and not reading.get("wrap_angle"):
        describe_file = room.describe_joined_files if reading.get("join") else room.describe_single_file
        text, usable = describe_file(dataset, reading)
        return Reply(text, exit_code=0 if usable else DatasetError.exit_code)
    report = room.check_data_set(dataset, reading)
    text = room.describe_data_set(report)
    if prior_predictive is not None:
        text += room.describe_prior_predictive(room.show_priors(report, prior_predictive))
        text += f"Wrote the figure to {prior_predictive}.\n"
    return Reply(text)


VERB = Verb(
    describe,
    lambda reply, _: reply,
    """Report how a data set was read, and what is wrong.

    Nothing is fitted. DATASET is a folder with cable.toml and tables, or one table
    or recording with --wrap-angle. For a single file the answer says whether it is a
    table or a recording and why, what its columns or channels and its rows are, and
    which command fits it.
    """,
    name="check",
    json="",
)
