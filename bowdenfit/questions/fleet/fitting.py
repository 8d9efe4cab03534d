"""From the data sets of a fleet to its draws and its answer: pieces of work by shape, and what they give in order."""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import fields
from typing import Any

import numpy as np

from bowdenfit.description import SamplerSettings
from bowdenfit.errors import StoreError
from bowdenfit.inference.batch.pieces import Example, Piece, PieceFit
from bowdenfit.inference.batch.programs import CHUNK, BatchSettings
from bowdenfit.inference.draws import derived_units
from bowdenfit.inference.engines import versions
from bowdenfit.inference.interval import Interval
from bowdenfit.model import Model, build_model
from bowdenfit.questions.fleet.answer import FailedInspection, FittedInspection, Fleet
from bowdenfit.questions.fleet.cases import Case
from bowdenfit.questions.fleet.store import SEPARATOR
from bowdenfit.results.fleet_folder import FleetDraws
from bowdenfit.words import counted

# Standard deviations to a twentieth: a tenth is then hardly ever exceeded by more than half as much.
SETTINGS = BatchSettings(
    SamplerSettings(n_ensembles=2, n_walkers=64, max_steps=20_000, target_ess=400, target_r_hat=1.03),
    target_sd_error=0.05,
)
_SMALLEST, _LARGEST = CHUNK, 8 * CHUNK  # data sets of a piece; what is lost when a fleet is interrupted


def divide_into_pieces(
    cases: Sequence[Case], seed: int, settings: BatchSettings, workers: int, largest: int = _LARGEST
) -> list[Piece]:
    """The work, by shape; how it is cut decides nothing of what comes of a data set.

    Args:
        cases: What is to be fitted.
        seed: Of the fleet.
        settings: How carefully.
        workers: At a time.
        most: Data sets of a piece.
    """
    pieces = list[Piece]()
    for key, members in _group_by_shape(cases).items():
        share = -(-len(members) // (4 * workers))  # so that all workers end at about the same time
        size = min(max(-(-share // CHUNK) * CHUNK, _SMALLEST), largest)
        example = Example(key, members[0].dataset)
        for part in (members[i : i + size] for i in range(0, len(members), size)):
            names, data = tuple(case.hash for case in part), tuple(case.shaped.data for case in part)
            pieces.append(Piece(example, settings, names, data, tuple(case.seed(seed) for case in part), versions()))
    return pieces


def _group_by_shape(cases: Sequence[Case]) -> dict[str, list[Case]]:
    shapes: dict[str, list[Case]] = {}
    for case in cases:
        shapes.setdefault(case.shaped.key, []).append(case)
    return shapes


def describe_quantities(model: Model) -> dict[str, dict[str, str]]:
    """What a fit draws, in order: of each quantity unit, symbol, meaning, role and prior.

    Args:
        model: What was fitted.
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
    """What each friction coefficient is of, in words; two are the same where these are."""
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
    """The answer, and the draws of all that could be fitted; None where nothing could be.

    Args:
        name: Of the fleet.
        cases: What was fitted, in the order of cables and cycles.
        fits: What came of each, by the hash of its input.
        broken: What could not be read.
        seed: Of the fleet.
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
    answer = Fleet(name, fitted, (*broken, *failed), units, words, seed, dict(versions()))
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
    """All draws in one; NaN where a data set has no such quantity."""
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
