"""Looking at the cables of a fleet together."""

import json
import math
import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from bowdenfit.arguments import (
    PATH,
    TEXTS,
    NumberWithUnit,
    Output,
    Quantity,
    Seed,
    as_pair,
    number_with_unit,
    read_first,
    whole_number,
)
from bowdenfit.questions.writing import refuse_to_replace
from bowdenfit.verb import NOT_TRUSTED, Reply, Verb

if TYPE_CHECKING:
    from bowdenfit.questions.pool.answer import Pool, ServiceLimit

NAME = "pool"
FLEET = Parameter("FLEET", help="Such as fits/my-fleet, which `bowdenfit fleet my-fleet` writes.")
_ANGLE_OPTION = re.compile(r"(?P<name>[^=]+)=\s*(?P<value>\d+\.?\d*|\.\d+)\s*(?P<unit>[A-Za-z°][\w°]*)")
_MOST_TURNS = 100


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
        seed: Seed of everything random.
        output: Folder for pool.html, pool.json, pool.txt and the figures; nothing is written without one.
        force: Replace an earlier answer in --output.

    Raises:
        UsageError: Life is asked for without what it depends on.
        StoreError: There is no fleet, or nothing in it can be pooled; or `output` holds something already; or the
            measurements are not those of the fleet.
        DatasetError, DescriptionError: The measurements cannot be read.
    """
    import jax

    from bowdenfit.questions.fleet.inspections import read_inspections
    from bowdenfit.questions.pool.pooling import pool_cables
    from bowdenfit.questions.pool.words import pool_text  # noqa: F401  (how the answer shows itself)
    from bowdenfit.results.fleet_folder import read_fleet_draws

    if output is not None:
        refuse_to_replace(Path(output), NAME, "pooled fleet", force)
    draws = read_fleet_draws(Path(results))
    if measurements is not None:
        read_inspections(Path(measurements))  # so that a wrong name is said before anything is drawn
    coefficients = [name for name, about in draws.attributes.items() if about.get("role") == "friction"]
    limit = parse_service_limit(as_pair(until), wrap_angles, cycles, coefficients)
    seed = int(draws.about.get("seed", 0)) if seed is None else seed
    with jax.enable_x64(True):
        answer = pool_cables(draws, limit, seed, None if measurements is None else Path(measurements))
    if output is not None:
        _write(answer, Path(output))
    return answer


def _write(answer: "Pool", folder: Path) -> None:
    """Figures, the page, the words and, last, the JSON, all of them or none: a folder that has it has everything."""
    from bowdenfit.plots.write import write_all
    from bowdenfit.questions.pool.figures import draw_figures
    from bowdenfit.questions.pool.sections import pool_page
    from bowdenfit.questions.pool.words import pool_text
    from bowdenfit.questions.writing import write_page
    from bowdenfit.results.folder import fill_folder_atomically, write_text
    from bowdenfit.results.serialization import plain_data
    from bowdenfit.words import printable

    page = f"{NAME}.json"
    with fill_folder_atomically(folder, page) as place:
        for name, figure in draw_figures(answer).items():
            write_all(figure, place, name)
        write_page(pool_page(answer), place, place / f"{NAME}.html")
        write_text(place / f"{NAME}.txt", printable(pool_text(answer)))
        write_text(place / page, json.dumps(plain_data(answer), indent=1, allow_nan=False) + "\n")


def parse_service_limit(
    until: NumberWithUnit | None, wrap_angles: Sequence[str], cycles: int | None, coefficients: Sequence[str]
) -> "ServiceLimit | None":
    """What life is until; None where it is not asked for.

    Raises:
        UsageError: Something is missing, or cannot be.
    """
    from bowdenfit.errors import UsageError
    from bowdenfit.questions.pool.answer import ServiceLimit
    from bowdenfit.units import conversion_factor

    if until is None:
        if wrap_angles or cycles is not None:
            raise UsageError(
                "--wrap-angle and --cycles ask how long cables last; say until which efficiency, as --until 60%."
            )
        return None
    value, unit = until
    efficiency = value * conversion_factor(unit, "ratio")
    if not 0 < efficiency < 1:
        raise UsageError(f"--until {value:g}{unit} is no efficiency that a cable falls to; write it as 60% or 0.6 1.")
    angles = dict(_parse_wrap_angle(text) for text in wrap_angles)
    wrong = [name for name in angles if name not in coefficients]
    missing = [name for name in coefficients if name not in angles]
    if wrong or missing:
        what = f"there is no coefficient {wrong[0]!r}" if wrong else f"none is said for {missing[0]}"
        example = " ".join(f"--wrap-angle {name}=90deg" for name in coefficients)
        raise UsageError(f"how long a cable lasts depends on its wrap angles, and {what}; write {example}, with yours.")
    return ServiceLimit(efficiency, {name: angles[name] for name in coefficients}, None if cycles is None else float(cycles))


def _parse_wrap_angle(text: str) -> tuple[str, float]:
    """Coefficient and wrap angle [rad] of an option such as mu_sheath=180deg.

    Raises:
        UsageError: It is something else, or no angle that a cable wraps.
    """
    from bowdenfit.errors import DatasetError, UsageError
    from bowdenfit.units import conversion_factor
    from bowdenfit.words import shown

    match = _ANGLE_OPTION.fullmatch(text.strip())
    try:
        angle = float(match["value"]) * conversion_factor(match["unit"], "angle") if match else math.nan
    except DatasetError:
        angle = math.nan
    if match is None or not 0 <= angle < _MOST_TURNS * 2 * math.pi:
        raise UsageError(
            f"--wrap-angle {shown(text)} is no coefficient with its wrap angle; write it as mu_sheath=180deg."
        )
    return match["name"].strip(), angle


def _reply(answer: "Pool", options: dict[str, Any]) -> Reply:
    from bowdenfit.questions.pool.words import pool_text

    notes = (f"Wrote {options['output']}.",) if options["output"] else ()
    return Reply(pool_text(answer), lambda: answer, notes, 0 if answer.is_trusted else NOT_TRUSTED, answer.to_csv)


VERB = Verb(
    pool,
    _reply,
    """Look at the cables of a fleet together: wear and life.

    FLEET is a results folder that `bowdenfit fleet` wrote. The answer says how
    friction grows with cycles, what lubrication and temperature do, how much cables
    differ, and what a new one will be like; each cable is drawn toward the others
    as far as its own inspections leave it open. It names cables that are unlike the
    rest, which are shown by their own inspections alone, and what to inspect next.

    With --until and a --wrap-angle for each coefficient: how many cycles each cable
    and a new one last, and with --cycles the probability of failing before. With
    --measurements, the folder that was fitted, cables of which single fits tell too
    little are pooled by their readings; without it they are named. Exit code 3:
    must not be trusted.
    """,
    csv="Print cables as CSV, a row a quantity.",
)
