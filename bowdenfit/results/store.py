"""Save a fit to its results folder, and load it back bit for bit."""

import json
from collections.abc import Mapping
from dataclasses import asdict, replace
from pathlib import Path
from textwrap import shorten
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, get_type_hints

import numpy as np

from bowdenfit.dataset import Dataset
from bowdenfit.errors import BowdenfitError, StoreError
from bowdenfit.files.row_account import ExcludedReading
from bowdenfit.inference.diagnostics import as_chains
from bowdenfit.inference.draws import derived_units
from bowdenfit.inference.least_squares import LeastSquares
from bowdenfit.kinds import KINDS, iterate_tables
from bowdenfit.kinds.descriptions import parse_description
from bowdenfit.kinds.tables import Measurements
from bowdenfit.outputs import write_text
from bowdenfit.results.answer_cache import CHECKSUM, file_checksum, page_checksum, record_figure_data, write_answers
from bowdenfit.results.data_changes import locate_data_set
from bowdenfit.results.folder import CHAIN, FIGURE_DATA, FIT, POSTERIOR, SUMMARY, folder_to_write, read_page
from bowdenfit.results.netcdf import (
    DERIVED,
    EXPECTED,
    Coordinates,
    Groups,
    make_netcdf,
    read_groups_isolated,
    write_groups,
)
from bowdenfit.results.record import OPTIMAL_EFFICIENCY, OPTIMAL_LENGTH, Draws, Provenance, Record
from bowdenfit.results.serialization import deserialize, serialize, write_arrays

if TYPE_CHECKING:
    from xarray import DataTree

SCHEMA = 7  # counted up with every change of what files mean
LOG_POSTERIOR, WALKER = "lp", "walker"
EXCLUDED = "excluded"  # readings that the user leaves out, next to the tables
_SAMPLERS = "emcee", "nuts", "importance"
_WITHOUT_CHAINS = ("prior", "observed_data")  # groups of posterior.nc without chains
# What fit.json keeps of the draws; the draws themselves are in posterior.nc.
COUNTS = ("n_ensembles", "steps", "acceptance", "sampler", "trajectories", "pareto_k", "agreement", "diagnostics")


def save(
    fit: Record,
    summary: Mapping[str, Any],
    folder: Path,
    force: bool = False,
    answers: Mapping[str, Any] = MappingProxyType({}),
) -> None:
    """Write posterior.nc, summary.json, what is kept of answers and, last, fit.json.

    Args:
        fit: The fit.
        summary: Contents of summary.json.
        folder: Where to; made if missing.
        force: Whether a finished fit there may be replaced.
        answers: Plain data by question, from which they are answered again.

    Raises:
        StoreError: The folder holds a finished fit already, or cannot be written.
    """
    if not force and (folder / FIT).exists():
        raise StoreError(f"{folder} holds a finished fit already; add --force (force=True) to replace it.")
    with folder_to_write(folder):
        (folder / FIT).unlink(missing_ok=True)  # of another posterior.nc
        if fit.sampled is None:
            (folder / POSTERIOR).unlink(missing_ok=True)
        else:
            write_groups(folder / POSTERIOR, *posterior_page(fit))
        write_text(folder / SUMMARY, json.dumps(summary, indent=1) + "\n")
        page = _fit_page(fit) | locate_data_set(fit.dataset.folder, folder)
        text = _fit_text(page | {"posterior_crc32": file_checksum(folder / POSTERIOR)}, fit.dataset.measurements)
        (folder / FIGURE_DATA).unlink(missing_ok=True)
        write_answers(folder, answers, text)
        write_text(folder / FIT, text)


def save_figure_data(figures: Mapping[str, Any], folder: Path) -> None:
    """Write what figures show beside a finished fit, so that they are drawn again without its model.

    Args:
        figures: Data of figures by name.
        folder: The results folder, in which the fit is.

    Raises:
        StoreError: The folder cannot be written.
    """
    with folder_to_write(folder):
        write_arrays(folder / FIGURE_DATA, figures)
        record_figure_data(folder)


