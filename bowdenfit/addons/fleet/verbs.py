"""The verbs `fleet`, which fits many cables at once and saves each as soon as it is done, and `pool`."""

from collections.abc import Callable
from concurrent.futures import Executor
from datetime import timedelta
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Unpack

from cyclopts import Parameter

from bowdenfit.addons import fleet as _fleet
from bowdenfit.addons.fleet.pool.verb import POOL
from bowdenfit.arguments import HIDDEN, PATH, Output, Seed, read_first, whole_number
from bowdenfit.inference.resources import refuse_low_memory
from bowdenfit.reading import Reading
from bowdenfit.results.folder import reserve_folder
from bowdenfit.stage_bar import Watch, show_progress_bar
from bowdenfit.verb import NOT_TRUSTED, Reply, Verb

if TYPE_CHECKING:
    from bowdenfit.addons.fleet.answer import Fleet

FOLDER = Parameter("FOLDER", help="Such as my-fleet, with its fleet.toml and fleet.csv.")
Report = Callable[[int, int, float], None]
_WORKERS = "this process, with threads; 16 jobs of Slurm"


@read_first
def fleet(
    folder: Annotated["str | Path", FOLDER, PATH],
    *,
    output: Annotated[Output, Parameter(show_default="fits/NAME OF FOLDER")] = None,
    engine: Annotated["str | Executor", Parameter(metavar="ENGINE")] = "local",
    workers: Annotated[
        int | None, Parameter(alias="-j", metavar="NUMBER", show_default=_WORKERS), whole_number(1)
    ] = None,
    seed: Annotated[Seed, Parameter(show_default="random, and recorded")] = None,
    resume: bool = False,
    force: bool = False,
    progress: Annotated[Report | None, HIDDEN] = None,
    **reading: Unpack[Reading],
) -> "Fleet":
    """Fit every inspection of every cable by itself, many in one program; nothing depends on engine, workers or order.

    Args:
        folder: With fleet.csv (cable, cycles, temperature_degC, lubricated, file) and fleet.toml, which describes the cables
            as a cable.toml does; or with a folder that has a cable.toml for each cable, or for its inspections by cycles.
        output: Results folder.
        engine: local (this machine), dask://HOST:PORT or slurm; or any `concurrent.futures.Executor`.
        workers: Processes here, each of which loads and compiles all over again, or jobs at a time.
        seed: Random seed.
        resume: Go on with an interrupted fleet, or add cables and inspections.
        force: Replace an earlier fleet in the results folder.
        progress: Called after every piece of work with inspections done, of how many, and seconds so far.
        reading: Keywords of `bowdenfit.read`.

    Raises:
        BowdenfitError: What is wrong, in a sentence; broken inspections are named in the answer, and the rest goes on.
    """
    refuse_low_memory()
    results = Path(output) if output is not None else None
    inspections = _fleet.read_inspections(Path(folder))
    with reserve_folder(results), show_progress_bar(WATCH, progress) as report:
        options = _fleet.FleetOptions(results, engine, workers, seed, resume, force)
        return _fleet.fit_fleet(Path(folder), inspections, reading, options, report)


def _reply(answer: "Fleet", options: dict[str, Any]) -> Reply:
    exit_code = 0 if answer.is_trusted else NOT_TRUSTED
    return Reply(f"{answer}\n", lambda: answer, (f"Wrote {options['output']}.",), exit_code, answer.to_csv)


def _show(bar: Any, done: int, total: int, seconds: float) -> None:
    """Show how many are done, how many a minute, and how long the rest will take."""
    bar.total, bar.n = total, done
    left = timedelta(seconds=round(seconds * (total - done)))
    bar.set_postfix_str(f"{60 / max(seconds, 1e-9):.0f} cables a minute, {left} left", refresh=False)
    bar.refresh()


_BAR = {"unit": "cable", "desc": "fitting", "bar_format": "{desc} {n_fmt} of {total_fmt} cables, {elapsed}{postfix}"}
WATCH = Watch("kept", "what is done is kept in", _BAR, _show)
FLEET = Verb(
    fleet,
    _reply,
    """Fit many cables, inspected again and again.

    Every inspection of every cable in FOLDER is fitted by itself, many in one
    program, on one machine or a cluster, into one fleet.nc.

    FOLDER has fleet.csv, a row an inspection with the columns cable, cycles,
    temperature_degC, lubricated and file, and fleet.toml, which describes all of
    them as a cable.toml describes one; or a folder for each cable with a cable.toml of its
    own, or CABLE/CYCLES/cable.toml. datasets/synthetic-fleet is one.

    What is done is kept piece by piece; --resume goes on, with cables that were
    added too. Broken inspections are named, and the others are fitted. Exit code 3:
    some could not be fitted, or must not be trusted.
    """,
    json="Print fleet.json instead of the text summary.",
    csv="Print medians and intervals of all inspections as CSV, one a row.",
    results="fits",
    watch=WATCH,
    reads="fleet.toml",
    referral="the folder holds a fleet: `bowdenfit fleet {folder}` reads, checks and fits all of its cables",
)

__all__ = ["FLEET", "POOL", "fleet"]
