"""Divide a fleet into pieces of work of one model each, and gather the fits into the answer and its draws."""

import json
import math
import secrets
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import jax
import numpy as np

from bowdenfit.addons.fleet.answer import FailedInspection, FittedInspection, Fleet
from bowdenfit.addons.fleet.folder import CHECKSUM, FLEET_DRAWS, FLEET_PAGE, FleetDraws, write_fleet_draws
from bowdenfit.addons.fleet.inspections import Case, Inspection, read_cases, refuse_if_none_usable
from bowdenfit.addons.fleet.pieces import Example, Piece, PieceFit, fit_piece
from bowdenfit.addons.fleet.store import SEPARATOR, FleetStore, read_start
from bowdenfit.arguments import LARGEST_SEED
from bowdenfit.description import SamplerSettings
from bowdenfit.errors import StoreError, UsageError
from bowdenfit.inference.batch.programs import CHUNK, BatchSettings
from bowdenfit.inference.draws import derived_units
from bowdenfit.inference.engines import JOBS_FOLDER, Engine, installed_versions, open_engine
from bowdenfit.inference.interval import Interval
from bowdenfit.inference.resources import keep_compiled_programs
from bowdenfit.models import Model, build_model
from bowdenfit.outputs import write_text
from bowdenfit.reading import Reading
from bowdenfit.results.answer_cache import file_checksum
from bowdenfit.results.folder import SUMMARY_TEXT, fill_folder_atomically
from bowdenfit.results.serialization import plain_data
from bowdenfit.stages import announce_stage
from bowdenfit.words import counted, printable

# Standard deviations to a twentieth: a tenth is then hardly ever exceeded by more than half as much.
SETTINGS = BatchSettings(
    SamplerSettings(n_ensembles=2, n_walkers=64, max_steps=20_000, target_ess=400, target_r_hat=1.03),
    target_sd_error=0.05,
)
# Data sets of a piece, a judgement: the largest is what is lost when a fleet is interrupted.
_SMALLEST, _LARGEST = CHUNK, 8 * CHUNK


