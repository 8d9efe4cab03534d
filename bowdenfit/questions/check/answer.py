"""Checks of a fit against its own readings: outliers, influential readings, and sensitivity to the priors.

Every reading is predicted from all others by importance weights (PSIS-LOO). These cannot undo the effect of an influential
reading on the draws: how far out they place it differs between seeds. A refit without it takes seconds, so that is done only
for influential readings that look like outliers by their weights.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import ClassVar

import jax
import numpy as np

from bowdenfit.display import Display, Rows
from bowdenfit.inference.draws import DrawFunction, compile_replicator
from bowdenfit.inference.leave_one_out import LooDensity, LooRefits
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.inference.predictive_checks import (
    check_uniformity,
    draw_randomized_pit,
    predict_left_out,
    replace_by_refit,
)
from bowdenfit.inference.prior_sensitivity import (
    PriorConflict,
    Sensitivity,
    compute_sensitivities,
    find_prior_conflicts,
    rescale_prior,
)
from bowdenfit.kinds.covariates import collect_covariates
from bowdenfit.kinds.term import Term
from bowdenfit.questions.check.table_checks import FALSE_ALARM, CheckedReading, TableChecks
from bowdenfit.results.record import Record, cached_per_fit

_COLUMNS = {"influential": "decisive"}  # names of columns that differ from those of attributes
_FEW_SPARE = 4  # readings beyond the number of coefficients, up to which noise counts as weakly identified; a judgement
_DRAWS = 5000  # draws for the sensitivity to the priors: more are slower, and more precise
_MIN_READINGS = 8  # readings of a table from which on the uniformity of their PIT is tested; fewer have no power
_PIT_STREAM = 5  # number of the stream of random numbers, beside the seed of the fit
_SUSPICIOUS = 0.1  # expected number of readings of a healthy fit that are called suspicious: ten times that of outliers
_MAX_REFITS = 3  # refits at most; where more readings are far out, no single one of them is the cause


@dataclass(frozen=True, repr=False)
class Checks(Display):
    """All checks of a fit.

    Args:
        tables: Checks of each table; held forces, which only bound the friction, are left out.
        sensitivities: How friction coefficients and design answers depend on priors and readings.
        prior_conflicts: Parameters that the readings put where their priors hardly allow them.
        weakly_identified_noise: Noise scales that few readings determine: by name, the number of readings, and that of the
            coefficients which the same readings must determine.
    """

    tables: tuple[TableChecks, ...]
    sensitivities: tuple[Sensitivity, ...]
    prior_conflicts: tuple[PriorConflict, ...] = ()
    weakly_identified_noise: dict[str, tuple[int, int]] = field(default_factory=dict)

    false_alarm: ClassVar = FALSE_ALARM
    JSON: ClassVar = ("false_alarm", "tables", "readings", "sensitivities", ("far_out", "prior_conflicts"))

    def _table(self) -> Rows:
        rows = [{_COLUMNS.get(name, name): value for name, value in vars(reading).items()} for reading in self.readings]
        return rows, {reading.label: reading.unit for reading in self.readings}

    @cached_property
    def readings(self) -> tuple[CheckedReading, ...]:
        """Every reading of every table."""
        n_readings = sum(len(table.labels) for table in self.tables)
        return tuple(reading for table in self.tables for reading in table.readings(n_readings))

    @property
    def outliers(self) -> tuple[CheckedReading, ...]:
        """Outliers, the farthest first: so far out that a healthy fit has one in a hundred fits."""
        return tuple(sorted((r for r in self.readings if r.outlier), key=lambda r: r.p_value))

    @property
    def influential(self) -> tuple[CheckedReading, ...]:
        """Readings without which the fit would change markedly, the most influential first."""
        return tuple(sorted((r for r in self.readings if r.influential), key=lambda r: -r.pareto_k))

    @property
    def conflicts(self) -> tuple[Sensitivity, ...]:
        """Quantities that a prior and the readings pull to different values."""
        return tuple(s for s in self.sensitivities if s.diagnosis == "conflict")


@cached_per_fit
def check_readings(fit: Record) -> Checks | None:
    """Return all checks of a fit; None without draws."""
    if fit.sampled is None:
        return None
    generator = np.random.default_rng([fit.provenance.seed, _PIT_STREAM])
    terms = [term for term in fit.model.terms if term.labels and term.residual_blocks[0][1] > 0]
    in_band = 1 - FALSE_ALARM / max(len(terms), 1)
    tables = refit_influential_outliers(fit, [_check_table(fit, term, in_band, generator) for term in terms])
    parameters = {p.name: p for p in fit.model.space.free}
    z = {name: fit.posterior.z[..., i] for name, i in fit.model.space.index.items()}
    return Checks(tables, _prior_sensitivities(fit), find_prior_conflicts(z, parameters), _weakly_identified_noise(fit))


def _check_table(fit: Record, term: Term, in_band: float, generator: np.random.Generator) -> TableChecks:
    """Return the readings of a table beside their leave-one-out predictions.

    Args:
        fit: A fit with draws.
        term: The table's term.
        in_band: Probability that the distribution of healthy readings stays in its band.
        generator: Generator of the randomized probability integral transforms.
    """
    draws = (fit.posterior.log_likelihood[term.name], fit.posterior.replicated[term.name])
    log_likelihood, replicated = (part.reshape(-1, len(term.labels)) for part in draws)
    reading, at_most = collect_readings(term)
    predicted = predict_left_out(log_likelihood, replicated, reading, at_most, fit.posterior.n_effective)
    pit = draw_randomized_pit(predicted, generator)
    uniformity = check_uniformity(pit, in_band) if len(reading) >= _MIN_READINGS else None
    positions = collect_covariates(fit.dataset.description, fit.dataset.measurements, term)
    return TableChecks(
        term.name, term.unit, term.labels, reading, at_most, predicted, positions, pit, uniformity,
        np.zeros(len(reading), dtype=bool),
    )  # fmt: skip


def _prior_sensitivities(fit: Record) -> tuple[Sensitivity, ...]:
    """Return how friction coefficients and design answers depend on the priors, as far as they vary."""
    posterior, space = fit.posterior, fit.model.space
    stride = max(1, posterior.z[..., 0].size // _DRAWS)
    quantities = {p.name: posterior.values[p.name] for p in space.free if p.role == "friction"} | posterior.optimum
    thinned = {name: draws[:, ::stride] for name, draws in quantities.items()}
    varying = {
        name: draws for name, draws in thinned.items() if np.ptp(draws) > 0
    }  # an optimum may be an end in all draws
    if not varying:
        return ()
    log_likelihood = sum((np.sum(part, axis=-1) for part in posterior.log_likelihood.values()), np.zeros(()))
    z = {p.name: posterior.z[:, ::stride, i] for i, p in enumerate(space.free)}
    priors = {p.name: rescale_prior(p.prior, posterior.values[p.name][:, ::stride] / p.shown_scale) for p in space.free}
    return compute_sensitivities(varying, z, log_likelihood[:, ::stride], priors)


def _weakly_identified_noise(fit: Record) -> dict[str, tuple[int, int]]:
    """Return noise scales with hardly more readings than coefficients: numbers of readings and coefficients, by name."""
    coefficients = sum(p.role == "friction" for p in fit.model.space.free)
    readings: dict[str, int] = {}
    for term in fit.model.terms:
        readings[term.noise] = readings.get(term.noise, 0) + term.residual_blocks[0][1]
    noise = [p.name for p in fit.model.space.free if p.role == "noise"]
    return {n: (readings[n], coefficients) for n in noise if 0 < readings.get(n, 0) <= coefficients + _FEW_SPARE}


def collect_readings(term: Term) -> tuple[np.ndarray, np.ndarray]:
    """Return the readings of a table, upper limits where only these are known, and a mask of such limits."""
    reading, limit = term.observed().copy(), getattr(term.data, "limit", np.zeros(0))
    at_most = np.isnan(reading)
    reading[at_most] = np.rad2deg(limit)
    bounds = len(getattr(term.data, "at_most", ()))
    if bounds:
        at_most[len(at_most) - bounds :] = True
    return reading, at_most


def refit_influential_outliers(fit: Record, tables: Sequence[TableChecks]) -> tuple[TableChecks, ...]:
    """Return the checks of all tables, with influential, suspicious readings predicted by refits without them.

    The prediction by weights stays where the refit does not converge.

    Args:
        fit: A fit with draws.
        tables: As importance weights predict them.
    """
    suspects = find_influential_outliers(tables)
    if not suspects:
        return tuple(tables)
    checked = list(tables)
    with jax.enable_x64(True):
        density, posterior, z = LogDensity(fit.model), fit.posterior, fit.posterior.flat_z
        log_likelihood = np.concatenate(
            [posterior.log_likelihood[term.name] for term in fit.model.terms], axis=-1
        ).reshape(len(z), -1)
        share = min(posterior.n_effective / len(z), 1.0)
        refits = LooRefits(LooDensity(density), z, log_likelihood, share, fit.provenance.seed)
        for table, row in suspects:
            checked[table] = _predict_by_refit(refits, replicate_program(fit), checked[table], row)
    return tuple(checked)


@cached_per_fit
def replicate_program(fit: Record) -> DrawFunction:
    """Return the compiled function from many z to replicated readings; a fit that samples has it already."""
    return fit.programs.quantities if fit.programs else compile_replicator(LogDensity(fit.model), fit.provenance.seed)


def find_influential_outliers(tables: Sequence[TableChecks]) -> list[tuple[int, int]]:
    """Return table and row number of every suspicious influential reading, the farthest out first."""
    n_readings = sum(len(table.p_values) for table in tables)
    p_values = {
        (number, row): p_value
        for number, table in enumerate(tables)
        for row, (p_value, influential) in enumerate(zip(table.p_values, table.influential, strict=True))
        if influential and p_value * n_readings < _SUSPICIOUS
    }
    return sorted(p_values, key=lambda suspect: p_values[suspect])[:_MAX_REFITS]


def _predict_by_refit(refits: LooRefits, replicate: DrawFunction, table: TableChecks, row: int) -> TableChecks:
    """Return the table with one of its readings predicted by a refit without it."""
    chain = refits.chain_without(refits.density.names.index((table.table, table.labels[0])) + row)
    if chain.reasons:
        return table
    replicated = replicate(chain.z.reshape(-1, chain.z.shape[-1]))["replicated"][table.table][:, row]
    reading, at_most = float(table.reading[row]), bool(table.at_most[row])
    predicted = replace_by_refit(table.predicted, row, replicated, reading, at_most)
    pit, refitted = table.pit.copy(), table.refitted.copy()
    pit[row] = np.clip(pit[row], predicted.below[row], predicted.up_to[row])
    refitted[row] = True
    return replace(table, predicted=predicted, pit=pit, refitted=refitted)
