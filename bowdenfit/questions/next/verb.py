"""The verb `next`: what to measure next."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from bowdenfit.arguments import ANSWER, PATH, RESULTS, TEXTS, Output, numbers_by_name, read_first, whole_number
from bowdenfit.display import render_text
from bowdenfit.questions import next as room
from bowdenfit.questions.writing import answer_files, write_answer
from bowdenfit.verb import Reply, Verb

if TYPE_CHECKING:
    from bowdenfit.questions.next.answer import NextMeasurement
    from bowdenfit.results.record import Record

NAME = "next_measurement"


@read_first
def next_measurement(
    fit: Annotated["Record | str | Path", RESULTS, PATH],
    answer: Annotated[str | None, ANSWER] = None,
    candidates: Annotated[
        Sequence[str],
        Parameter("--candidate", metavar="KIND@WHERE", show_default="all that the data set's tables can hold"),
        TEXTS,
    ] = (),
    costs: Annotated[
        Mapping[str, float] | None, Parameter("--cost", metavar="KIND=NUMBER"), numbers_by_name("angle=0.5")
    ] = None,
    *,
    top: Annotated[int, Parameter(metavar="NUMBER"), whole_number(1)] = 10,
    output: Output = None,
) -> "NextMeasurement":
    """Rank what could be measured next by how far it would narrow an answer, on average.

    Args:
        fit: The fit, or its results folder.
        answer: Answer to narrow: optimal-length, optimal-efficiency, efficiency@470, or a parameter such as mu1.
        candidates: A measurement that you could make, such as angle@450, force@470, efficiency@470, stretch@90deg,50N,
            preload@90deg or loop@90deg,30N; may be repeated.
        costs: What a measurement of a kind costs, in any unit; then candidates are ranked by what they do for their cost;
            may be repeated.
        top: How many candidates to show.
        output: Folder for the ranking and its figure.

    Raises:
        UsageError: The fit has no posterior, or the answer, a candidate or a cost makes no sense.
        StoreError: The results folder is missing or damaged, or `output` cannot be written.
    """
    record = room.open_fit(fit)
    ranking = room.rank_measurements(record, answer, candidates, costs)
    if output is not None:
        text = render_text(room.ranking_blocks(ranking, top))
        write_answer(output, NAME, ranking, text, {NAME: room.next_figure}, record.name)
    return ranking


def _reply(ranking: "NextMeasurement", options: dict[str, Any]) -> Reply:
    notes = tuple(f"Wrote {path}." for path in answer_files(options["output"], NAME)) if options["output"] else ()
    return Reply(render_text(room.ranking_blocks(ranking, options["top"])), lambda: ranking, notes, csv=ranking.to_csv)


VERB = Verb(
    next_measurement,
    _reply,
    """Rank what to measure next.

    Candidates are ranked by how much each would narrow the answer, averaged over
    its possible readings.

      KIND        a reading of
      angle       the wrap angles of all curved contacts at a length
      force       forces at both ends, a run like those made so far, after remounting
      efficiency  the efficiency at a length, after remounting
      stretch     the rope's stretch at a wrap angle and load
      preload     the preload at a wrap angle
      loop        the output force of a loop at a wrap angle and input force

    A number without a unit is a value of the route, such as the cable length.
    """,
    name="next",
    json="Print all candidates as JSON.",
    csv="Print all candidates as CSV.",
    warns=True,
)
