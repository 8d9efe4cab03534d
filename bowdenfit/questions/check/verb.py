"""Reading a data set and saying what was understood of it, and looking at its priors, before anything is fitted."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Unpack

from cyclopts import Parameter

from bowdenfit.arguments import DATASET, PATH, read_first
from bowdenfit.errors import DatasetError
from bowdenfit.reading import Reading, read
from bowdenfit.verb import Reply, Verb

if TYPE_CHECKING:
    from bowdenfit.dataset import Dataset
    from bowdenfit.questions.check.prior_predictive import PriorPredictive
    from bowdenfit.questions.check.report import Report

FIGURE = "prior_predictive"


@read_first
def check(dataset: Annotated["str | Path | Dataset", DATASET, PATH], **reading: Unpack[Reading]) -> "Report":
    """Read a data set, and build the model where only that can tell whether the description makes sense.

    Loading JAX takes longer than everything else here, so the model is built only for names and priors that the
    description alone cannot judge.

    Args:
        dataset: See `bowdenfit.read`; its keywords are taken too.
        reading: Keywords of `bowdenfit.read`.

    Raises:
        DescriptionError, DatasetError: What is wrong, in a sentence.
    """
    from bowdenfit.questions.check.report import Report
    from bowdenfit.recordings.recording import Recordings

    data = read(dataset, **reading)
    description = data.description
    if (
        description.friction_model != "capstan"
        or data.measurements.table(Recordings) is not None
        or description.prior
        or any(setting.prior for setting in description.friction.values())
        or any(not name.startswith("mu") for name in description.coefficients)  # another parameter may be called that
    ):
        import jax

        from bowdenfit.model import build_model

        with jax.enable_x64(True):
            build_model(data)
    return Report(**vars(data))


def show_priors(dataset: "Dataset", folder: str | Path, seed: int = 0) -> "PriorPredictive":
    """Draw what the priors alone hold possible beside what was measured, PNG, SVG and PDF; fit nothing.

    Args:
        dataset: The data set.
        folder: Where the figure goes; made if missing.
        seed: Seed of the draws from the priors.

    Returns:
        What the figure shows.

    Raises:
        StoreError: The folder cannot be written.
    """
    import jax

    from bowdenfit.questions.check import prior_figure
    from bowdenfit.questions.check.prior_predictive import prior_predictive
    from bowdenfit.questions.figure_files import write_figure
    from bowdenfit.results.answer_cache import copy_captions
    from bowdenfit.results.folder import fill_folder_atomically

    with jax.enable_x64(True):
        predictive = prior_predictive(dataset, seed)
    with fill_folder_atomically(Path(folder)) as place:
        copy_captions(Path(folder), place)
        write_figure(prior_figure, predictive, place, FIGURE, predictive.name)
    return predictive


@read_first
def describe(
    dataset: Annotated[Path, DATASET, PATH],
    *,
    prior_predictive: Annotated[Path | None, Parameter(metavar="FOLDER"), PATH] = None,
    **reading: Unpack[Reading],
) -> Reply:
    """What was understood of a data set; of a file alone, what it is and the command that fits it.

    Args:
        dataset: Folder, description or file.
        prior_predictive: Also draw into FOLDER what the priors alone hold possible beside what was measured, and say which
            readings lie outside; a wrong unit shows here before anything is fitted.
        reading: Keywords of `bowdenfit.read`.
    """
    from bowdenfit.dataset import is_lone_file
    from bowdenfit.questions.check.data_set_words import describe_data_set

    is_file = dataset.is_file() and dataset.suffix.lower() != ".toml"
    if (is_file or is_lone_file(dataset)) and not reading.get("wrap_angle"):
        from bowdenfit.files.apart import limits_times
        from bowdenfit.questions.check.lone_file import describe_single_file

        with limits_times(reading.get("reading_limit") or 1):
            text, usable = describe_single_file(dataset, reading, check)
        return Reply(text, exit_code=0 if usable else DatasetError.exit_code)
    report = check(dataset, **reading)
    text = describe_data_set(report)
    if prior_predictive is not None:
        from bowdenfit.questions.check.prior_words import describe_prior_predictive

        text += (
            describe_prior_predictive(show_priors(report, prior_predictive))
            + f"Wrote the figure to {prior_predictive}.\n"
        )
    return Reply(text)


VERB = Verb(
    describe,
    lambda reply, _: reply,
    """Say what was understood of a data set, and what is wrong.

    Nothing is fitted. DATASET is a folder with cable.toml and tables, or one table
    or recording with --wrap-angle. Of a file alone it is said whether it is a table
    or a recording and why, what its columns or channels and its rows are, and the
    command that fits it.
    """,
    name="check",
    json="",
)