_DAMAGE_ERRORS = (LookupError, TypeError, ValueError, AttributeError, ArithmeticError, RuntimeError)  # over what was changed


def load(folder: Path) -> Record:
    """Read a results folder.

    Raises:
        StoreError: It is missing, unfinished, edited, damaged, or of another schema.
    """
    page = _read_page(folder)
    try:
        sha256 = deserialize(dict[str, str], page["sha256"])
        dataset = Dataset(parse_description(page["description"]), _measurements(page["measurements"]), sha256)
        squares = deserialize(LeastSquares, page["least_squares"])
        as_written = page["posterior_crc32"] == file_checksum(folder / POSTERIOR)
        if page["posterior"] and (folder / POSTERIOR).exists() and not as_written:
            remedy = "fit again, or restore the folder from a copy."
            raise StoreError(f"{folder / POSTERIOR} has changed since it was written; {remedy}")
        posterior = _posterior(folder / POSTERIOR, page["posterior"]) if page["posterior"] else None
        verdict = deserialize(bool, page["verdict"]["converged"]), deserialize(tuple[str, ...], page["verdict"]["reasons"])
        provenance = deserialize(Provenance, page["provenance"])
        fit = Record(dataset, squares, posterior, *verdict, provenance)
        _refuse_other_contents(fit)
    except StoreError:
        raise
    except (*_DAMAGE_ERRORS, OSError, BowdenfitError) as error:
        reason = f"{type(error).__name__}: {shorten(str(error), 200)}"
        raise StoreError(f"{folder} is damaged ({reason}); fit again, or restore the folder from a copy.") from error
    return fit


def _refuse_other_contents(fit: Record) -> None:
    """Refuse a fit that does not hold what its model says: other parameters or readings, or numbers that no fit can have.

    Raises:
        ValueError: It does not.
    """
    model, squares = fit.model, fit.least_squares
    readings = {term.name: (len(term.labels),) for term in model.terms}
    _refuse_other_arrays("least squares", {"z": squares.z}, {"z": (model.space.size,)})
    _refuse_other_arrays("least squares", squares.readings, readings)
    if not set(squares.estimates) <= {p.name for p in model.space.parameters}:
        raise ValueError("estimates of other parameters")
    if (draws := fit.sampled) is None:
        return
    rows = draws.z.shape[:2]
    if len(rows) != 2 or 0 in rows or draws.n_ensembles < 1 or rows[0] % draws.n_ensembles or draws.sampler not in _SAMPLERS:
        raise ValueError("draws that no sampler gives")
    free, derived = {p.name for p in model.space.free}, set(derived_units(model))
    optimum = (OPTIMAL_LENGTH, OPTIMAL_EFFICIENCY) if fit.dataset.description.route else ()
    _refuse_other_arrays("draws", {"z": draws.z}, {"z": (*rows, model.space.size)})
    _refuse_other_arrays("draws", {k: v for k, v in draws.values.items() if k not in derived}, dict.fromkeys(free, rows))
    _refuse_other_arrays("draws", {k: v for k, v in draws.values.items() if k in derived}, dict.fromkeys(derived, rows), False)
    _refuse_other_arrays("draws", draws.optimum, dict.fromkeys(optimum, rows))
    for of_readings in (draws.log_likelihood, draws.expected, draws.replicated):
        _refuse_other_arrays("draws", of_readings, {name: (*rows, *shape) for name, shape in readings.items()}, False)
    if set(draws.diagnostics) != {*free, *optimum}:
        raise ValueError("diagnostics of other parameters")


def _refuse_other_arrays(
    what: str, arrays: Mapping[str, np.ndarray], shapes: Mapping[str, tuple[int, ...]], finite: bool = True
) -> None:
    """Refuse arrays that have not these names and shapes, or are not 64-bit numbers, or (if `finite`) not all finite."""
    if {name: array.shape for name, array in arrays.items()} != dict(shapes):
        raise ValueError(f"{what} of other names or shapes")
    for name, array in arrays.items():
        if array.dtype != np.float64 or (finite and not np.isfinite(array).all()):
            raise ValueError(f"{what} of {name} that are not finite numbers")


