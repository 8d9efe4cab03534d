"""A fit to its results folder, and back bit for bit."""

import json
from collections.abc import Callable, Mapping
from dataclasses import asdict, fields, is_dataclass, replace
from pathlib import Path
from types import NoneType, UnionType
from typing import Any, get_args, get_origin, get_type_hints

import numpy as np
from jaxtyping import AbstractArray

from bowdenfit.dataset import Dataset
from bowdenfit.description.file import parse_description
from bowdenfit.errors import StoreError
from bowdenfit.inference.diagnostics import Diagnostics
from bowdenfit.inference.disagreement import Disagreement
from bowdenfit.inference.draws import derived_units
from bowdenfit.inference.least_squares import Estimate, LeastSquares
from bowdenfit.inference.samplers import SamplerAgreement
from bowdenfit.inference.trajectories import Trajectories
from bowdenfit.kinds import KINDS, each_table
from bowdenfit.kinds.measurements import Measurements
from bowdenfit.results.folder import CHAIN, FIT, POSTERIOR, SUMMARY, made, write_text
from bowdenfit.results.netcdf import EXPECTED, Coordinates, Groups, read_groups, write_groups
from bowdenfit.results.record import OPTIMAL_EFFICIENCY, OPTIMAL_LENGTH, Draws, Provenance, Record
from bowdenfit.types import Flags, Labels, Matrix

SCHEMA = 4
LOG_POSTERIOR = "lp"
Migration = Callable[[dict[str, Any]], dict[str, Any]]


def _to_schema_2(page: dict[str, Any]) -> dict[str, Any]:
    """Before velocities and recordings were read."""
    measured = page["measurements"] | {"recordings": None}
    if measured["forces"] is not None:
        rows = len(measured["forces"]["run"])
        measured["forces"] = measured["forces"] | {"velocity": [None] * rows, "velocity_unit": ""}
    return page | {"schema": 2, "measurements": measured}


def _to_schema_3(page: dict[str, Any]) -> dict[str, Any]:
    """Before stretch, preload and loops were read."""
    measured = page["measurements"] | dict.fromkeys(("stretch", "preload", "loop"))
    if measured["recordings"] is not None:
        measured["recordings"] = measured["recordings"] | {"loop": False}
    squares = page["least_squares"] | {"disagreements": []}
    return page | {"schema": 3, "measurements": measured, "least_squares": squares}


def _to_schema_4(page: dict[str, Any]) -> dict[str, Any]:
    """Before there was a second sampler, and least squares had intervals."""
    posterior, squares = page["posterior"], page["least_squares"]
    estimates = {
        name: estimate | {"lower": None, "upper": None, "at_bound": estimate["remark"].startswith("no finite minimum")}
        for name, estimate in squares["estimates"].items()
    }
    if posterior is not None:
        posterior = posterior | {"sampler": "emcee", "trajectories": None, "agreement": None}
    return page | {"schema": 4, "posterior": posterior, "least_squares": squares | {"estimates": estimates}}


MIGRATIONS: Mapping[int, Migration] = {1: _to_schema_2, 2: _to_schema_3, 3: _to_schema_4}  # from schema N to N + 1


def save(
    fit: Record,
    summary: Mapping[str, Any],
    folder: Path,
    force: bool = False,
    write_posterior: Callable[..., Any] | None = None,
) -> None:
    """Write posterior.nc, summary.json and, last, fit.json.

    Args:
        fit: The fit.
        summary: Contents of summary.json.
        folder: Where to; made if missing.
        force: Whether a finished fit there may be replaced.
        write_posterior: What writes posterior.nc, if another process does; it is written here if omitted.

    Raises:
        StoreError: The folder holds a finished fit already, or cannot be written.
    """
    if not force and (folder / FIT).exists():
        raise StoreError(f"{folder} holds a finished fit already; add --force (force=True) to replace it.")
    with made(folder):
        if fit.posterior is None:
            (folder / POSTERIOR).unlink(missing_ok=True)
        elif write_posterior is None:
            write_groups(folder / POSTERIOR, *posterior_page(fit))
        else:
            write_posterior()
        write_text(folder / SUMMARY, json.dumps(summary, indent=1) + "\n")
        write_text(folder / FIT, json.dumps(_fit_page(fit), indent=1) + "\n")


def load(folder: Path) -> Record:
    """Read a results folder.

    Raises:
        StoreError: It is missing, unfinished, damaged, or of a newer schema.
    """
    page = _migrated(_read_page(folder), folder)
    try:
        dataset = Dataset(parse_description(page["description"]), _measurements(page["measurements"]), page["sha256"])
        squares = _least_squares(page["least_squares"])
        posterior = _posterior(folder / POSTERIOR, page["posterior"]) if page["posterior"] else None
        verdict = page["verdict"]
        provenance = Provenance(**page["provenance"])
    except (KeyError, TypeError, ValueError, OSError) as error:
        raise StoreError(
            f"{folder} is damaged ({type(error).__name__}: {error}); fit again, or restore the folder from a copy."
        ) from error
    return Record(dataset, squares, posterior, verdict["converged"], tuple(verdict["reasons"]), provenance)


