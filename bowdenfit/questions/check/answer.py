"""Checks of a fit against its own readings: outliers, readings that decide by themselves, and weight of the priors."""

from dataclasses import dataclass, field
from functools import cached_property
from typing import ClassVar

import numpy as np

from bowdenfit.display import Display, Rows, Several
from bowdenfit.inference.prior_sensitivity import PriorConflict, Sensitivity, find_prior_conflicts, rescale_prior
from bowdenfit.kinds.places import places_of
from bowdenfit.kinds.term import Term
from bowdenfit.questions.check.evidence import Evidence, Findings, TableDraws, TableWithoutEach, work_out
from bowdenfit.questions.check.suspects import refit_suspects
from bowdenfit.questions.check.table_checks import FALSE_ALARM, CheckedReading, TableChecks
from bowdenfit.results.record import Record, cached_per_fit

_FEW_LEFT = 4  # readings beyond the coefficients, up to which their scatter is hardly known
_DRAWS = 5000  # that sensitivity to the priors is worked out from


@dataclass(frozen=True, repr=False)
class Checks(Display):
    """All checks of a fit.

    Args:
        tables: By table; held forces, which only bound the friction, are not among them.
        sensitivities: Of friction coefficients and design answers to priors and readings.
        prior_conflicts: Parameters that the readings put where their priors hardly allow them.
        told_by: Noise scales that few readings tell: how many readings, and how many coefficients they have to tell too.
    """

    tables: tuple[TableChecks, ...]
    sensitivities: tuple[Sensitivity, ...]
    prior_conflicts: tuple[PriorConflict, ...] = ()
    told_by: dict[str, tuple[int, int]] = field(default_factory=dict)

    false_alarm: ClassVar = FALSE_ALARM
    JSON: ClassVar = ("false_alarm", "tables", "readings", "sensitivities", ("far_out", "prior_conflicts"))

    def _table(self) -> Rows:
        return [vars(reading) for reading in self.readings], {reading.label: reading.unit for reading in self.readings}

    @cached_property
    def readings(self) -> Several[CheckedReading]:
        """Every reading of every table."""
        among = sum(len(table.labels) for table in self.tables)
        return Several(reading for table in self.tables for reading in table.readings(among))

    @property
    def outliers(self) -> Several[CheckedReading]:
        """Readings so far out that chance does as much in one healthy fit of a hundred, the farthest first."""
        return Several(sorted((r for r in self.readings if r.outlier), key=lambda r: r.chance))

    @property
    def decisive(self) -> Several[CheckedReading]:
        """Readings without which the fit would be a markedly different one, the most decisive first."""
        return Several(sorted((r for r in self.readings if r.decisive), key=lambda r: -r.pareto_k))

    @property
    def conflicts(self) -> Several[Sensitivity]:
        """Quantities that a prior and the readings pull to different values."""
        return Several(s for s in self.sensitivities if s.diagnosis == "conflict")


@cached_per_fit
def checks_of(fit: Record) -> Checks | None:
    """All checks of a fit; None without draws."""
    if fit.sampled is None:
        return None
    found = checks_findings(fit)
    tables = refit_suspects(fit, [_table(fit, *each) for each in zip(_tables(fit), found.tables, strict=True)])
    parameters = {p.name: p for p in fit.model.space.free}
    z = {name: fit.posterior.z[..., i] for name, i in fit.model.space.index.items()}
    return Checks(tables, found.sensitivities, find_prior_conflicts(z, parameters), _told_by_few(fit))


@cached_per_fit
def checks_findings(fit: Record) -> Findings:
    """What takes time of the checks of a fit with draws; `work_out` of `evidence_of` gives the same in another process."""
    return work_out(evidence_of(fit))


def evidence_of(fit: Record) -> Evidence:
    """What checks of a fit with draws are worked out from."""
    terms, posterior, space = _tables(fit), fit.posterior, fit.model.space
    every = max(1, posterior.z[..., 0].size // _DRAWS)
    asked = {p.name: posterior.values[p.name] for p in space.free if p.role == "friction"} | posterior.optimum
    log_likelihood = sum((np.sum(part, axis=-1) for part in posterior.log_likelihood.values()), np.zeros(()))
    return Evidence(
        [_draws_of(fit, term) for term in terms],
        posterior.n_effective,
        1 - FALSE_ALARM / max(len(terms), 1),
        fit.provenance.seed,
        {name: draws[:, ::every] for name, draws in asked.items()},
        {p.name: posterior.z[:, ::every, i] for i, p in enumerate(space.free)},
        log_likelihood[:, ::every],
        {p.name: rescale_prior(p.prior, posterior.values[p.name][:, ::every] / p.shown_scale) for p in space.free},
    )


def _tables(fit: Record) -> list[Term]:
    """Terms whose readings are checked."""
    return [t for t in fit.model.terms if t.labels and t.residual_blocks[0][1] > 0]


def _draws_of(fit: Record, term: Term) -> TableDraws:
    parts = (part[term.name] for part in (fit.posterior.log_likelihood, fit.posterior.replicated))
    log_likelihood, replicated = (part.reshape(-1, len(term.labels)) for part in parts)
    return TableDraws(log_likelihood, replicated, *readings_of(term))


def _told_by_few(fit: Record) -> dict[str, tuple[int, int]]:
    """Noise scales of which hardly more readings tell than there are coefficients."""
    coefficients = sum(p.role == "friction" for p in fit.model.space.free)
    readings: dict[str, int] = {}
    for term in fit.model.terms:
        readings[term.noise] = readings.get(term.noise, 0) + term.residual_blocks[0][1]
    noise = [p.name for p in fit.model.space.free if p.role == "noise"]
    return {n: (readings[n], coefficients) for n in noise if 0 < readings.get(n, 0) <= coefficients + _FEW_LEFT}


def _table(fit: Record, term: Term, found: TableWithoutEach) -> TableChecks:
    reading, at_most = readings_of(term)
    places = places_of(fit.dataset.description, fit.dataset.measurements, term)
    return TableChecks(
        term.name, term.unit, term.labels, reading, at_most, found.predicted, places, found.placed, found.uniform,
        np.zeros(len(reading), dtype=bool),
    )  # fmt: skip


def readings_of(term: Term) -> tuple[np.ndarray, np.ndarray]:
    """Readings of a table, with the limit in place of those that are only known to lie below it, and which those are."""
    reading, limit = term.observed().copy(), term.data.get("limit", np.zeros(0))
    at_most = np.isnan(reading)
    reading[at_most] = np.rad2deg(limit)
    bounds = len(term.data.get("at_most", ()))
    if bounds:
        at_most[len(at_most) - bounds :] = True
    return reading, at_most
