"""What to measure next, for the command line and for notebooks."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from bowdenfit.questions.next.answer import NextMeasurement
    from bowdenfit.results.record import Record

JSON, TEXT, FIGURE = "next_measurement.json", "next_measurement.txt", "next_measurement"


def next_measurement(
    found: "Record | str | Path",
    answer: str | None = None,
    candidates: Sequence[str] = (),
    costs: Mapping[str, float] | None = None,
) -> "NextMeasurement":
    """Rank what could be measured next by how far it would narrow an answer, on average.

    Args:
        found: The fit, or its results folder.
        answer: "optimal-length", "optimal-efficiency", "efficiency@470" or a parameter; the optimal length if omitted, or
            without a route the friction coefficient.
        candidates: Such as "angle@450" or "stretch@90deg,50N"; whatever the data set's tables can hold if omitted.
        costs: Cost of a measurement of each kind; then candidates are ranked by what they do for their cost.

    Raises:
        UsageError: The fit has no posterior, or the answer, a candidate or a cost makes no sense.
        StoreError: The results folder is missing or damaged.
    """
    from bowdenfit.questions.next.ranking import next_measurement as ranked
    from bowdenfit.verbs import load

    fit = load(found) if isinstance(found, str | Path) else found
    return ranked(fit, answer, candidates, costs)


def write(found: "NextMeasurement", folder: str | Path, top: int) -> list[Path]:
    """Write the ranking as JSON and text, and its figure.

    Args:
        found: The ranking.
        folder: Where to; made if missing.
        top: How many candidates the text shows.

    Returns:
        The files written.

    Raises:
        StoreError: The folder cannot be written.
    """
    import json

    from bowdenfit.plots.write import FORMATS
    from bowdenfit.plots.write import write as write_figure
    from bowdenfit.questions.next.figure import next_measurement as drawn
    from bowdenfit.questions.next.words import next_measurement_text
    from bowdenfit.results.folder import made, write_text

    with made(Path(folder)) as place:
        write_text(place / JSON, json.dumps(found.page(), indent=1) + "\n")
        write_text(place / TEXT, next_measurement_text(found, top))
        figure = drawn(found)
        figures = [write_figure(figure, place / f"{FIGURE}.{ending}") for ending in FORMATS]
    return [place / JSON, place / TEXT, *figures]
