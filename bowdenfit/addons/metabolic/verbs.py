"""The verb `metabolic`: analyze a study of metabolic cost."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from bowdenfit.addons import metabolic as room
from bowdenfit.arguments import PATH, Output, read_first
from bowdenfit.questions.writing import answer_files, write_answer
from bowdenfit.verb import Reply, Verb

if TYPE_CHECKING:
    from bowdenfit.addons.metabolic.answer import Metabolic

NAME = "metabolic"


@read_first
def metabolic(
    dataset: Annotated[
        str | Path, Parameter("DATASET", help="Such as my-study, a folder with a metabolic.toml."), PATH
    ],
    *,
    output: Output = None,
) -> "Metabolic":
    """What a study of metabolic cost shows: paired differences with intervals, and what of its numbers cannot be right.

    Args:
        dataset: Folder with metabolic.toml, and perhaps a table of persons.
        output: Folder for metabolic.json, the text and the figure.

    Raises:
        BowdenfitError: The fault, in a sentence.
    """
    result = room.analyze_study(*room.read_study(Path(dataset)))
    if output is not None:
        write_answer(output, NAME, result, f"{result}\n", {NAME: room.metabolic_figure}, result.name)
    return result


def _reply(result: "Metabolic", options: dict[str, Any]) -> Reply:
    notes = tuple(f"Wrote {path}." for path in answer_files(options["output"], NAME)) if options["output"] else ()
    return Reply(f"{result}\n", lambda: result, notes, csv=result.to_csv)


METABOLIC = Verb(
    metabolic,
    _reply,
    """Analyze a study of the metabolic cost of walking with a device.

    The study compares walking with and without a device. DATASET has
    metabolic.toml, and either a table of persons (net_W_per_kg, or
    oxygen and carbon dioxide, from which Brockway's equation gives the rate) or
    the numbers that its paper prints. datasets/on-body-metabolic is one.

    For each pair of conditions the answer has the difference with its interval,
    whether it is significant (adjusted for all pairs), with what probability one is
    lower, and how many persons would be needed to show it; and it names printed
    numbers that contradict each other. With -o it also draws costs and differences,
    such as figure 18 of the on-body paper.
    """,
    csv="Print the comparisons as CSV, one a row.",
    reads="metabolic.toml",
)
