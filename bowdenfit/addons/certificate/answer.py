"""The contents of a certificate: each quantity with its uncertainty and budget, conformity, load cells, and what to know."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bowdenfit.addons.certificate.calibrated_cell import CalibratedCell
from bowdenfit.addons.certificate.conformity import (
    ConformityStatement,
    conformance_probability,
    decide,
    global_risks,
    normal_production,
    refuse_empty_acceptance,
)
from bowdenfit.addons.certificate.laboratory import CellCertificate, LaboratoryFile, StatedLimit, read_laboratory
from bowdenfit.addons.certificate.uncertainty import (
    UncertaintyComponent,
    combined_standard_uncertainty,
    symmetric_interval,
)
from bowdenfit.display import Display, Rows
from bowdenfit.errors import BowdenfitError, UsageError, suggest_name
from bowdenfit.inference.degrees_of_freedom import coverage_factor, effective_degrees_of_freedom, fit_t_distribution
from bowdenfit.questions.error_budget import error_budget, list_answers, with_bench_errors
from bowdenfit.questions.summary.verdict import assess_fit
from bowdenfit.results.record import OPTIMAL_EFFICIENCY, OPTIMAL_LENGTH, Record
from bowdenfit.types import Vector
from bowdenfit.words import decimals

_FAR_OFF = 2.0  # standard uncertainties by which an uncorrected gain may differ, those of an expanded one (GUM 6.2)
_SAME = 1.05  # factor by which a stated uncertainty may be rounded down; a judgement
MEANINGS = {OPTIMAL_LENGTH: "length of highest efficiency", OPTIMAL_EFFICIENCY: "efficiency at that length"}


class UntrustedFitError(BowdenfitError):
    """A certificate of a fit that is not to be trusted was asked for."""

    exit_code = 3


@dataclass(frozen=True)
class CertifiedQuantity:
    """A result with its uncertainty.

    Args:
        name: Name of the quantity.
        meaning: The same in words.
        unit: Its unit.
        value: Mean of the draws (JCGM 101, 7.6).
        standard: Standard uncertainty, the standard deviation of the draws.
        interval: Probabilistically symmetric coverage interval.
        probability: Its coverage probability.
        budget: Components of its uncertainty.
    """

    name: str
    meaning: str
    unit: str
    value: float
    standard: float
    interval: tuple[float, float]
    probability: float
    budget: tuple[UncertaintyComponent, ...]

    @property
    def expanded(self) -> float:
        """Expanded uncertainty: half the width of the coverage interval."""
        return (self.interval[1] - self.interval[0]) / 2

    @property
    def factor(self) -> float:
        """Coverage factor: expanded over standard uncertainty."""
        return self.expanded / self.standard

    @property
    def degrees(self) -> float:
        """Effective degrees of freedom, by Welch and Satterthwaite."""
        return effective_degrees_of_freedom([part.standard for part in self.budget], [part.degrees for part in self.budget])

    @property
    def gum_standard(self) -> float:
        """Combined standard uncertainty by the GUM alone."""
        return combined_standard_uncertainty(self.budget)

    @property
    def gum_factor(self) -> float:
        """Coverage factor by the GUM alone, of a t distribution."""
        return coverage_factor(self.degrees, self.probability)

    @property
    def digits(self) -> int:
        """Decimals to which it is printed: two significant digits of its standard uncertainty (GUM 7.2.6)."""
        return decimals(self.standard, self.value)

    def in_unit(self, number: float) -> str:
        """Return a number of the quantity with its unit."""
        return f"{number:z.{self.digits}f} {self.unit}".removesuffix(" 1")


@dataclass(frozen=True, repr=False)
class Certificate(Display):
    """Everything that a certificate states.

    Args:
        laboratory: What the laboratory states.
        quantities: The results.
        statements: Conformity with each limit.
        cells: Load cells, each with what its certificate says.
        remarks: What a reader must know besides.
    """

    laboratory: LaboratoryFile
    quantities: tuple[CertifiedQuantity, ...]
    statements: tuple[ConformityStatement, ...]
    cells: tuple[tuple[CellCertificate, CalibratedCell], ...]
    remarks: tuple[str, ...]

    def quantity(self, name: str) -> CertifiedQuantity:
        """Return a result by its name."""
        return next(quantity for quantity in self.quantities if quantity.name == name)

    def sentences(self) -> list[str]:
        """Return every result with its expanded uncertainty, and every decision."""
        results = [
            f"{q.name} = {q.in_unit(q.value)} with an expanded uncertainty of {q.in_unit(q.expanded)} "
            f"(k = {q.factor:.2f}, {100 * q.probability:g} %)."
            for q in self.quantities
        ]
        conformity = [
            f"{s.quantity}: {s.decision} (probability of conformity {s.probability:.3g})." for s in self.statements
        ]
        return results + conformity

    def _table(self) -> Rows:
        rows = [
            {"quantity": q.name, "unit": q.unit, "value": q.value, "standard_uncertainty": q.standard}
            | {"expanded_uncertainty": q.expanded, "coverage_factor": q.factor, "coverage_probability": q.probability}
            | {"degrees_of_freedom": q.degrees, "low": q.interval[0], "high": q.interval[1]}
            for q in self.quantities
        ]
        return rows, {}

_SMALL = 0.2  # share of the combined uncertainty below which components share a line; a judgement


def certify(fit: Record, laboratory_file: str | Path, probability: float = 0.95) -> Certificate:
    """Return the certificate of a fit.

    Args:
        fit: The fit.
        laboratory_file: What the laboratory states, `laboratory.toml`.
        probability: Coverage probability of the intervals.

    Raises:
        UntrustedFitError: The fit is not to be trusted.
        UsageError: There is no posterior, or a limit is for a quantity that is not certified.
        DescriptionError: `laboratory.toml` is wrong or incomplete.
        DatasetError: The certificate of a load cell cannot be read.
    """
    laboratory_file = Path(laboratory_file)
    laboratory, draws = read_laboratory(laboratory_file), fit.draws()
    fit_verdict = assess_fit(fit)
    if not fit_verdict.trusted:
        reasons = " ".join(fit_verdict.sentences())
        raise UntrustedFitError(f"No certificate was written, because this fit is not to be trusted. {reasons}")
    left_out = {*fit_verdict.usable.undetermined}
    left_out |= {OPTIMAL_LENGTH} if fit_verdict.usable.length is False else set()
    left_out |= {OPTIMAL_EFFICIENCY} if fit_verdict.usable.efficiency is False else set()
    answers = {name: answer for name, answer in list_answers(fit).items() if name not in left_out}
    if not answers:
        raise UntrustedFitError("No certificate was written, because the readings determine none of the quantities.")
    propagated = {name: _propagate_answer(fit, name, values) for name, (_, values) in answers.items()}
    meanings = {p.name: p.meaning for p in fit.model.space.free} | MEANINGS
    quantities = tuple(
        _certify_quantity(name, meanings[name], unit, propagated[name], probability, _answer_limits(fit, name, values))
        for name, (unit, values) in answers.items()
    )
    statements = tuple(_judge(limit, quantities, propagated) for limit in laboratory.limit)
    cells = tuple((cell, cell.read(laboratory_file.parent)) for cell in laboratory.cell)
    _refuse_understated_cells(fit, cells)
    remarks = [f"{name} is not certified: the readings do not determine it." for name in sorted(left_out)]
    remarks += [f"In doubt: {doubt}." for doubt in fit_verdict.doubts]
    remarks.append(
        f"{draws.flat_z.shape[0]} draws of the joint posterior (effective sample size {draws.n_effective:.0f} or more) "
        "were propagated with the errors of the bench (JCGM 101). Values are means (its clause 7.6); reports of the fit "
        "print medians."
    )
    return Certificate(laboratory, quantities, statements, cells, tuple(remarks))


def _propagate_answer(fit: Record, name: str, values: Vector) -> tuple[Vector, tuple[UncertaintyComponent, ...]]:
    """Return draws of a quantity with the errors of the bench, and its budget."""
    budget = error_budget(fit)
    row, words = (None, {}) if budget is None else (budget.row(name), {s.name: s.words for s in budget.sources})
    shifts = {} if row is None else row.shifts
    readings = UncertaintyComponent("readings (posterior)", "A", *fit_t_distribution(values))
    of_bench = {words[source]: shift for source, shift in shifts.items()}
    small = {source: shift for source, shift in of_bench.items() if shift < _SMALL * row.bench.sd} if row is not None else {}
    if len(small) > 1:
        of_bench = {source: shift for source, shift in of_bench.items() if source not in small}
        of_bench["other errors of the bench"] = float(np.hypot.reduce(list(small.values())))
    bench = (UncertaintyComponent(source, "B", shift, np.inf) for source, shift in of_bench.items())
    return list_answers(with_bench_errors(fit))[name][1], (readings, *bench)


def _answer_limits(fit: Record, name: str, values: Vector) -> tuple[float, float]:
    """Return the limits of a quantity: the range of a route, 0 and 1 of an efficiency, 0 of what is never negative."""
    route = fit.dataset.description.route
    if name == OPTIMAL_LENGTH and route is not None:
        return route.range
    return 0.0 if np.min(values) >= 0 else -np.inf, 1.0 if name == OPTIMAL_EFFICIENCY else np.inf


def _certify_quantity(
    name: str,
    meaning: str,
    unit: str,
    propagated: tuple[Vector, tuple[UncertaintyComponent, ...]],
    probability: float,
    limits: tuple[float, float],
) -> CertifiedQuantity:
    """Return a result, whose interval is cut off at the limits of the quantity."""
    draws, budget = propagated
    low, high = symmetric_interval(draws, probability)
    low, high = max(low, limits[0]), min(high, limits[1])
    return CertifiedQuantity(
        name, meaning, unit, float(np.mean(draws)), float(np.std(draws)), (low, high), probability, budget
    )


def _judge(
    limit: StatedLimit,
    quantities: Sequence[CertifiedQuantity],
    propagated: dict[str, tuple[Vector, tuple[UncertaintyComponent, ...]]],
) -> ConformityStatement:
    """Return whether a quantity conforms with its limits.

    Raises:
        UsageError: The quantity is not certified.
    """
    quantity = next((quantity for quantity in quantities if quantity.name == limit.quantity), None)
    if quantity is None:
        names = [quantity.name for quantity in quantities]
        raise UsageError(
            f"a [[limit]] of laboratory.toml is for {limit.quantity!r}, which this certificate does not "
            f"state{suggest_name(limit.quantity, names)}"
        )
    guard_band = limit.guard_band * quantity.expanded
    acceptance = refuse_empty_acceptance(quantity.name, limit.tolerance, guard_band)
    conforms = conformance_probability(propagated[quantity.name][0], limit.tolerance)
    over_production = None
    if limit.production is not None:
        density, support = normal_production(limit.production.mean, limit.production.sd)
        over_production = global_risks(density, support, limit.tolerance, acceptance, quantity.standard)
    decision = decide(quantity.value, limit.tolerance, guard_band)
    risks = (conforms, 1 - conforms, conforms)
    return ConformityStatement(
        quantity.name, limit.tolerance, acceptance, guard_band, decision, *risks, over_production, limit.source
    )


def _refuse_understated_cells(fit: Record, cells: Sequence[tuple[CellCertificate, CalibratedCell]]) -> None:
    """Refuse a certificate whose load cells are known less well than the fit assumed, or whose gains it did not correct.

    Raises:
        UsageError: One is.
    """
    sensors, errors = fit.dataset.description.sensors, fit.dataset.description.errors
    for entry, cell in cells:
        for end in ("input", "output") if entry.end == "both" else (entry.end,):
            sd = getattr(sensors, f"{end}_gain_error_sd")
            assumed = errors.gain / np.sqrt(3) if sd is None else sd
            if cell.gain_error_sd > _SAME * assumed:
                raise UsageError(
                    f"certificate {cell.number} of the {end} load cell states a relative standard uncertainty of "
                    f"{cell.gain_error_sd:.3g}, and the fit assumed {assumed:.3g}, so that its results would be too "
                    f"certain; write {end}_gain_error_sd = {cell.gain_error_sd:.3g} under [sensors] of cable.toml, and "
                    "fit again."
                )
            left = cell.gain * getattr(sensors, f"{end}_ratio") - 1
            if entry.dcc is not None and abs(left) > _FAR_OFF * assumed:
                raise UsageError(
                    f"certificate {cell.number} says that the {end} load cell shows {cell.gain:.4g} of the true force, and the "
                    f"fit left {100 * left:.2g} % of that uncorrected, more than its gain error of {assumed:.3g} allows; write "
                    f"{end}_ratio = {1 / cell.gain:.6g} under [sensors] of cable.toml, and fit again."
                )
