"""What to measure next, as plain data: candidates in order, repeats of the best, and what is best after it."""

from dataclasses import dataclass
from typing import ClassVar

from bowdenfit.display import Display, Part, Rows
from bowdenfit.kinds.candidate import Candidate
from bowdenfit.questions.next.target import TargetQuantity

EQUAL_WITHIN = 2.0  # standard errors within which two candidates are as good as each other
_COLUMNS = ("words", "share", "error", "sd", "sd_error", "as_good", "cost")  # columns of a table
LEAST_SHARE = 0.01  # of the variance; a measurement that takes away less is not worth making


@dataclass(frozen=True, repr=False)
class RankedCandidate(Part):
    """One candidate and what it would do.

    Args:
        candidate: The candidate.
        name: As `--candidate` takes it.
        words: In a sentence.
        share: Share of the answer's variance that it takes away, on average [1].
        error: Monte Carlo standard error of the share [1].
        sd: Standard deviation of the answer afterwards: the root of its average variance.
        sd_error: Monte Carlo standard error of that.
        as_good: Whether the best candidate is better by no more than the Monte Carlo error of the difference.
        cost: What it costs; None where nothing was said of costs.
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
    """What the best candidate would do if it were measured several times, each time with a new mounting.

    Args:
        times: How often.
        sd: Standard deviation of the answer afterwards.
    """

    times: tuple[int, ...]
    sd: tuple[float, ...]

    def to_halve(self, sd: float) -> int | None:
        """The least number of times that halves a standard deviation; None where none of them does."""
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


@dataclass(frozen=True, repr=False)
class LoadAndStroke(Part):
    """At which load and of which stroke the readings of the best candidate tell most.

    Args:
        usual: What the candidate was taken to be, in words: the loads and strokes of the runs made so far.
        ranked: The same with all its readings at one load and of one stroke, best first, with that as usual among them.
    """

    usual: str
    ranked: tuple[RankedCandidate, ...]

    JSON: ClassVar = ("usual", ("candidates", "ranked"))


@dataclass(frozen=True, repr=False)
class NextMeasurement(Display):
    """Candidates from the most to the least worth measuring.

    Args:
        answer: What is to be known better.
        ranked: The candidates.
        repeats: What several readings of the best would do; None where no candidate does anything.
        plan: The best, then what is best beside it, and so on.
        route_label: Axis label of the route; empty without one.
        route_range: Where the curves hold.
        converged: Whether the fit may be trusted.
        loads: Lowest and highest input force of a run like those made so far [N]; None where there is none.
        stop: Whether nothing needs to be measured, in a sentence.
        within: At which load and stroke the best is best made; None where it says so itself, or is not made under any.
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

    JSON: ClassVar = (
        "answer", ("best", "best_name"), ("candidates", "ranked"), ("load_and_stroke", "within"), "repeats", "plan",
        "converged", "loads?", "stop",
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
    """Whether a share of the variance is worth the trouble, and more than the error of its estimate."""
    return share > max(LEAST_SHARE, EQUAL_WITHIN * error)
