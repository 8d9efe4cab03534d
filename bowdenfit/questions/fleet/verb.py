"""Fitting many cables at once, each kept as soon as it is done."""

import json
import secrets
import time
from collections.abc import Callable
from concurrent.futures import Executor
from datetime import timedelta
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Unpack

from cyclopts import Parameter

from bowdenfit.arguments import HIDDEN, LARGEST_SEED, PATH, Output, Seed, read_first, whole_number
from bowdenfit.inference.resources import keep_compiled_programs, refuse_low_memory
from bowdenfit.reading import Reading
from bowdenfit.verb import NOT_TRUSTED, Reply, Verb, Watch

if TYPE_CHECKING:
    from bowdenfit.inference.batch.pieces import PieceFit
    from bowdenfit.inference.engines import Engine
    from bowdenfit.questions.fleet.answer import FailedInspection, Fleet
    from bowdenfit.questions.fleet.cases import Case
    from bowdenfit.questions.fleet.inspections import Inspection
    from bowdenfit.questions.fleet.store import FleetStore
    from bowdenfit.results.fleet_folder import FleetDraws

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
    seed: Annotated[Seed, Parameter(show_default="drawn, and recorded")] = None,
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
        seed: Seed of everything random.
        resume: Go on with an interrupted fleet, or add cables and inspections.
        force: Replace an earlier fleet in the results folder.
        progress: Called after every piece of work with inspections done, of how many, and seconds so far.
        reading: Keywords of `bowdenfit.read`.

    Raises:
        BowdenfitError: What is wrong, in a sentence; broken inspections are named in the answer, and the rest goes on.
    """
    import bowdenfit.questions.fleet.words  # noqa: F401  (what the answer says of itself)
    from bowdenfit.questions.fleet.inspections import read_inspections
    from bowdenfit.results.folder import reserve_folder
    from bowdenfit.verb import show_progress_bar

    refuse_low_memory()
    place = Path(output) if output is not None else None
    inspections = read_inspections(Path(folder))
    with reserve_folder(place), show_progress_bar(WATCH, progress) as show:
        import jax

        from bowdenfit.inference.engines import JOBS_FOLDER, open_engine
        from bowdenfit.questions.fleet.fitting import gather_results

        store, seed = _store(place, seed, resume)
        keep_compiled_programs()
        with jax.enable_x64(True):
            cases, broken = _read(Path(folder), inspections, reading)
            with open_engine(engine, workers, place and place / JOBS_FOLDER, workers or 1) as opened:
                fits = store.open(resume, force) if store else {}
                _fit(opened, cases, seed, store, fits, show)
            answer, draws = gather_results(Path(folder).resolve().name, cases, fits, broken, seed)
        if store is not None:
            _write(answer, draws, store)
    return answer


def _read(
    folder: Path, inspections: "list[Inspection]", reading: Reading
) -> "tuple[list[Case], list[FailedInspection]]":
    """What can be fitted, and what is broken."""
    from bowdenfit.questions.fleet.answer import FailedInspection
    from bowdenfit.questions.fleet.cases import read_cases, refuse_if_none_usable

    cases_and_failures = list(read_cases(folder, inspections, reading))
    broken = [case for case in cases_and_failures if isinstance(case, FailedInspection)]
    cases = [case for case in cases_and_failures if not isinstance(case, FailedInspection)]
    refuse_if_none_usable(cases, broken)
    return cases, broken


def _store(place: Path | None, seed: int | None, resume: bool) -> "tuple[FleetStore | None, int]":
    """The results folder, and the seed: as stated, else that of the fleet to go on with, else a new one."""
    from bowdenfit.errors import UsageError
    from bowdenfit.inference.engines import versions
    from bowdenfit.questions.fleet.store import FleetStore, read_start

    if resume and place is None:
        raise UsageError("--resume needs the results folder of a fleet; name it with --output.")
    if seed is None:
        seed = int(read_start(place)["seed"]) if resume and place is not None else secrets.randbelow(LARGEST_SEED)
    return (None if place is None else FleetStore(place, {"seed": seed, "versions": versions()})), seed


def _fit(
    opened: "Engine[Any, list[PieceFit]]",
    cases: "list[Case]",
    seed: int,
    store: "FleetStore | None",
    fits: "dict[str, PieceFit]",
    report: Report | None,
) -> None:
    """Fit what is left, and keep each piece as it ends."""
    from bowdenfit.inference.batch.pieces import fit_piece
    from bowdenfit.questions.fleet.fitting import SETTINGS, divide_into_pieces

    todo = [case for case in cases if case.hash not in fits]
    begin, before, total = time.monotonic(), len(cases) - len(todo), len(cases)
    done = before
    pieces = divide_into_pieces(todo, seed, SETTINGS, opened.workers, opened.max_datasets)
    for piece_fits in opened.results(fit_piece, pieces):
        if store is not None:
            store.keep(piece_fits)
        fits |= {fit.name: fit for fit in piece_fits}
        done += len(piece_fits)
        if report is not None:
            report(done, total, (time.monotonic() - begin) / (done - before))


def _write(answer: "Fleet", draws: "FleetDraws | None", store: "FleetStore") -> None:
    """The draws, the summary and, last, fleet.json, all of them or none; what was kept of pieces is not needed then."""
    from bowdenfit.questions.fleet.words import fleet_text
    from bowdenfit.results.answer_cache import file_checksum
    from bowdenfit.results.fleet_folder import CHECKSUM, FLEET_DRAWS, FLEET_PAGE, write_fleet_draws
    from bowdenfit.results.folder import SUMMARY_TEXT, fill_folder_atomically, write_text
    from bowdenfit.results.serialization import plain_data
    from bowdenfit.words import printable

    with fill_folder_atomically(store.folder, FLEET_PAGE) as folder:
        if draws is not None:
            write_fleet_draws(folder / FLEET_DRAWS, draws)
        write_text(folder / SUMMARY_TEXT, printable(fleet_text(answer)))
        page = plain_data(answer) | {CHECKSUM: file_checksum(folder / FLEET_DRAWS)}
        write_text(folder / FLEET_PAGE, json.dumps(page, indent=1) + "\n")
    store.finish()


def _reply(answer: "Fleet", options: dict[str, Any]) -> Reply:
    from bowdenfit.questions.fleet.words import fleet_text

    exit_code = 0 if answer.is_trusted else NOT_TRUSTED
    return Reply(fleet_text(answer), lambda: answer, (f"Wrote {options['output']}.",), exit_code, answer.to_csv)


def _show(bar: Any, done: int, total: int, seconds: float) -> None:
    """How many are done, how many a minute, and how long the rest will take."""
    bar.total, bar.n = total, done
    left = timedelta(seconds=round(seconds * (total - done)))
    bar.set_postfix_str(f"{60 / max(seconds, 1e-9):.0f} cables a minute, {left} left", refresh=False)
    bar.refresh()


_BAR = {"unit": "cable", "desc": "fitting", "bar_format": "{desc} {n_fmt} of {total_fmt} cables, {elapsed}{postfix}"}
WATCH = Watch("kept", "what is done is kept in", _BAR, _show)
VERB = Verb(
    fleet,
    _reply,
    """Fit many cables, inspected again and again.

    Every inspection of every cable in FOLDER is fitted by itself, many in one
    program, on one machine or a cluster, into one fleet.nc.

    FOLDER has fleet.csv, a row an inspection with the columns cable, cycles,
    temperature_degC, lubricated and file, and fleet.toml, which says of all of them
    what cable.toml says of one; or a folder for each cable with a cable.toml of its
    own, or CABLE/CYCLES/cable.toml. datasets/synthetic-fleet is one.

    What is done is kept piece by piece; --resume goes on, with cables that were
    added too. Broken inspections are named, and the others are fitted. Exit code 3:
    some could not be fitted, or must not be trusted.
    """,
    json="Print fleet.json instead of the summary for people.",
    csv="Print medians and intervals of all inspections as CSV, one a row.",
    results="fits",
    watch=WATCH,
)
