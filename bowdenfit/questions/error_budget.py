r"""The error budget: what errors of a whole bench, which its readings may not show, add to each interval.

An interval of the posterior holds what scatters. A wrap angle that is 3 % too large, a load cell with another gain, or one with
hysteresis shifts every reading alike, and metrology adds it as an uncertainty of type B. Here these errors are parameters with
their limits as priors (`inference/bench_errors.py`): what readings reveal of them corrects the answers, and the rest widens
them. Answers are calculated from draws that are moved by draws of the errors.

References:
    JCGM 100:2008, Evaluation of measurement data: Guide to the expression of uncertainty in measurement (GUM), 4.3 and 5.1.
    JCGM 101:2008, Supplement 1 to the GUM: propagation of distributions using a Monte Carlo method.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import ClassVar

import jax
import numpy as np

from bowdenfit.display import Display, Rows
from bowdenfit.inference.bench_errors import CONTRADICTION, LearnedErrors, learn_errors
from bowdenfit.inference.degrees_of_freedom import effective_degrees_of_freedom, fit_t_distribution
from bowdenfit.inference.interval import Interval
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.kinds.bench_error import STEP, ErrorSource
from bowdenfit.pages.section import PageSection, PageTable, prose_section
from bowdenfit.results.optimal_length import OptimalLength
from bowdenfit.results.record import (
    OPTIMAL_EFFICIENCY,
    OPTIMAL_LENGTH,
    Record,
    cached_per_fit,
    optimum_program,
    values_program,
)
from bowdenfit.words import filled, listed, significant, table

_ROUNDING = 1e-6  # of a standard deviation, below which an error does not move an answer
_NOTABLE = 1.5  # factor on an interval from which it is shown: the errors then add more than half to it
_LEARNED = 0.5  # share of the uncertainty of an error, below which readings have determined it; a judgement
_SHOWN_ERRORS = {  # words, unit and factor in which an error is shown, by field of `BenchError`
    "gain": ("the gain error of the output's load cell relative to the input's", "%", 100.0),
    "hysteresis": ("the hysteresis of the load cells", "%", 100.0),
    "angle_scale": ("the relative error of all wrap angles", "%", 100.0),
    "angle_offset": ("the offset of all wrap angles", "deg", float(np.rad2deg(1.0))),
    "wear": ("the change of friction from the first mounting to the last", "%", 100.0),
    "load_exponent": ("the load exponent", "", 1.0),
    "compression": ("the growth of all wrap angles up to the largest load", "%", 100.0),
    "input_zero": ("the zero of the input's load cell, of its largest force,", "%", 100.0),
    "output_zero": ("the zero of the output's load cell, of its largest force,", "%", 100.0),
    "crosstalk": ("the share of the input force in the output's reading", "%", 100.0),
}
TITLE = "Error budget: what bench errors add"
_INCLUDED = "The intervals of the first page include them."
KEY_ROLES = ("friction", "friction_model", "angle", "elastic")  # of coefficients that are answers, not means to them


@dataclass(frozen=True)
class BudgetRow:
    """What the errors of a bench add to one quantity.

    Args:
        quantity: Its name.
        unit: Its unit.
        readings: Its interval by the readings alone.
        bench: The interval with the errors of the bench.
        shifts: By how much each source moves it, one standard deviation, by name.
        degrees_of_freedom: Effective degrees of freedom, by Welch and Satterthwaite (GUM, G.4.1): those of a t distribution for
            the readings, and infinitely many for limits.
    """

    quantity: str
    unit: str
    readings: Interval
    bench: Interval
    shifts: Mapping[str, float]
    degrees_of_freedom: float

    JSON: ClassVar = (..., "coverage_factor")

    @property
    def coverage_factor(self) -> float:
        """Half of the interval with the errors of the bench, over its standard uncertainty (JCGM 101, 3.15) [1]."""
        return (self.bench.q95 - self.bench.q05) / 2 / self.bench.sd if self.bench.sd > 0 else float("nan")

    @property
    def is_notable(self) -> bool:
        """Whether the errors of the bench add more than half to its interval."""
        return self.bench.sd > _NOTABLE * self.readings.sd

    @property
    def largest(self) -> str:
        """Name of the source that moves it most."""
        return max(self.shifts, key=lambda name: self.shifts[name])


@dataclass(frozen=True)
class LearnedError:
    """What readings reveal of one error of the bench.

    Args:
        name: What it is an error of, in words.
        unit: Its unit.
        mean: Its estimate.
        sd: Standard uncertainty that is left of it.
        limit_sd: Standard uncertainty by its limit alone.
    """

    name: str
    unit: str
    mean: float
    sd: float
    limit_sd: float

    @property
    def is_learned(self) -> bool:
        """Whether the readings determine it to better than half of what was known before."""
        return self.sd < _LEARNED * self.limit_sd

    @property
    def is_off(self) -> bool:
        """Whether readings show it beyond 3 standard uncertainties, as chance does for one of six in one healthy fit in 60."""
        return self.is_learned and abs(self.mean) > 3 * self.sd

    @property
    def contradicts_limit(self) -> bool:
        """Whether it is beyond its limit, and chance puts one within it there in fewer than one fit in a hundred."""
        by_chance = CONTRADICTION * np.sqrt(max(self.limit_sd**2 - self.sd**2, 0.0))
        return abs(self.mean) > max(by_chance, np.sqrt(3) * self.limit_sd)

    def __str__(self) -> str:
        unit = f" {self.unit}" if self.unit else ""
        return f"{self.name} is {significant(self.mean, 2)} ± {significant(self.sd, 1)}{unit}"


@dataclass(frozen=True, repr=False)
class ErrorBudget(Display):
    """Every answer of a fit, by the readings alone and with the usual or stated errors of a bench.

    Args:
        sources: Causes of error that move a reading.
        rows: The answers.
        learned: What the readings reveal of each error.
        without_effect: Causes of error that move no reading.
    """

    sources: tuple[ErrorSource, ...]
    rows: tuple[BudgetRow, ...]
    learned: tuple[LearnedError, ...] = ()
    without_effect: tuple[ErrorSource, ...] = ()

    def row(self, quantity: str) -> BudgetRow | None:
        """Return the row of a quantity; None where there is none."""
        return next((row for row in self.rows if row.quantity == quantity), None)

    def sentences(self) -> list[str]:
        """What the errors of a bench add, in a sentence or two."""
        notable = [row for row in self.rows if row.is_notable]
        limits = listed([source.words for source in self.sources])
        added = "less than half to each interval"
        if notable:
            of_which = listed([row.quantity for row in notable])
            added = f"more than half to the interval of {of_which}; state your own under [errors] in cable.toml"
        sentences = [f"Bench errors that readings do not reveal ({limits}) add {added}. {_INCLUDED}"]
        if revealed := [str(error) for error in self.learned if error.is_learned]:
            sentences.append(f"The readings reveal that {listed(revealed)}; the answers are corrected for it.")
        if self.without_effect:
            names = listed([source.name for source in self.without_effect])
            sentences.append(f"Not included here: {names}.")
        return sentences

    def _table(self) -> Rows:
        rows = []
        for row in self.rows:
            ends = {"q05": row.readings.q05, "q95": row.readings.q95}
            ends |= {"q05_with_bench": row.bench.q05, "q95_with_bench": row.bench.q95}
            rows.append({"quantity": row.quantity, "unit": row.unit, "median": row.readings.median} | ends | dict(row.shifts))
        return rows, {}


@cached_per_fit
def learned_errors(fit: Record) -> LearnedErrors | None:
    """Return the posterior of the errors of a bench; None without draws, or where no error is left to add."""
    if fit.sampled is None:
        return None
    with jax.enable_x64(True):
        return learn_errors(LogDensity(fit.model), fit.draws().flat_z.mean(axis=0))


@cached_per_fit
def with_bench_errors(fit: Record) -> Record:
    """Return a fit whose draws include the errors of the bench; itself where there are none.

    Its draws of parameters, and what follows from them, are those that people copy. What depends on readings, as the log
    likelihood, is left out: readings have the errors, parameters have not.
    """
    if fit.sampled is None or fit.sampled.has_bench_errors or (learned := learned_errors(fit)) is None:
        return fit
    draws = fit.draws()
    z = draws.flat_z + learned.draw(len(draws.flat_z), fit.provenance.seed) @ learned.moves.T
    shape, optimum = draws.z.shape[:-1], dict[str, np.ndarray]()
    with jax.enable_x64(True):
        values = values_program(fit)(z)
        if draws.optimum:
            optimum = dict(zip((OPTIMAL_LENGTH, OPTIMAL_EFFICIENCY), optimum_program(fit)(z), strict=True))
    moved = replace(
        draws,
        z=z.reshape(draws.z.shape),
        values={name: np.asarray(part).reshape(shape) for name, part in values.items()},
        optimum={name: part.reshape(shape) for name, part in optimum.items()},
        log_likelihood={},
        expected={},
        replicated={},
        has_bench_errors=True,
    )
    return replace(fit, sampled=moved)


@cached_per_fit
def error_budget(fit: Record) -> ErrorBudget | None:
    """Return the error budget of a fit; None without draws, or where no error of the bench is left to add.

    Args:
        fit: The fit.
    """
    learned = learned_errors(fit)
    quantities = list_answers(fit) if learned is not None else {}
    if learned is None or not quantities:
        return None
    errors = learned.draw(len(fit.draws().flat_z), fit.provenance.seed)
    deviations, with_errors = errors - errors.mean(axis=0), list_answers(with_bench_errors(fit))
    rows = []
    for name, (unit, draws) in quantities.items():
        moved = with_errors[name][1]
        slopes = np.linalg.lstsq(deviations, moved - draws, rcond=None)[0]
        slopes[np.abs(slopes) < _ROUNDING * np.std(draws)] = 0.0
        shifts = {
            source.name: float(np.std(deviations[:, learned.source == number] @ slopes[learned.source == number]))
            for number, source in enumerate(learned.sources)
        }
        scale, degrees = fit_t_distribution(draws)
        effective = effective_degrees_of_freedom([scale, *shifts.values()], [degrees, *[np.inf] * len(shifts)])
        rows.append(BudgetRow(name, unit, Interval.of(draws), Interval.of(moved), shifts, effective))
    return ErrorBudget(learned.sources, tuple(rows), _list_learned(learned), learned.without_effect)


def _list_learned(learned: LearnedErrors) -> tuple[LearnedError, ...]:
    """Return each error of the bench with what readings reveal of it."""
    sds, rows = np.sqrt(np.diag(learned.covariance)), []
    steps = [(step, size) for source in learned.sources for step, size in source.steps.items()]
    for (step, size), mean, sd in zip(steps, learned.mean, sds, strict=True):
        words, unit, scale = _SHOWN_ERRORS[step.kind]
        one_sd = size * STEP * scale
        rows.append(LearnedError(words, unit, -float(mean) * one_sd, float(sd) * one_sd, one_sd))
    return tuple(rows)


def list_answers(fit: Record) -> dict[str, tuple[str, np.ndarray]]:
    """Return unit and draws of every coefficient, the best length and the efficiency there."""
    draws, free = fit.draws(), fit.model.space.free
    quantities = {p.name: (p.unit, draws.values[p.name].ravel()) for p in free if p.role in KEY_ROLES}
    route = fit.dataset.description.route
    for name, unit in ((OPTIMAL_LENGTH, route.unit if route else ""), (OPTIMAL_EFFICIENCY, "1")):
        if name in draws.optimum:
            quantities[name] = (unit, draws.optimum[name].ravel())
    return quantities


def budget_heads(budget: ErrorBudget) -> tuple[str, ...]:
    """Return the headings of `budget_rows`."""
    return ("quantity", "readings alone", "with errors", "k", "dof", *(source.heading for source in budget.sources))


def budget_rows(budget: ErrorBudget) -> list[tuple[str, ...]]:
    """Return a row for each quantity: both intervals, and the shifts by one standard deviation of each source."""
    rows = list[tuple[str, ...]]()
    for row in budget.rows:
        digits = row.readings.digits
        name = row.quantity if row.unit in ("", "1") else f"{row.quantity} ({row.unit})"
        shifts = [f"{row.shifts[source.name]:.1g}" for source in budget.sources]
        intervals = row.readings.range_text(digits), row.bench.range_text(digits)
        rows.append((name, *intervals, f"{row.coverage_factor:.2f}", f"{row.degrees_of_freedom:.0f}", *shifts))
    return rows


def budget_text(fit: Record) -> str:
    """Return the error budget as a table with what it says; empty without draws."""
    budget = error_budget(fit)
    if budget is None:
        return ""
    note = (
        "k is the coverage factor, dof the effective degrees of freedom by Welch and Satterthwaite, inf where tails are those "
        "of a normal distribution; the other columns are the shifts by one standard uncertainty of each error, as far as "
        "readings leave it open. Propagated by Monte Carlo (JCGM 101)."
    )
    sentences = (filled(sentence) for sentence in (*budget.sentences(), note))
    return "\n".join([TITLE, table(budget_heads(budget), budget_rows(budget)), *sentences])


def budget_section(fit: Record) -> PageSection | None:
    """Return the error budget as a section of the report; None without draws."""
    budget = error_budget(fit)
    if budget is None:
        return None
    return prose_section(TITLE, budget.sentences(), [PageTable(budget_heads(budget), tuple(budget_rows(budget)))])


def answer_interval(fit: Record, quantity: str) -> Interval:
    """Return the interval of a parameter that people copy: with the errors of the bench.

    Args:
        fit: The fit, with draws.
        quantity: Name of a parameter.
    """
    return with_bench_errors(fit).parameter_of_draws(quantity)


def find_optimal_length(fit: Record) -> OptimalLength:
    """Return the best length and its efficiency with intervals that include the errors of the bench.

    Raises:
        UsageError: The description has no route to vary, or there is no posterior.
    """
    return with_bench_errors(fit).optimal_length_of_draws()


def errors_beyond_limits(fit: Record) -> list[str]:
    """Return clauses on errors of the bench that readings reveal to be beyond their limits."""
    budget = error_budget(fit)
    beyond = [error for error in budget.learned if error.contradicts_limit] if budget is not None else []
    return [f"{error}, beyond its limit under [errors]" for error in beyond]


def bench_sentences(fit: Record) -> list[str]:
    """Return what the first page says of bench errors: what readings reveal of them for sure, and that they widen an answer."""
    budget = error_budget(fit)
    revealed = [str(error) for error in budget.learned if error.is_off] if budget is not None else []
    sentences = [f"The readings reveal that {listed(revealed)}; the answers are corrected for it."] if revealed else []
    return [*sentences, *filter(None, [_widening_sentence(fit)])]


def _widening_sentence(fit: Record) -> str:
    """Return what the first answer would be that bench errors more than half widen; empty if they do not.

    'These intervals include bench errors, mainly wrap angles known to 3 deg and 3 % ([errors] in cable.toml); readings alone
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
