"""The design answer: the best length with its uncertainty, the lengths on sale, and the window that is good enough.

Plain data that display themselves; loads no model.
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from bowdenfit.display import Block, Display, ResultTable, Rows, blocks_of, separate
from bowdenfit.inference.interval import Interval
from bowdenfit.words import capitalized, decimals, percent, significant

EDGE_FRACTION = 0.001  # an optimum this close to an end of the range, as a fraction of the range, is at the edge; a judgement


@dataclass(frozen=True)
class Choice:
    """One length that can be bought.

    Args:
        length: Route value.
        probability_best: Probability that no other choice is more efficient.
        expected_regret: Expected loss of efficiency against the best choice [1].
    """

    length: float
    probability_best: float
    expected_regret: float


@dataclass(frozen=True)
class Window:
    """Range of route values within a fraction of the best efficiency with a required probability.

    Args:
        within: Allowed relative loss of efficiency.
        probability: Probability that the whole window is within it.
        start: Lower end; NaN where no length is good enough that surely.
        stop: Upper end.
    """

    within: float
    probability: float
    start: float
    stop: float

    JSON: ClassVar = ("within", "probability", ("from", "start"), ("to", "stop"))


def is_at_edge(lengths: np.ndarray, limits: tuple[float, float]) -> np.ndarray:
    """Return which optima lie at an end of the range, where the true optimum may be outside."""
    tolerance = EDGE_FRACTION * (limits[1] - limits[0])
    return (lengths <= limits[0] + tolerance) | (lengths >= limits[1] - tolerance)


def rank_choices(lengths: np.ndarray, efficiency: np.ndarray) -> tuple[Choice, ...]:
    """Return probability of being best and expected regret of each length that can be bought.

    Args:
        lengths: The choices.
        efficiency: Efficiency of each draw (rows) at each choice (columns).
    """
    best = efficiency.max(axis=1, keepdims=True)
    wins = (efficiency == best) / (efficiency == best).sum(axis=1, keepdims=True)
    regret = (best - efficiency).mean(axis=0)
    rows = zip(lengths, wins.mean(axis=0), regret, strict=True)
    return tuple(Choice(float(a), float(b), float(c)) for a, b, c in rows)


def find_best_window(
    grid: np.ndarray, efficiency: np.ndarray, best: np.ndarray, within: float = 0.01, probability: float = 0.95
) -> Window:
    """Return the window whose every length is within a fraction of the best efficiency with a probability.

    'Within 1 % of the best with 95 % probability' holds at each length of the window; it is the connected stretch
    around the length where that probability is highest.

    Args:
        grid: Route values.
        efficiency: Efficiency of each draw (rows) on the grid (columns).
        best: Highest efficiency of each draw.
        within: Allowed relative loss.
        probability: Required probability.
    """
    good = (efficiency >= (1 - within) * best[:, None]).mean(axis=0)
    center = int(np.argmax(good))
    if good[center] < probability:
        return Window(within, probability, float("nan"), float("nan"))
    low = high = center
    while low > 0 and good[low - 1] >= probability:
        low -= 1
    while high < len(grid) - 1 and good[high + 1] >= probability:
        high += 1
    return Window(within, probability, float(grid[low]), float(grid[high]))


_WORTH_SAYING = 0.02  # probability of an optimum at an end of the range; 2,000 effective draws know it to 0.003


@dataclass(frozen=True, repr=False)
class OptimalLength(Display):
    """The best length with its uncertainty, the choices, and the window that is good enough.

    Args:
        variable: Name of the route variable.
        unit: Its unit.
        length: Route value of highest efficiency.
        efficiency: Efficiency there.
        at_edge: Share of draws whose optimum lies at an end of the range.
        window: Route values that are good enough.
        choices: Available lengths, in the order of the description.
        at_input_force: Input force at which the efficiency holds [N]; None where it is the same at any.
    """

    variable: str
    unit: str
    length: Interval
    efficiency: Interval
    at_edge: float
    window: Window
    choices: tuple[Choice, ...]
    at_input_force: float | None = None

    JSON: ClassVar = (
        ("route", "variable"), "unit", ("length", "length_at_edge"), "efficiency", "window", "choices", "at_input_force?",
    )  # fmt: skip

    @property
    def length_at_edge(self) -> dict[str, float]:
        """The length with the share of draws at an end."""
        return vars(self.length) | {"at_edge": self.at_edge}

    @property
    def best_choice(self) -> Choice | None:
        """The choice with the least expected regret."""
        return min(self.choices, key=lambda c: c.expected_regret, default=None)

    @property
    def what(self) -> str:
        """The route variable in words."""
        return self.variable.replace("_", " ")

    @property
    def action(self) -> str:
        """What to do in one clause: take the choice of least regret, or the best length if no choices are named."""
        choice, length = self.best_choice, self.length
        value = f"{choice.length:g}" if choice else f"{length.median:z.{length.digits}f}"
        is_cut = self.variable == "cable_length"
        if not self.is_certain:
            return f"measure more{' before you cut' if is_cut else ''}; the best guess is {value} {self.unit}"
        return f"{'cut the cable to' if is_cut else f'the best {self.what} is'} {value} {self.unit}"

    def _table(self) -> Rows:
        if not self.choices:
            quantities = {self.variable: self.length, "efficiency": self.efficiency}
            rows = [{"quantity": name} | vars(interval) for name, interval in quantities.items()]
            return rows, {self.variable: self.unit, "efficiency": "1"}
        rows = [{self.variable: c.length} | {k: v for k, v in vars(c).items() if k != "length"} for c in self.choices]
        return rows, {self.variable: self.unit, "probability_best": "1", "expected_regret": "1"}

    @property
    def headline(self) -> str:
        """The answer as a sentence."""
        return f"{self.action[0].upper()}{self.action[1:]}."

    def sentences(self) -> list[str]:
        """Sentences on how certain the length is, and which others would do."""
        at = "" if self.at_input_force is None else f", at an input force of {significant(self.at_input_force)} N"
        length, eta = self.length, self.efficiency.times(100)
        digits, of_force = length.digits, eta.digits
        sentences = [
            f"The best {self.what} is {length.median:z.{digits}f} {self.unit} (90 % interval {length.q05:z.{digits}f} to "
            f"{length.q95:z.{digits}f} {self.unit}); {eta.median:z.{of_force}f} % of the force is transmitted "
            f"({eta.q05:z.{of_force}f} to {eta.q95:z.{of_force}f} %){at}."
        ]
        if self.at_edge > _WORTH_SAYING:
            sentences.append(
                f"With {percent(self.at_edge, 0)} probability the best lies at an end of the range: a better {self.what} may "
                "lie outside what was measured."
            )
        if not self.is_certain:
            return [*sentences, self.not_good_enough]
        is_wide = self.window.stop - self.window.start > 10.0**-digits
        return [self.good_enough, *sentences] if is_wide else [*sentences, self.good_enough]

    @property
    def is_certain(self) -> bool:
        """Whether some length is good enough with the required probability."""
        return bool(np.isfinite(self.window.start))

    @property
    def good_enough(self) -> str:
        """Sentence on which lengths are good enough."""
        window = self.window
        digits = decimals(window.stop - window.start, window.start)
        return (
            f"Any {self.what} from {window.start:z.{digits}f} to {window.stop:z.{digits}f} {self.unit} is good enough: within "
            f"{percent(window.within, 0)} of the best with at least {percent(window.probability, 0)} probability."
        )

    @property
    def not_good_enough(self) -> str:
        """Sentence that no length is certain to be good enough."""
        window = self.window
        return (
            f"No single {self.what} is within {percent(window.within, 0)} of the best with "
            f"{percent(window.probability, 0)} probability; more measurements are needed."
        )

    @property
    def heads(self) -> tuple[str, str, str]:
        """Headings of the table of choices."""
        return f"{capitalized(self.what)} ({self.unit})", "probability of being best", "expected loss of efficiency"

    @property
    def rows(self) -> list[tuple[str, str, str]]:
        """Rows of the table of choices, under `heads`."""
        return [
            (f"{c.length:g}", percent(c.probability_best), f"{100 * c.expected_regret:.2f} points") for c in self.choices
        ]


@blocks_of.register
def _(best: OptimalLength) -> list[Block]:
    """Return what to do, how certain that is, and the choices in a table."""
    return separate([best.headline, *best.sentences()], [ResultTable(best.heads, best.rows)] if best.choices else [])
