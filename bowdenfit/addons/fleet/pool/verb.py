"""Looking at the cables of a fleet together."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from bowdenfit.addons.fleet import pool as _pool
from bowdenfit.arguments import (
    PATH,
    TEXTS,
    Output,
    Quantity,
    Seed,
    as_pair,
    number_with_unit,
    read_first,
    whole_number,
)
from bowdenfit.questions.writing import refuse_to_replace
from bowdenfit.stage_bar import show_progress_bar
from bowdenfit.verb import NOT_TRUSTED, Reply, Verb

if TYPE_CHECKING:
    from bowdenfit.addons.fleet.pool.answer import Pool

NAME = "pool"
FLEET = Parameter("FLEET", help="Such as fits/my-fleet, which `bowdenfit fleet my-fleet` writes.")


@read_first
def pool(
    results: Annotated[str | Path, FLEET, PATH],
    *,
    until: Annotated[Quantity | None, Parameter(metavar="EFFICIENCY"), number_with_unit("60%")] = None,
    wrap_angles: Annotated[Sequence[str], Parameter("--wrap-angle", metavar="COEFFICIENT=ANGLE"), TEXTS] = (),
    cycles: Annotated[int | None, Parameter(metavar="NUMBER"), whole_number(1)] = None,
    measurements: Annotated[str | Path | None, Parameter(metavar="FOLDER"), PATH] = None,
    seed: Annotated[Seed, Parameter(show_default="that of the fleet")] = None,
    output: Output = None,
    force: bool = False,
) -> "Pool":
    """Look at the cables of a fleet together: what they have in common, how they wear, and how long each lasts.

    Args:
        results: Results folder that `bowdenfit fleet` wrote.
        until: Efficiency until which a cable serves, such as 60%.
        wrap_angles: Wrap angles at which that holds, one for each friction coefficient, such as mu_sheath=180deg.
        cycles: Before so many cycles the probability of falling below it is said.
        measurements: Folder that `bowdenfit fleet` fitted; the readings of inspections of which single fits tell too little
            are looked at again.
        seed: Random seed.
        output: Folder for pool.html, pool.json, pool.txt and the figures; nothing is written without one.
        force: Replace an earlier answer in --output.

    Raises:
        UsageError: Life is asked for without what it depends on.
        StoreError: There is no fleet, or nothing in it can be pooled; or `output` holds something already; or the
            measurements are not those of the fleet.
        DatasetError, DescriptionError: The measurements cannot be read.
    """
    if output is not None:
        refuse_to_replace(Path(output), NAME, "pooled fleet", force)
    with show_progress_bar(None, None):
        answer = _pool.pool_results(
            Path(results), as_pair(until), wrap_angles, cycles, None if measurements is None else Path(measurements), seed
        )
        if output is not None:
            _pool.write_pool(answer, Path(output), NAME)
    return answer


def _reply(answer: "Pool", options: dict[str, Any]) -> Reply:
    notes = (f"Wrote {options['output']}.",) if options["output"] else ()
    return Reply(f"{answer}\n", lambda: answer, notes, 0 if answer.is_trusted else NOT_TRUSTED, answer.to_csv)


POOL = Verb(
    pool,
    _reply,
    """Look at the cables of a fleet together: wear and life.

    FLEET is a results folder that `bowdenfit fleet` wrote. The answer says how
    friction grows with cycles, what lubrication and temperature do, how much cables
    differ, and what a new one will be like; each cable is shrunk toward the population
    (partial pooling) as far as its own inspections leave it open. It names cables that are
    outliers, which are shown by their own inspections alone, and what to inspect next.

    With --until and a --wrap-angle for each coefficient: how many cycles each cable
    and a new one last, and with --cycles the probability of failing before. With
    --measurements, the folder that was fitted, cables of which single fits tell too
    little are pooled by their readings; without it they are named. Exit code 3:
    must not be trusted.
    """,
    csv="Print cables as CSV, a row a quantity.",
)
