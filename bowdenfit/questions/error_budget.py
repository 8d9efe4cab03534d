r"""The error budget: what errors of a whole bench, which none of its readings can show, add to each interval.

An interval of the posterior holds what scatters. A bend angle that is 3 % too large, a load cell with another gain, or one with
hysteresis shifts every reading alike, and metrology adds it as an uncertainty of type B:

.. math:: u^2(f) = u_A^2(f) + \sum_e \left(\frac{\partial \mathrm{E} f}{\partial e} u_e\right)^2

The slope of a posterior mean by an error e of the data is a covariance over the draws, without a refit:

.. math:: \frac{d \mathrm{E} f}{d e} = \mathrm{Cov}\!\left(f, \frac{\partial \log p(y_e \mid z)}{\partial e}\right)

References:
    JCGM 100:2008, Evaluation of measurement data: Guide to the expression of uncertainty in measurement (GUM), 4.3 and 5.1.
    Giordano, Broderick and Jordan, Covariances, robustness, and variational Bayes, Journal of Machine Learning Research 19
    (2018), 51: the covariance as a derivative of a posterior mean.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from math import sqrt
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

from bowdenfit.cable.cable import CableContacts
from bowdenfit.display import Display, Rows
from bowdenfit.inference.compilation import compile_program
from bowdenfit.inference.draws import BATCH, run_in_batches
from bowdenfit.inference.interval import NORMAL_90, Interval
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.kinds import iterate_tables
from bowdenfit.kinds.bench_error import BenchError
from bowdenfit.kinds.runs import RunsData
from bowdenfit.kinds.tables import AngleTable, Measurements
from bowdenfit.kinds.term import find_row_angles
from bowdenfit.kinds.terms import TERMS
from bowdenfit.pages.section import PageSection, PageTable, prose_section
from bowdenfit.results.optimal_length import OptimalLength
from bowdenfit.results.record import OPTIMAL_EFFICIENCY, OPTIMAL_LENGTH, Record, cached_per_fit
from bowdenfit.words import filled, listed, table

_DRAWS = 4096  # a covariance of so many is known to 2 %; more would only take longer
_STEP = 1e-4  # relative, and of an angle in rad: small beside any interval, large beside rounding
_NOTABLE = 1.5  # factor on an interval from which it is shown: the errors then add more than half to it
# Median deviations at which the score of a draw is cut off: of a normal distribution hardly any is beyond 10, and where scatter
# is nearly nothing some 5 % of the draws are, so that a shift is at most that much too small; a judgement.
_FARTHEST_SCORE = 10.0
TITLE = "Error budget: what bench errors that readings cannot reveal add"
_INCLUDED = "The intervals of the first page include them."
KEY_ROLES = ("friction", "friction_model", "angle", "elastic")  # of coefficients that are answers, not means to them


@dataclass(frozen=True)
class ErrorSource:
    """One cause of error.

    Args:
        name: Name of the error: "wrap angles", "gain" or "hysteresis".
        words: The same with how well it is known.
    """

    name: str
    words: str


@dataclass(frozen=True)
class BudgetRow:
    """What the errors of a bench add to one quantity.

    Args:
        quantity: Its name.
        unit: Its unit.
        readings: Its interval by the readings alone.
        bench: The interval with the errors of the bench.
        shifts: By how much each source moves it, one standard deviation, by name.
    """

    quantity: str
    unit: str
    readings: Interval
    bench: Interval
    shifts: Mapping[str, float]

    @property
    def is_notable(self) -> bool:
        """Whether the errors of the bench add more than half to its interval."""
        return self.bench.sd > _NOTABLE * self.readings.sd

    @property
    def largest(self) -> str:
        """Name of the source that moves it most."""
        return max(self.shifts, key=lambda name: self.shifts[name])


@dataclass(frozen=True, repr=False)
class ErrorBudget(Display):
    """Every answer of a fit, by the readings alone and with the usual or stated errors of a bench.

    Args:
        sources: Causes of error.
        rows: The answers.
    """

    sources: tuple[ErrorSource, ...]
    rows: tuple[BudgetRow, ...]

    def row(self, quantity: str) -> BudgetRow | None:
        """Return the row of a quantity; None where there is none."""
        return next((row for row in self.rows if row.quantity == quantity), None)

    def sentences(self) -> list[str]:
        """What the errors of a bench add, in a sentence or two."""
        notable = [row for row in self.rows if row.is_notable]
        known = listed([source.words for source in self.sources])
        if not notable:
            return [f"Bench errors that readings cannot reveal ({known}) add less than half to each interval. {_INCLUDED}"]
        return [
            f"Bench errors that readings cannot reveal ({known}) add more than half to the interval of "
            f"{listed([row.quantity for row in notable])}; state your own under [errors] in cable.toml. {_INCLUDED}"
        ]

    def _table(self) -> Rows:
        rows = []
        for row in self.rows:
            ends = {"q05": row.readings.q05, "q95": row.readings.q95}
            ends |= {"q05_with_bench": row.bench.q05, "q95_with_bench": row.bench.q95}
            rows.append({"quantity": row.quantity, "unit": row.unit, "median": row.readings.median} | ends | dict(row.shifts))
        return rows, {}


@cached_per_fit
def error_budget(fit: Record) -> ErrorBudget | None:
    """Return the error budget of a fit; None without draws, or where no error of the bench is left to add.

    Args:
        fit: The fit.
    """
    uncertainties = list(_standard_errors(fit))
    quantities = list_answers(fit) if fit.sampled is not None else {}
    if not quantities or not uncertainties:
        return None
    chosen = np.linspace(0, len(fit.draws().flat_z) - 1, _DRAWS).astype(int)
    scores = _scores(fit, fit.draws().flat_z[chosen], [step for _, steps in uncertainties for step in steps])
    scores = {step: _without_far_scores(of_step) for step, of_step in scores.items()}
    rows = []
    for name, (unit, draws) in quantities.items():
        deviation = draws[chosen] - draws[chosen].mean()
        shifts = {
            source.name: max(abs(float(np.mean(deviation * scores[step]))) * size for step, size in steps.items())
            for source, steps in uncertainties
        }
        readings = Interval.of(draws)
        bench = _widened(readings, list(shifts.values()), answer_limits(fit, name, readings))
        rows.append(BudgetRow(name, unit, readings, bench, shifts))
    return ErrorBudget(tuple(source for source, _ in uncertainties), tuple(rows))


def _standard_errors(fit: Record) -> Iterator[tuple[ErrorSource, dict[BenchError, float]]]:
    """Yield each source of error with the small steps that stand for it, and its standard uncertainty in such steps.

    Between limits of +-a every value is as likely (GUM 4.3.7), which makes a standard uncertainty of a/sqrt(3); two load cells
    have errors of their own. Of an error in proportion and one in degrees, the one that matters more to an answer counts.
    """
    stated, sensors = fit.dataset.description.errors, fit.dataset.description.sensors
    angles = {
        f"{stated.angle.value:g} {stated.angle.unit}": (BenchError(angle_offset=_STEP), stated.angle.to("angle")),
        f"{100 * stated.angle_scale:g} %": (BenchError(angle_scale=_STEP), stated.angle_scale),
    }
    limits = {words: (step, limit) for words, (step, limit) in angles.items() if limit}
    if limits:
        steps = {step: limit / sqrt(3) / _STEP for step, limit in limits.values()}
        yield ErrorSource("wrap angles", f"wrap angles known to {' or '.join(limits)}"), steps
    of_both_cells = sqrt(2 / 3) / _STEP
    if stated.gain and sensors.gain_sd is None:
        words = f"a gain of each load cell known to {100 * stated.gain:g} %"
        yield ErrorSource("gain", words), {BenchError(gain=_STEP): stated.gain * of_both_cells}
    if stated.hysteresis:
        words = f"a hysteresis of each load cell of up to {100 * stated.hysteresis:g} %"
        yield ErrorSource("hysteresis", words), {BenchError(hysteresis=_STEP): stated.hysteresis * of_both_cells}


def list_answers(fit: Record) -> dict[str, tuple[str, np.ndarray]]:
    """Return unit and draws of every coefficient, the best length and the efficiency there."""
    draws, free = fit.draws(), fit.model.space.free
    quantities = {p.name: (p.unit, draws.values[p.name].ravel()) for p in free if p.role in KEY_ROLES}
    route = fit.dataset.description.route
    for name, unit in ((OPTIMAL_LENGTH, route.unit if route else ""), (OPTIMAL_EFFICIENCY, "1")):
        if name in draws.optimum:
            quantities[name] = (unit, draws.optimum[name].ravel())
    return quantities


def _scores(fit: Record, z: np.ndarray, errors: list[BenchError]) -> dict[BenchError, np.ndarray]:
    """Return the change of the log likelihood of each draw by each small error of the data."""
    with jax.enable_x64(True):
        posterior = LogDensity(fit.model)
        data = _data_with(fit, BenchError())

        def log_likelihood(z: Float[Array, " free"], data: Any) -> Array:
            return sum((jnp.sum(part) for part in posterior.log_likelihoods(z, data).values()), jnp.zeros(()))

        rows = jax.ShapeDtypeStruct((BATCH, z.shape[1]), float)
        program = compile_program(jax.vmap(log_likelihood, in_axes=(0, None)), rows, data, run_often=fit.model.is_slow)
        changes = {}
        before = run_in_batches(lambda part: program(part, data), BATCH, z)
        for error in errors:
            changed = _data_with(fit, error)
            after = run_in_batches(lambda part, changed=changed: program(part, changed), BATCH, z)
            changes[error] = np.where(np.isfinite(after - before), after - before, 0.0)
    return changes


def _without_far_scores(scores: np.ndarray) -> np.ndarray:
    """Scores cut off far from their median.

    Where few readings allow nearly no scatter, the few draws with the least have scores in proportion to one over it. They
    cancel in a covariance over infinitely many draws, but not over some thousand.
    """
    middle = np.median(scores)
    reach = _FARTHEST_SCORE * np.median(np.abs(scores - middle))
    return np.clip(scores, middle - reach, middle + reach)


def _data_with(fit: Record, error: BenchError) -> tuple[Any, ...]:
    """Return the data of all terms as a bench with a systematic error would have given them."""
    measurements, cable = fit.dataset.measurements, fit.model.cable
    tables = {kind.name: kind.with_bench_error(table, error) for kind, table in iterate_tables(measurements)}
    angles = Measurements(tuple(tables.values())).table(AngleTable)
    terms = [term for name, table in tables.items() for term in TERMS[name].terms(cable, table, angles)]
    return tuple(_with_constant_angles(term.data, cable, error) for term in terms)


def _with_constant_angles(data: Any, cable: CableContacts, error: BenchError) -> Any:
    """Return data of a term whose rows also hold the constant wrap angles of cable.toml, those without a stated error."""
    if isinstance(data, RunsData):
        return replace(data, cells=_with_constant_angles(data.cells, cable, error))
    angles = find_row_angles(data)
    if angles is None:
        return data
    own_angles, is_own = np.array(angles.own, dtype=float), np.array(angles.is_own)
    for k, contact in enumerate(cable.description.contact):
        constant = contact.wrap_angle.constant
        if constant is not None and constant.sd is None:
            own_angles[..., k] = error.apply_to_angles(np.array(constant.to("angle")))
            is_own[..., k] = True
    return replace(data, angles=replace(angles, own=own_angles, is_own=is_own))


def answer_limits(fit: Record, name: str, readings: Interval) -> tuple[float, float]:
    """Return the limits of a quantity: the range of a route, 0 and 1 of an efficiency, 0 of what is never negative."""
    route = fit.dataset.description.route
    if name == OPTIMAL_LENGTH and route is not None:
        return route.range
    return 0.0 if readings.q05 >= 0 else -np.inf, 1.0 if name == OPTIMAL_EFFICIENCY else np.inf


def _widened(readings: Interval, shifts: list[float], limits: tuple[float, float]) -> Interval:
    """Return an interval with further independent uncertainties, cut off at the limits of its quantity."""
    added = sqrt(sum(shift**2 for shift in shifts))
    low = readings.median - np.hypot(readings.median - readings.q05, NORMAL_90 * added)
    high = readings.median + np.hypot(readings.q95 - readings.median, NORMAL_90 * added)
    q05, q95 = max(float(low), limits[0]), min(float(high), limits[1])
    return replace(readings, sd=float(np.hypot(readings.sd, added)), q05=q05, q95=q95)


HEADS = ("quantity", "readings alone", "with errors", "angles", "gain", "hysteresis")
_SOURCES = ("wrap angles", "gain", "hysteresis")


def budget_rows(budget: ErrorBudget) -> list[tuple[str, ...]]:
    """Return a row for each quantity, under `HEADS`: both intervals, and the shifts by one standard deviation."""
    rows = list[tuple[str, ...]]()
    for row in budget.rows:
        digits = row.readings.digits
        name = row.quantity if row.unit in ("", "1") else f"{row.quantity} ({row.unit})"
        shifts = [f"{row.shifts[source]:.1g}" if source in row.shifts else "-" for source in _SOURCES]
        rows.append((name, row.readings.range_text(digits), row.bench.range_text(digits), *shifts))
    return rows


def budget_text(fit: Record) -> str:
    """Return the error budget as a table with what it says; empty without draws."""
    budget = error_budget(fit)
    if budget is None:
        return ""
    note = "The last three columns are the shifts by one standard deviation of each error; combined as the GUM does."
    lines = [TITLE, table(HEADS, budget_rows(budget)), *(filled(sentence) for sentence in (*budget.sentences(), note))]
    return "\n".join(lines)


def budget_section(fit: Record) -> PageSection | None:
    """Return the error budget as a section of the report; None without draws."""
    budget = error_budget(fit)
    return prose_section(TITLE, budget.sentences(), [PageTable(HEADS, tuple(budget_rows(budget)))]) if budget else None


def answer_interval(fit: Record, quantity: str) -> Interval:
    """Return the interval of a parameter that people copy: with the errors of the bench where the budget has it.

    Args:
        fit: The fit, with draws.
        quantity: Name of a parameter.
    """
    budget = error_budget(fit)
    row = budget.row(quantity) if budget is not None else None
    return row.bench if row is not None else fit.parameter(quantity)


def find_optimal_length(fit: Record) -> OptimalLength:
    """Return the best length and its efficiency with intervals that include the errors of the bench.

    Raises:
        UsageError: The description has no route to vary, or there is no posterior.
    """
    best, budget = Record.optimal_length(fit), error_budget(fit)
    rows = {} if budget is None else {row.quantity: row.bench for row in budget.rows}
    length, efficiency = rows.get(OPTIMAL_LENGTH, best.length), rows.get(OPTIMAL_EFFICIENCY, best.efficiency)
    return replace(best, length=length, efficiency=efficiency)


def widening_sentence(fit: Record) -> str:
    """Return what the first answer would be that bench errors more than half widen; empty if they do not.

    'These intervals include bench errors, mainly wrap angles known to 3 deg or 3 % ([errors] in cable.toml); readings alone
    say 0.174 to 0.178 for mu.'
    """
    budget = error_budget(fit)
    notable = [row for row in budget.rows if row.is_notable] if budget else []
    if budget is None or not notable:
        return ""
    row = next((row for row in notable if row.quantity == OPTIMAL_LENGTH), notable[0])
    name = {OPTIMAL_LENGTH: "the best length", OPTIMAL_EFFICIENCY: "the efficiency"}.get(row.quantity, row.quantity)
    source = next(source.words for source in budget.sources if source.name == row.largest)
    in_percent = row.quantity == OPTIMAL_EFFICIENCY
    readings = row.readings.times(100) if in_percent else row.readings
    unit = " %" if in_percent else "" if row.unit == "1" else f" {row.unit}"
    return (
        f"These intervals include bench errors, mainly {source} ([errors] in cable.toml); readings alone say "
        f"{readings.range_text(readings.digits)}{unit} for {name}."
    )
