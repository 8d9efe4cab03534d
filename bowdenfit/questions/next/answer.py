"""What to measure next, as plain data: the answer that is to be narrowed, and candidates in order."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from bowdenfit.display import Display, Rows
from bowdenfit.errors import UsageError, suggest_name
from bowdenfit.kinds.candidate import Candidate
from bowdenfit.questions.error_budget import find_optimal_length
from bowdenfit.results.record import OPTIMAL_EFFICIENCY, OPTIMAL_LENGTH, Record

EQUAL_WITHIN = 2.0  # standard errors within which two candidates are as good as each other: 95 % of chance
LEAST_SHARE = 0.01  # of the variance; a measurement that takes away less is not worth making; a judgement
_COLUMNS = ("words", "share", "error", "sd", "sd_error", "as_good", "cost")  # columns of a table


@dataclass(frozen=True)
class TargetQuantity:
    """Quantity that is to be known better: the best length, an efficiency or a parameter.

    Args:
        name: As the user writes it.
        words: In a sentence.
        unit: Unit of its standard deviation, empty where there is none.
        draws: Its value for each draw of the posterior.
    """

    name: str
    words: str
    unit: str
    draws: np.ndarray

    JSON: ClassVar = ("name", "words", "unit", "sd")

    @property
    def sd(self) -> float:
        """Standard deviation as things are."""
        return float(np.std(self.draws))

    def sd_after(self, share: float) -> float:
        """Return the standard deviation once a measurement has taken away this share of the variance."""
        return self.sd * float(np.sqrt(max(1.0 - share, 0.0)))


def choose_target(fit: Record, name: str | None) -> TargetQuantity:
    """Return the answer that is to be known better.

    Args:
        fit: The fit.
        name: "optimal-length", "optimal-efficiency", "efficiency@470", or a parameter. If omitted the optimal length where
            there is a route, else the friction coefficient, or with several the efficiency at the nominal wrap angles.

    Raises:
        UsageError: There is no such answer, or no posterior.
    """
    draws, route = fit.draws(), fit.dataset.description.route
    if name is None:
        coefficients = [p.name for p in fit.model.space.free if p.role == "friction"]
        name = "optimal-length" if route else coefficients[0] if len(coefficients) == 1 else "efficiency"
    kind, _, place = name.partition("@")
    if name in draws.values:
        return _make_parameter_target(fit, name)
    if kind == "efficiency":
        return _make_efficiency_target(fit, name, place)
    if name in ("optimal-length", "optimal-efficiency"):
        best = find_optimal_length(fit)  # refuses cables without a route
        variable = best.variable.replace("_", " ")
        if name == "optimal-length":
            return TargetQuantity(name, f"the best {variable}", best.unit, draws.optimum[OPTIMAL_LENGTH].ravel())
        return TargetQuantity(
            name, f"the efficiency at the best {variable}", "points", 100 * draws.optimum[OPTIMAL_EFFICIENCY].ravel()
        )
    known_names = ["optimal-length", "optimal-efficiency", "efficiency@..."] if route else ["efficiency"]
    raise UsageError(f"--for {name!r} is not an answer of this fit{suggest_name(name, [*known_names, *draws.values])}")


def _make_parameter_target(fit: Record, name: str) -> TargetQuantity:
    """Return a parameter, or a coefficient of a curve."""
    units = {p.name: p.unit for p in fit.model.space.free}
    draws = fit.draws().values[name].ravel()
    if not np.all(np.isfinite(draws)):
        raise UsageError(
            f"--for {name}: some draws have no finite {name}, so it has no variance that could be reduced; ask for another "
            "parameter of the same curve."
        )
    unit = units.get(name, "1")
    return TargetQuantity(name, name, "" if unit == "1" else unit, draws)


def _make_efficiency_target(fit: Record, name: str, where: str) -> TargetQuantity:
    """Return the efficiency at a length, or without a route at the nominal wrap angles, in points of percent."""
    route = fit.dataset.description.route
    if route is None:
        if where:
            raise UsageError(
                f"--for {name!r}: this cable has no route, and its efficiency is that at its nominal wrap angles; write "
                "--for efficiency."
            )
        return TargetQuantity(
            name, "the efficiency at the nominal wrap angles", "points", 100 * fit.efficiency_draws(0.0)[:, 0]
        )
    try:
        at = float(where.removesuffix(route.unit))
    except ValueError:
        raise UsageError(
            f"--for {name!r} does not say where; write it as efficiency@{route.middle:g}, in {route.unit}."
        ) from None
    if not route.range[0] <= at <= route.range[1]:
        low, high = route.range
        raise UsageError(
            f"--for {name!r}: {at:g} {route.unit} lies outside the range {low:g} to {high:g} {route.unit}."
        )
    return TargetQuantity(
        name, f"the efficiency at {at:g} {route.unit}", "points", 100 * fit.efficiency_draws(at)[:, 0]
    )


@dataclass(frozen=True)
class RankedCandidate:
    """One candidate and what it would do.

    Args:
        candidate: The candidate.
        name: As `--candidate` takes it.
        words: In a sentence.
        share: Share of the answer's variance that it takes away, on average [1].
        error: Monte Carlo standard error of the share [1].
        sd: Standard deviation of the answer afterwards: the root of its average variance.
        sd_error: Monte Carlo standard error of that.
        as_good: Whether its share is clearly above 0, and the best candidate's larger by no more than the Monte Carlo error of
            the difference.
        cost: Cost of the measurement; None if no costs are stated.
    """

    candidate: Candidate
    name: str
    words: str
    share: float
    error: float
    sd: float
    sd_error: float
    as_good: bool
    cost: float | None = None

    JSON: ClassVar = (
        ("candidate", "name"),
        "words",
        ("variance_reduction", "share"),
        ("standard_error", "error"),
        ("sd_after", "sd"),
        ("sd_after_standard_error", "sd_error"),
        ("as_good_as_best", "as_good"),
        "cost",
        ("variance_reduction_per_cost", "share_per_cost"),
    )

    @property
    def is_noticeable(self) -> bool:
        """Whether it would do anything worth the trouble."""
        return is_noticeable(self.share, self.error)

    @property
    def worth(self) -> float:
        """What the ranking goes by: the share of the variance, for each unit of cost where there are costs."""
        return self.share / (self.cost or 1.0)

    @property
    def share_per_cost(self) -> float | None:
        """The same; None where nothing was said of costs."""
        return None if self.cost is None else self.worth


@dataclass(frozen=True)
class Repeats:
    """Effect of the best candidate if it were measured several times, each time with a new mounting.

    Args:
        times: How often.
        sd: Standard deviation of the answer afterwards.
    """

    times: tuple[int, ...]
    sd: tuple[float, ...]

    def to_halve(self, sd: float) -> int | None:
        """Return the least number of times that halves a standard deviation; None where none of them does."""
        return next((n for n, after in zip(self.times, self.sd, strict=True) if after <= sd / 2), None)


@dataclass(frozen=True)
class PlannedMeasurement:
    """One measurement of several made one after the other.

    Args:
        words: The candidate in a sentence.
        name: As `--candidate` takes it.
        sd: Standard deviation of the answer once it and those before it are made.
    """

    words: str
    name: str
    sd: float


@dataclass(frozen=True)
class LoadAndStroke:
    """At which load and of which stroke the readings of the best candidate tell most.

    Args:
        usual: Loads and strokes assumed for the candidate, in words: those of the runs made so far.
        ranked: The same with all its readings at one load and of one stroke, best first, with that as usual among them.
    """

    usual: str
    ranked: tuple[RankedCandidate, ...]

    JSON: ClassVar = ("usual", ("candidates", "ranked"))


@dataclass(frozen=True)
class SecondMounting:
    """What a second mounting would do where all readings come from one.

    How far mountings differ is then known by its prior alone, whose tail is so long that variances, and the average of what may
    come, are those of a few draws: widths of 90 % intervals stand here, the middle of all outcomes and their range.

    Args:
        words: The measurement in a sentence.
        name: As `--candidate` takes it.
        width_now: Width of the 90 % interval of the answer as things are.
        width: Median over all outcomes of its width afterwards.
        low, high: 5 and 95 % quantiles of that.
    """

    words: str
    name: str
    width_now: float
    width: float
    low: float
    high: float


@dataclass(frozen=True, repr=False)
class NextMeasurement(Display):
    """Candidates from the most to the least worth measuring.

    Args:
        answer: The answer to narrow.
        ranked: The candidates.
        repeats: Effect of several readings of the best; None where no candidate does anything.
        plan: The best, then what is best beside it, and so on.
        route_label: Axis label of the route; empty without one.
        route_range: Where the curves hold.
        converged: Whether the fit may be trusted.
        loads: Lowest and highest input force of a run like those made so far [N]; None where there is none.
        stop: Whether nothing needs to be measured, in a sentence.
        within: At which load and stroke the best is best made; None where it says so itself, or is not made under any.
        second_mounting: Effect of a second mounting; None where there are several already.
    """

    answer: TargetQuantity
    ranked: tuple[RankedCandidate, ...]
    repeats: Repeats | None
    plan: tuple[PlannedMeasurement, ...]
    route_label: str
    route_range: tuple[float, float]
    converged: bool
    loads: tuple[float, float] | None = None
    stop: str = ""
    within: LoadAndStroke | None = None
    second_mounting: SecondMounting | None = None

    JSON: ClassVar = (
        "answer", ("best", "best_name"), ("candidates", "ranked"), ("load_and_stroke", "within"), "repeats", "plan",
        "converged", "loads?", "stop", "second_mounting?",
    )  # fmt: skip

    @property
    def best(self) -> RankedCandidate | None:
        """The candidate most worth measuring; None where none would narrow the answer noticeably."""
        first = self.ranked[0]
        return first if first.is_noticeable else None

    @property
    def best_name(self) -> str | None:
        """Its name."""
        return self.best.name if self.best else None

    def _table(self) -> Rows:
        rows = [{"measurement": r.name} | {key: vars(r)[key] for key in _COLUMNS} for r in self.ranked]
        return rows, {"share": "1", "error": "1", "sd": self.answer.unit or "1", "sd_error": self.answer.unit or "1"}


def is_noticeable(share: float, error: float) -> bool:
    """Return whether a share of the variance is worth the trouble, and more than the error of its estimate."""
    return share > max(LEAST_SHARE, EQUAL_WITHIN * error)