def divide_into_pieces(
    cases: Sequence[Case], seed: int, settings: BatchSettings, workers: int, largest: int = _LARGEST
) -> list[Piece]:
    """Divide the work by model; no result depends on how it is divided.

    Args:
        cases: Inspections to fit.
        seed: Seed of the fleet.
        settings: How carefully.
        workers: At a time.
        largest: Data sets of a piece.
    """
    pieces = list[Piece]()
    for key, members in _group_by_shape(cases).items():
        share = -(-len(members) // (4 * workers))  # so that all workers end at about the same time
        size = min(max(-(-share // CHUNK) * CHUNK, _SMALLEST), largest)
        example = Example(key, members[0].dataset)
        for part in (members[i : i + size] for i in range(0, len(members), size)):
            names, data = tuple(case.hash for case in part), tuple(case.shaped.data for case in part)
            pieces.append(Piece(example, settings, names, data, tuple(case.seed(seed) for case in part), installed_versions()))
    return pieces


def _group_by_shape(cases: Sequence[Case]) -> dict[str, list[Case]]:
    shapes: dict[str, list[Case]] = {}
    for case in cases:
        shapes.setdefault(case.shaped.key, []).append(case)
    return shapes


def describe_quantities(model: Model) -> dict[str, dict[str, str]]:
    """Return unit, symbol, meaning, role and prior of every quantity that a fit draws, in order.

    Args:
        model: Model that was fitted.
    """
    quantities: dict[str, dict[str, str]] = {}
    for p in model.space.free:
        numbers = {f.name: getattr(p.prior, f.name) for f in fields(p.prior)}  # type: ignore[arg-type]
        prior = json.dumps({"kind": type(p.prior).__name__, **numbers})
        quantities[p.name] = {"units": p.unit, "symbol": p.symbol, "long_name": p.meaning, "role": p.role}
        if not p.scaled_by:  # else each data set has its own
            quantities[p.name]["prior"] = prior
    derived = {name: {"units": unit, "symbol": symbol} for name, (unit, symbol) in derived_units(model).items()}
    return quantities | derived


def _describe_coefficients(model: Model) -> dict[str, str]:
    """Describe in words the contacts of each friction coefficient; equal words mean equal coefficients."""
    option = model.description.friction_model
    contacts: dict[str, list[str]] = {}
    for contact in model.description.contact:
        law = f" by {contact.special_law}" if contact.special_law else ""
        contacts.setdefault(contact.friction, []).append(f"friction of {contact.name}{law}")
    special = "" if option == "capstan" else f", {option}"
    return {name: f"{' and '.join(names)}{special}" for name, names in contacts.items()}


def gather_results(
    name: str, cases: Sequence[Case], fits: Mapping[str, PieceFit], broken: Sequence[FailedInspection], seed: int
) -> tuple[Fleet, FleetDraws | None]:
    """Gather the answer, and the draws of all fitted inspections; None where none could be fitted.

    Args:
        name: Name of the fleet.
        cases: Inspections that were fitted, in the order of cables and cycles.
        fits: Fit of each, by the hash of its input.
        broken: Inspections that could not be read.
        seed: Seed of the fleet.
    """
    shapes = _group_by_shape(cases)
    models = {key: build_model(members[0].dataset) for key, members in shapes.items()}
    quantities = {key: describe_quantities(model) for key, model in models.items()}
    fitted_cases = [case for case in cases if len(fits[case.hash].values)]
    for case in fitted_cases:  # what was kept may have been changed
        if fits[case.hash].values.shape != (
            len(quantities[case.shaped.key]),
            fits[fitted_cases[0].hash].values.shape[1],
        ):
            raise StoreError(f"what was kept of {case.inspection.label} is damaged; start over with --force.")
    failed = [
        FailedInspection(c.inspection.label, fits[c.hash].reasons[0]) for c in cases if not len(fits[c.hash].values)
    ]
    numbers = {key: i for i, key in enumerate(shapes, start=1)}
    fitted = tuple(
        _summarize_inspection(case, fits[case.hash], quantities[case.shaped.key], numbers[case.shaped.key])
        for case in fitted_cases
    )
    all_quantities: dict[str, dict[str, str]] = {}
    for shape_quantities in quantities.values():
        all_quantities |= {
            quantity: attributes for quantity, attributes in shape_quantities.items() if quantity not in all_quantities
        }
    units = {quantity: attributes["units"] for quantity, attributes in all_quantities.items()}
    words = tuple(
        _describe_shape(number, members) for number, members in zip(numbers.values(), shapes.values(), strict=True)
    )
    answer = Fleet(name, fitted, (*broken, *failed), units, words, seed, dict(installed_versions()))
    meanings = {key: _describe_coefficients(model) for key, model in models.items()}
    return answer, _collect_draws(
        answer, fitted_cases, fits, quantities, all_quantities, meanings
    ) if fitted_cases else None


def _describe_shape(number: int, members: Sequence[Case]) -> str:
    cables = list(dict.fromkeys(case.inspection.cable for case in members))
    return f"model {number} for {counted(len(members), 'inspection')} ({cables[0]}{' and others' if len(cables) > 1 else ''})"


def _summarize_inspection(case: Case, fit: PieceFit, quantities: Mapping[str, Any], shape: int) -> FittedInspection:
    inspection, lubricated = case.inspection, case.inspection.lubricated
    intervals = {name: Interval.of(draws) for name, draws in zip(quantities, fit.values, strict=True)}
    flag = None if math.isnan(lubricated) else bool(lubricated)
    numbers = fit.engine, fit.pareto_k, fit.n_effective, fit.reasons
    return FittedInspection(
        inspection.label, inspection.cable, inspection.cycles, inspection.temperature, flag, shape, *numbers, intervals
    )


def _collect_draws(
    answer: Fleet,
    cases: Sequence[Case],
    fits: Mapping[str, PieceFit],
    quantities: Mapping[str, Mapping[str, Any]],
    attributes: Mapping[str, Mapping[str, str]],
    meanings: Mapping[str, Mapping[str, str]],
) -> FleetDraws:
    """Collect all draws in one data set; NaN where an inspection has no such quantity."""
    draws_by_case = [dict(zip(quantities[c.shaped.key], fits[c.hash].values, strict=True)) for c in cases]
    count = fits[cases[0].hash].values.shape[1]
    missing = np.full(count, np.nan)
    values = {name: np.stack([own.get(name, missing) for own in draws_by_case]) for name in attributes}
    case_fits = [fits[c.hash] for c in cases]
    texts = {
        "engine": [fit.engine for fit in case_fits],
        "reasons": [SEPARATOR.join(fit.reasons) for fit in case_fits],
        "shape": [case.shaped.key for case in cases],
        "input": [case.hash for case in cases],
    }
    stats: dict[str, np.ndarray] = {name: np.array(column, dtype=object) for name, column in texts.items()}
    stats |= {name: np.array([getattr(fit, name) for fit in case_fits]) for name in ("pareto_k", "n_effective")}
    stats["trusted"] = np.array([not fit.reasons for fit in case_fits])
    names = "cycles", "temperature", "lubricated"
    cycles, temperature, lubricated = (np.array([getattr(c.inspection, n) for c in cases]) for n in names)
    labels, cables = (tuple(getattr(c.inspection, n) for c in cases) for n in ("label", "cable"))
    about: dict[str, Any] = {"name": answer.name, "seed": answer.seed, "versions": answer.versions}
    about["meanings"] = meanings
    about["quantities"] = {key: list(shape_quantities) for key, shape_quantities in quantities.items()}
    return FleetDraws(labels, cables, cycles, temperature, lubricated, values, stats, attributes, about)


@dataclass(frozen=True)
class FleetOptions:
    """Options of fitting a fleet, and where its results go.

    Args:
        results: Results folder; None to write nothing.
        engine: Name of an engine, or an executor.
        workers: Number of processes or jobs; None for the default of the engine.
        seed: Random seed; None for that of the fleet to resume, or a new one.
        resume: Whether to continue an interrupted fleet.
        force: Whether to replace an earlier fleet.
    """

    results: Path | None
    engine: str | Executor
    workers: int | None
    seed: int | None
    resume: bool
    force: bool


def fit_fleet(
    folder: Path,
    inspections: list[Inspection],
    reading: Reading,
    options: FleetOptions,
    report: Callable[[int, int, float], None] | None,
) -> Fleet:
    """Fit all inspections of a fleet, and write the results.

    Args:
        folder: Folder of the measurements.
        inspections: Its inspections.
        reading: Keywords of `bowdenfit.read`.
        options: How, and where to.
        report: Called after every piece with inspections done, their total, and seconds per inspection.
    """
    place = options.results
    store, seed = _open_store(place, options.seed, options.resume)
    keep_compiled_programs()
    with jax.enable_x64(True):
        cases, broken = _read_all(folder, inspections, reading)
        jobs = place and place / JOBS_FOLDER
        announce_stage("compiling, and fitting the first cables")
        with open_engine(options.engine, options.workers, jobs, options.workers or 1) as opened:
            fits = store.open(options.resume, options.force) if store else {}
            _fit_pieces(opened, cases, seed, store, fits, report)
        answer, draws = gather_results(folder.resolve().name, cases, fits, broken, seed)
    if store is not None:
        _write_results(answer, draws, store)
    return answer


def _read_all(
    folder: Path, inspections: list[Inspection], reading: Reading
) -> tuple[list[Case], list[FailedInspection]]:
    """Read all data sets, and collect those that cannot be read or used."""
    cases_and_failures = list(read_cases(folder, inspections, reading))
    broken = [case for case in cases_and_failures if isinstance(case, FailedInspection)]
    cases = [case for case in cases_and_failures if not isinstance(case, FailedInspection)]
    refuse_if_none_usable(cases, broken)
    return cases, broken


def _open_store(place: Path | None, seed: int | None, resume: bool) -> tuple[FleetStore | None, int]:
    """Return the results folder and the seed: the stated one, that of the fleet to resume, or a new one."""
    if resume and place is None:
        raise UsageError("--resume needs the results folder of a fleet; name it with --output.")
    if seed is None:
        seed = int(read_start(place)["seed"]) if resume and place is not None else secrets.randbelow(LARGEST_SEED)
    return (None if place is None else FleetStore(place, {"seed": seed, "versions": installed_versions()})), seed


def _fit_pieces(
    opened: Engine[Any, list[PieceFit]],
    cases: list[Case],
    seed: int,
    store: FleetStore | None,
    fits: dict[str, PieceFit],
    report: Callable[[int, int, float], None] | None,
) -> None:
    """Fit the remaining cases, and save each piece when it is done."""
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


def _write_results(answer: Fleet, draws: FleetDraws | None, store: FleetStore) -> None:
    """Write draws, summary and, last, fleet.json, all of them or none; then remove the saved pieces."""
    with fill_folder_atomically(store.folder, FLEET_PAGE) as folder:
        if draws is not None:
            write_fleet_draws(folder / FLEET_DRAWS, draws)
        write_text(folder / SUMMARY_TEXT, printable(f"{answer}\n"))
        page = plain_data(answer) | {CHECKSUM: file_checksum(folder / FLEET_DRAWS)}
        write_text(folder / FLEET_PAGE, json.dumps(page, indent=1) + "\n")
    store.finish()