def _read_page(folder: Path) -> dict[str, Any]:
    try:
        return json.loads((folder / FIT).read_text(encoding="utf-8"))
    except FileNotFoundError:
        if (folder / CHAIN).exists():
            raise StoreError(
                f"{folder} holds an interrupted fit; finish it with `bowdenfit fit ... --resume`."
            ) from None
        what = "is no results folder (it has no fit.json)" if folder.is_dir() else "does not exist"
        raise StoreError(f"{folder} {what}; name a folder that `bowdenfit fit` wrote, such as fits/NAME.") from None
    except (json.JSONDecodeError, UnicodeDecodeError):
        raise StoreError(f"{folder / FIT} is damaged; fit again, or restore the folder from a copy.") from None


def _migrated(page: dict[str, Any], folder: Path) -> dict[str, Any]:
    while page.get("schema", SCHEMA) < SCHEMA:
        page = MIGRATIONS[page["schema"]](page)
    if page.get("schema", SCHEMA) > SCHEMA:
        raise StoreError(f"{folder} was written by a newer bowdenfit (schema {page['schema']}); update bowdenfit.")
    return page


def _fit_page(fit: Record) -> dict[str, Any]:
    posterior = fit.posterior
    return {
        "schema": SCHEMA,
        "description": fit.dataset.description.to_json(),
        "sha256": fit.dataset.sha256,
        "verdict": {"converged": fit.converged, "reasons": list(fit.reasons)},
        "least_squares": _to_plain(asdict(fit.least_squares)),
        "posterior": _posterior_counts(posterior) if posterior else None,
        "provenance": asdict(fit.provenance),
        "measurements": _measurements_page(fit.dataset.measurements),
    }


def _measurements_page(measurements: Measurements) -> dict[str, Any]:
    tables = {kind.name: asdict(table) for kind, table in each_table(measurements)}
    return _to_plain({**dict.fromkeys(KINDS), **tables, "remarks": measurements.remarks})


def _posterior_counts(posterior: Draws) -> dict[str, Any]:
    """What is known of the draws as a whole; the draws themselves are in posterior.nc."""
    trajectories = posterior.trajectories
    if trajectories is not None:
        trajectories = replace(trajectories, statistics={})
    return {
        "n_ensembles": posterior.n_ensembles,
        "steps": posterior.steps,
        "acceptance": posterior.acceptance,
        "sampler": posterior.sampler,
        "trajectories": _to_plain(asdict(trajectories)) if trajectories else None,
        "agreement": _to_plain(asdict(posterior.agreement)) if posterior.agreement else None,
        "diagnostics": _to_plain({name: asdict(d) for name, d in posterior.diagnostics.items()}),
    }


def _to_plain(data: Any) -> Any:
    """Arrays as lists; NaN as None, infinity as the word for it, so that the file is standard JSON."""
    if isinstance(data, dict):
        return {key: _to_plain(value) for key, value in data.items()}
    if isinstance(data, np.ndarray):
        return _to_plain(data.tolist())
    if isinstance(data, list | tuple):
        return [_to_plain(value) for value in data]
    if isinstance(data, float) and not np.isfinite(data):
        return None if np.isnan(data) else "Infinity" if data > 0 else "-Infinity"
    return data


def _number(value: Any) -> float:
    return float("nan") if value is None else float(value)


def _array(value: list) -> np.ndarray:
    return np.array(
        [[_number(x) for x in row] if isinstance(row, list) else _number(row) for row in value], dtype=float
    )


def _measurements(page: Mapping[str, Any]) -> Measurements:
    tables = (_rebuilt(kind.table | None, page[name]) for name, kind in KINDS.items())
    return Measurements(tuple(table for table in tables if table is not None), tuple(page["remarks"]))


def _rebuilt(kind: Any, value: Any) -> Any:
    """A value of an annotated type from its plain form: dataclasses by their fields, arrays by their kind of number."""
    if value is None and NoneType in get_args(kind):
        return None
    options = [part for part in get_args(kind) if part is not NoneType]
    if isinstance(kind, UnionType):
        return _rebuilt(options[0], value)
    if isinstance(kind, type) and is_dataclass(kind):
        hints = get_type_hints(kind)
        return kind(**{f.name: _rebuilt(hints[f.name], value[f.name]) for f in fields(kind)})
    if kind in (Labels, Flags):
        return np.array(value, dtype=int if kind is Labels else bool)
    if kind is Matrix:
        return _array(value).reshape(len(value), len(value[0]) if value else 0)
    if isinstance(kind, type) and issubclass(kind, AbstractArray):
        return _array(value)
    if get_origin(kind) is tuple:
        parts = [options[0]] * len(value) if Ellipsis in options else options
        return tuple(_rebuilt(part, item) for part, item in zip(parts, value, strict=True))
    return _number(value) if kind is float else value


