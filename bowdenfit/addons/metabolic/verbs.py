"""The verb `metabolic`: analyze a study of metabolic cost."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from bowdenfit.addons import metabolic as room
from bowdenfit.arguments import PATH, read_first
from bowdenfit.verb import Reply, Verb

if TYPE_CHECKING:
    from bowdenfit.addons.metabolic.answer import Metabolic


@read_first
def metabolic(
    dataset: Annotated[
        str | Path, Parameter("DATASET", help="Such as my-study, a folder with a metabolic.toml."), PATH
    ],
) -> "Metabolic":
    """What a study of metabolic cost shows: paired differences with intervals, and what of its numbers cannot be right.

    Args:
        dataset: Folder with metabolic.toml, and perhaps a table of persons.

    Raises:
        BowdenfitError: The fault, in a sentence.
    """
    return room.analyze_study(*room.read_study(Path(dataset)))


def _reply(result: "Metabolic", _: dict[str, Any]) -> Reply:
    return Reply(f"{result}\n", lambda: result, csv=result.to_csv)


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
    numbers that contradict each other.
    """,
    csv="Print the comparisons as CSV, one a row.",
    reads="metabolic.toml",
)