def _read_page(folder: Path) -> dict[str, Any]:
    try:
        page: dict[str, Any] = read_page(folder / FIT)
    except FileNotFoundError:
        if (folder / CHAIN).exists():
            raise StoreError(
                f"{folder} holds an interrupted fit; finish it with `bowdenfit fit ... --resume`."
            ) from None
        problem = "is not a results folder (it has no fit.json)" if folder.is_dir() else "does not exist"
        raise StoreError(f"{folder} {problem}; name a folder that `bowdenfit fit` wrote, such as fits/NAME.") from None
    schema = page.get("schema", SCHEMA) if isinstance(page, dict) else None
    if not isinstance(schema, int):
        raise StoreError(f"{folder / FIT} is damaged; fit again, or restore the folder from a copy.")
    if schema > SCHEMA:
        raise StoreError(f"{folder} was written by a newer bowdenfit (schema {schema}); update bowdenfit.")
    if schema < SCHEMA:
        raise StoreError(
            f"{folder} was written by an older bowdenfit (schema {schema}, where {SCHEMA} is read); fit the data set again."
        )
    if page.pop(CHECKSUM, None) != page_checksum(page):
        raise StoreError(
            f"{folder / FIT} has changed since it was written (edited or damaged); fit again, or restore the folder "
            "from a copy."
        )
    return page


def _fit_page(fit: Record) -> dict[str, Any]:
    posterior = fit.sampled
    return {
        "schema": SCHEMA,
        "description": fit.dataset.description.to_json(),
        "sha256": fit.dataset.sha256,
        "verdict": {"converged": fit.converged, "reasons": list(fit.reasons)},
        "least_squares": serialize(fit.least_squares),
        "posterior": _posterior_page(posterior) if posterior else None,
        "provenance": serialize(fit.provenance),
    }


def _fit_text(page: Mapping[str, Any], measurements: Measurements) -> str:
    measured = _measurements_page(measurements)
    contents = {**page, CHECKSUM: page_checksum({**page, "measurements": measured})}
    long = json.dumps(measured)  # on one line, and read by no person
    return f'{json.dumps(contents, indent=1)[:-2]},\n "measurements": {long}\n}}\n'


def _measurements_page(measurements: Measurements) -> dict[str, Any]:
    tables = {kind.name: table for kind, table in iterate_tables(measurements)}
    besides = {"remarks": measurements.remarks, EXCLUDED: measurements.excluded}
    page: dict[str, Any] = serialize({**dict.fromkeys(KINDS), **tables, **besides})
    return page


def _posterior_page(posterior: Draws) -> dict[str, Any]:
    trajectories = posterior.trajectories and replace(posterior.trajectories, statistics={})
    return {name: serialize(getattr(replace(posterior, trajectories=trajectories), name)) for name in COUNTS}


def _measurements(page: Mapping[str, Any]) -> Measurements:
    tables = (deserialize(kind.table | None, page.get(name)) for name, kind in KINDS.items())
    excluded = deserialize(dict[str, tuple[ExcludedReading, ...]], page.get(EXCLUDED, {}))  # no fit had it once
    return Measurements(tuple(table for table in tables if table is not None), tuple(page["remarks"]), excluded)


