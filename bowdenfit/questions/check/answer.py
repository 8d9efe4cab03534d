"""Checks of a fit against its own readings: outliers, influential readings, and sensitivity to the priors."""

from dataclasses import dataclass, field
from functools import cached_property
from typing import ClassVar

import numpy as np

from bowdenfit.display import Display, Rows, Several
from bowdenfit.inference.prior_sensitivity import PriorConflict, Sensitivity, find_prior_conflicts, rescale_prior
from bowdenfit.kinds.covariates import collect_covariates
from bowdenfit.kinds.term import Term
from bowdenfit.questions.check.evidence import CheckFindings, CheckInputs, TableDraws, TableLoo, compute_findings
from bowdenfit.questions.check.suspects import refit_influential_outliers
from bowdenfit.questions.check.table_checks import FALSE_ALARM, CheckedReading, TableChecks
from bowdenfit.results.record import Record, cached_per_fit

_FEW_SPARE = 4  # readings beyond the number of coefficients, up to which the noise is called weakly identified
_COLUMNS = {"p_value": "chance", "influential": "decisive"}  # names of columns that differ from those of attributes
_DRAWS = 5000  # draws for the sensitivity to the priors: more are slower, and more precise


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
    def readings(self) -> Several[CheckedReading]:
        """Every reading of every table."""
        n_readings = sum(len(table.labels) for table in self.tables)
        return Several(reading for table in self.tables for reading in table.readings(n_readings))

    @property
    def outliers(self) -> Several[CheckedReading]:
        """Outliers, the farthest first: so far out that a healthy fit has one in a hundred fits."""
        return Several(sorted((r for r in self.readings if r.outlier), key=lambda r: r.p_value))

    @property
    def influential(self) -> Several[CheckedReading]:
        """Readings without which the fit would change markedly, the most influential first."""
        return Several(sorted((r for r in self.readings if r.influential), key=lambda r: -r.pareto_k))

    @property
    def conflicts(self) -> Several[Sensitivity]:
        """Quantities that a prior and the readings pull to different values."""
        return Several(s for s in self.sensitivities if s.diagnosis == "conflict")


@cached_per_fit
def checks_of(fit: Record) -> Checks | None:
    """All checks of a fit; None without draws."""
    if fit.sampled is None:
        return None
    findings = check_findings(fit)
    tables = refit_influential_outliers(
        fit, [_checked_table(fit, *each) for each in zip(_checked_terms(fit), findings.tables, strict=True)]
    )
    parameters = {p.name: p for p in fit.model.space.free}
    z = {name: fit.posterior.z[..., i] for name, i in fit.model.space.index.items()}
    return Checks(tables, findings.sensitivities, find_prior_conflicts(z, parameters), _weakly_identified_noise(fit))


@cached_per_fit
def check_findings(fit: Record) -> CheckFindings:
    """Return the part of the checks that takes time: leave-one-out predictions and prior sensitivities."""
    return compute_findings(check_inputs(fit))


def check_inputs(fit: Record) -> CheckInputs:
    """Collect the arrays that the checks of a fit with draws are computed from."""
    terms, posterior, space = _checked_terms(fit), fit.posterior, fit.model.space
    stride = max(1, posterior.z[..., 0].size // _DRAWS)
    quantities = {p.name: posterior.values[p.name] for p in space.free if p.role == "friction"} | posterior.optimum
    log_likelihood = sum((np.sum(part, axis=-1) for part in posterior.log_likelihood.values()), np.zeros(()))
    return CheckInputs(
        [_draws_of(fit, term) for term in terms],
        posterior.n_effective,
        1 - FALSE_ALARM / max(len(terms), 1),
        fit.provenance.seed,
        {name: draws[:, ::stride] for name, draws in quantities.items()},
        {p.name: posterior.z[:, ::stride, i] for i, p in enumerate(space.free)},
        log_likelihood[:, ::stride],
        {p.name: rescale_prior(p.prior, posterior.values[p.name][:, ::stride] / p.shown_scale) for p in space.free},
    )


def _checked_terms(fit: Record) -> list[Term]:
    """Terms whose readings are checked."""
    return [t for t in fit.model.terms if t.labels and t.residual_blocks[0][1] > 0]


def _draws_of(fit: Record, term: Term) -> TableDraws:
    parts = (part[term.name] for part in (fit.posterior.log_likelihood, fit.posterior.replicated))
    log_likelihood, replicated = (part.reshape(-1, len(term.labels)) for part in parts)
    return TableDraws(log_likelihood, replicated, *readings_of(term))


def _weakly_identified_noise(fit: Record) -> dict[str, tuple[int, int]]:
    """Noise scales with hardly more readings than coefficients: numbers of readings and coefficients, by name."""
    coefficients = sum(p.role == "friction" for p in fit.model.space.free)
    readings: dict[str, int] = {}
    for term in fit.model.terms:
        readings[term.noise] = readings.get(term.noise, 0) + term.residual_blocks[0][1]
    noise = [p.name for p in fit.model.space.free if p.role == "noise"]
    return {n: (readings[n], coefficients) for n in noise if 0 < readings.get(n, 0) <= coefficients + _FEW_SPARE}


def _checked_table(fit: Record, term: Term, loo: TableLoo) -> TableChecks:
    reading, at_most = readings_of(term)
    positions = collect_covariates(fit.dataset.description, fit.dataset.measurements, term)
    return TableChecks(
        term.name, term.unit, term.labels, reading, at_most, loo.predicted, positions, loo.pit, loo.uniformity,
        np.zeros(len(reading), dtype=bool),
    )  # fmt: skip


def readings_of(term: Term) -> tuple[np.ndarray, np.ndarray]:
    """Return the readings of a table, upper limits where only these are known, and a mask of such limits."""
    reading, limit = term.observed().copy(), term.data.get("limit", np.zeros(0))
    at_most = np.isnan(reading)
    reading[at_most] = np.rad2deg(limit)
    bounds = len(term.data.get("at_most", ()))
    if bounds:
        at_most[len(at_most) - bounds :] = True
    return reading, at_most
