"""The verb `compare`: compare fits, and write the comparison as plain data, for people, and as a figure."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Parameter

from bowdenfit.arguments import FITS, HIDDEN, Output, read_first
from bowdenfit.display import render_text
from bowdenfit.questions import compare as room
from bowdenfit.questions.writing import refuse_to_replace, write_answer
from bowdenfit.stage_bar import Watch, show_progress_bar
from bowdenfit.verb import NOT_TRUSTED, Reply, Verb

if TYPE_CHECKING:
    from bowdenfit.questions.compare.answer import Comparison
    from bowdenfit.results.record import Record

NAME = "comparison"


@read_first
def compare(
    fits: Annotated[
        "Mapping[str, Record]",
        Parameter("RESULTS", help="Such as fits/one-model fits/another, which `bowdenfit fit` writes."),
        FITS,
    ],
    *,
    leave_out: Annotated[
        Literal["run", "load", "reading"] | None, Parameter(show_default="run, or load where runs are few")
    ] = None,
    output: Output = None,
    force: bool = False,
    progress: Annotated[Callable[[str], None] | None, HIDDEN] = None,
) -> "Comparison":
    """Compare fits of the same measurements.

    Args:
        fits: By name.
        leave_out: What is left out of a run at a time to be predicted by the rest: the whole run, its readings at one load, or
            one reading.
        output: Folder for comparison.html, comparison.json, comparison.txt and the figure; nothing is written without one.
        force: Replace a comparison in --output.
        progress: Called with a sentence before each reading that takes longer, because it would move the posterior.

    Raises:
        UsageError: There are fewer than two, one has no posterior, or they are not of the same readings.
        StoreError: `output` holds something already.
    """
    if output is not None:
        refuse_to_replace(Path(output), NAME, "comparison", force)
    with show_progress_bar(WATCH, progress) as show:
        comparison = room.compare_fits(fits, show, leave_out)
    if output is not None:
        names = {fit.name for fit in fits.values()}
        cable = names.pop() if len(names) == 1 else ""
        write_answer(
            output,
            NAME,
            comparison,
            render_text(room.comparison_blocks(comparison)),
            {NAME: room.comparison_figure},
            cable,
            room.comparison_page(comparison),
        )
    return comparison


def _reply(comparison: "Comparison", options: dict[str, Any]) -> Reply:
    notes = (f"Wrote {options['output']}.",) if options["output"] else ()
    exit_code = 0 if comparison.trusted else NOT_TRUSTED
    return Reply(render_text(room.comparison_blocks(comparison)), lambda: comparison, notes, exit_code, csv=comparison.to_csv)


def _show(bar: Any, sentence: str) -> None:
    bar.set_description_str(sentence)


WATCH = Watch("", "", {"desc": "comparing", "bar_format": "{desc} {elapsed}"}, _show)
VERB = Verb(
    compare,
    _reply,
    """Compare fits of the same measurements.

    The answer says which model best predicts readings that were left out, and what
    changes between the fits.

    RESULTS are results folders, such as of the same data set fitted with and
    without --friction rate-dependent; then the comparison says whether efficiency
    depends on speed. Likewise --geometry published against the continuous one,
    --noise student, --set prior.tau.fixed=0 for a cable whose mountings are all
    alike, or --set contact.0.wrap_angle.curve=logistic (the first contact) for a
    route whose wrap angle is not bell-shaped.

    A run is one mounting, and what predicts a new mounting is the other runs. With
    fewer than five runs a run is left out in parts instead, its readings at one
    load at a time: then the comparison says which model describes the cable as it
    was mounted, not how well it predicts the next mounting.

    Influential readings take longer: the posterior is fitted again without them.
    The score is the expected log predictive density of leave-one-out (elpd
    in the JSON).
    """,
    csv="Print the fits as CSV, the best first.",
    watch=WATCH,
)