def posterior_page(fit: Record) -> tuple[Groups, Coordinates, dict[str, str], dict[str, dict[str, str]]]:
    """Return the contents of posterior.nc: groups of variables, labels of readings, attributes of file and variables."""
    posterior, space = fit.posterior, fit.model.space
    of_trajectories = posterior.trajectories.statistics if posterior.trajectories else {}
    log_prior = -0.5 * np.sum(posterior.z**2 + np.log(2 * np.pi), axis=-1)
    log_likelihood = [np.sum(part, axis=-1) for part in posterior.log_likelihood.values()]
    derived = derived_units(fit.model)
    groups: Groups = {
        "posterior": {n: draws for n, draws in posterior.values.items() if n not in derived} | posterior.optimum,
        DERIVED: {n: draws for n, draws in posterior.values.items() if n in derived},
        "unconstrained_posterior": {p.name: posterior.z[..., i] for i, p in enumerate(space.free)},
        "sample_stats": {LOG_POSTERIOR: sum(log_likelihood, log_prior)} | _walkers(posterior) | of_trajectories,
        "log_likelihood": posterior.log_likelihood,
        "posterior_predictive": posterior.replicated,
        "predictions": {f"{EXPECTED}{name}": value for name, value in posterior.expected.items()},
        "prior": posterior.prior,
        "observed_data": {term.name: term.observed() for term in fit.model.terms},
    }
    labels = {term.name: term.labels for term in fit.model.terms}
    groups = {name: variables for name, variables in groups.items() if variables or name != DERIVED}
    attributes = {"provenance": json.dumps(asdict(fit.provenance)), "name": fit.name}
    for name in groups.keys() - _WITHOUT_CHAINS:
        groups[name] = {variable: as_chains(draws, posterior.n_ensembles) for variable, draws in groups[name].items()}
    return groups, labels, attributes, _variable_attributes(fit)


def make_data_tree(fit: Record) -> "DataTree":
    """Return the draws as ArviZ takes them: the groups of posterior.nc, in memory."""
    import xarray  # here, because it takes a third of a second

    with xarray.open_datatree(make_netcdf(*posterior_page(fit)), engine="h5netcdf") as tree:
        return tree.load()


def _walkers(posterior: Draws) -> dict[str, np.ndarray]:
    """Return the index of the walker of every draw; empty if ensembles have one walker."""
    rows, draws = posterior.z.shape[:2]
    if rows == posterior.n_ensembles:
        return {}
    walkers = np.arange(rows, dtype=np.int32) % (rows // posterior.n_ensembles)
    return {WALKER: np.repeat(walkers, draws).reshape(rows, draws)}


def _as_walkers(groups: Groups) -> Groups:
    """Return arrays with one row for each walker instead of one for each ensemble."""
    walker = groups["sample_stats"].pop(WALKER, np.zeros(1))
    n_walkers = int(np.max(walker)) + 1
    return {
        group: variables
        if group in _WITHOUT_CHAINS
        else {n: draws.reshape(len(draws) * n_walkers, -1, *draws.shape[2:]) for n, draws in variables.items()}
        for group, variables in groups.items()
    }


def _variable_attributes(fit: Record) -> dict[str, dict[str, str]]:
    """Return unit, symbol and meaning of every variable in the posterior."""
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
    groups = _as_walkers(read_groups_isolated(path))
    values, z = dict(sorted((groups["posterior"] | groups.get(DERIVED, {})).items())), groups["unconstrained_posterior"]
    optimum = {name: values.pop(name) for name in (OPTIMAL_LENGTH, OPTIMAL_EFFICIENCY) if name in values}
    if set(z) != set(groups["posterior"]) - set(optimum):
        raise ValueError("draws of other parameters in z")
    hints = get_type_hints(Draws)
    counts = {name: deserialize(hints[name], page[name]) for name in COUNTS}
    if counts["trajectories"] is not None:
        statistics = {name: value for name, value in groups["sample_stats"].items() if name != LOG_POSTERIOR}
        counts["trajectories"] = replace(counts["trajectories"], statistics=statistics)
    return Draws(
        z=np.stack(list(z.values()), axis=-1, dtype=np.float64, casting="no"),
        values=values,
        optimum=optimum,
        log_likelihood=groups["log_likelihood"],
        expected={name.removeprefix(EXPECTED): value for name, value in groups["predictions"].items()},
        replicated=groups["posterior_predictive"],
        prior=groups["prior"],
        **counts,
    )