def _least_squares(page: Mapping[str, Any]) -> LeastSquares:
    estimates = {name: _rebuilt(Estimate, e) for name, e in page["estimates"].items()}
    return LeastSquares(
        estimates,
        {name: _number(value) for name, value in page["residual_sd"].items()},
        {name: _array(value) for name, value in page["readings"].items()},
        _number(page["condition_number"]),
        _number(page["sum_of_squares"]),
        _array(page["z"]),
        page["converged"],
        page["message"],
        tuple(Disagreement(**d) for d in page["disagreements"]),
    )


def posterior_page(fit: Record) -> tuple[Groups, Coordinates, dict[str, str], dict[str, dict[str, str]]]:
    """Contents of posterior.nc as plain data: groups of variables, the readings' labels, attributes of file and variables."""
    posterior, space = fit.posterior, fit.model.space
    assert posterior is not None  # the caller asked
    log_prior = -0.5 * np.sum(posterior.z**2 + np.log(2 * np.pi), axis=-1)
    log_likelihood = [np.sum(part, axis=-1) for part in posterior.log_likelihood.values()]
    groups = {
        "posterior": posterior.values | posterior.optimum,
        "unconstrained_posterior": {p.name: posterior.z[..., i] for i, p in enumerate(space.free)},
        "sample_stats": {LOG_POSTERIOR: sum(log_likelihood, log_prior)} | _trajectory_statistics(posterior),
        "log_likelihood": posterior.log_likelihood,
        "posterior_predictive": posterior.replicated,
        "predictions": {f"{EXPECTED}{name}": value for name, value in posterior.expected.items()},
        "prior": posterior.prior,
        "observed_data": {term.name: term.observed() for term in fit.model.terms},
    }
    labels = {term.name: term.labels for term in fit.model.terms}
    attributes = {"provenance": json.dumps(asdict(fit.provenance)), "name": fit.name}
    return groups, labels, attributes, _variable_attributes(fit)


def _trajectory_statistics(posterior: Draws) -> dict[str, np.ndarray]:
    """Statistics of the trajectory that led to each draw, under ArviZ's names; empty of emcee."""
    return dict(posterior.trajectories.statistics) if posterior.trajectories else {}


def _variable_attributes(fit: Record) -> dict[str, dict[str, str]]:
    """Unit, symbol and meaning of every variable in the posterior."""
    route = fit.dataset.description.route
    labels = {p.name: {"units": p.unit, "symbol": p.symbol, "long_name": p.meaning} for p in fit.model.space.free}
    labels |= {name: {"units": unit, "symbol": symbol} for name, (unit, symbol) in derived_units(fit.model).items()}
    if route is not None:
        labels[OPTIMAL_LENGTH] = {"units": route.unit, "symbol": "$l^*$", "long_name": f"optimal {route.variable}"}
        labels[OPTIMAL_EFFICIENCY] = {"units": "1", "symbol": r"$\eta^*$", "long_name": "efficiency at the optimum"}
    return labels


def _posterior(path: Path, page: Mapping[str, Any]) -> Draws:
    if not path.exists():
        raise StoreError(f"{path} is missing; fit again, or restore the folder from a copy.")
    groups = read_groups(path)
    values, z = groups["posterior"], groups["unconstrained_posterior"]
    optimum = {name: values.pop(name) for name in (OPTIMAL_LENGTH, OPTIMAL_EFFICIENCY) if name in values}
    statistics = {name: value for name, value in groups["sample_stats"].items() if name != LOG_POSTERIOR}
    return Draws(
        np.stack(list(z.values()), axis=-1),
        values,
        optimum,
        groups["log_likelihood"],
        {name.removeprefix(EXPECTED): value for name, value in groups["predictions"].items()},
        groups["posterior_predictive"],
        groups["prior"],
        {name: Diagnostics(**{k: _number(v) for k, v in d.items()}) for name, d in page["diagnostics"].items()},
        page["n_ensembles"],
        page["steps"],
        page["acceptance"],
        page["sampler"],
        _trajectories(page["trajectories"], statistics) if page["trajectories"] else None,
        _rebuilt(SamplerAgreement | None, page["agreement"]),
    )


def _trajectories(page: Mapping[str, Any], statistics: dict[str, np.ndarray]) -> Trajectories:
    numbers = {"energy_mixing": _number(page["energy_mixing"]), "step_size": _number(page["step_size"])}
    return Trajectories(**{**page, **numbers, "statistics": statistics})
