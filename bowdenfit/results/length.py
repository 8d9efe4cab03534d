"""The best length with its uncertainty, as plain data that show themselves; loads no model."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from bowdenfit.display import Display, Rows
from bowdenfit.inference.interval import Interval
from bowdenfit.results.choices import Choice, Window
from bowdenfit.words import decimals, filled, percent, significant, table

_WORTH_SAYING = 0.02  # probability of an optimum at an end of the range; draws know it to 0.003


@dataclass(frozen=True, repr=False)
class OptimalLength(Display):
    """The design answer.

    Args:
        variable: Name of the route variable.
        unit: Its unit.
        length: Route value of highest efficiency.
        efficiency: Efficiency there.
        at_edge: Share of draws whose optimum lies at an end of the range.
        window: Route values that are good enough.
        choices: What can be bought, in the order of the description.
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
        """What to do, or what is best, in one clause: the choice that costs least, or the best length where none is named."""
        choice, length = self.best_choice, self.length
        value = f"{choice.length:g}" if choice else f"{length.median:z.{length.digits}f}"
        is_cut = self.variable == "cable_length"
        if not self.is_certain:
            return f"measure more{' before you cut' if is_cut else ''}; the best guess is {value} {self.unit}"
        return f"{'cut the cable to' if is_cut else f'the best {self.what} is'} {value} {self.unit}"

    def __str__(self) -> str:
        return "\n".join([self.headline, *(filled(sentence) for sentence in self.sentences()), *self._of_choices()])

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
        """How sure it is, and what would do as well."""
        at = "" if self.at_input_force is None else f", at an input force of {significant(self.at_input_force)} N"
        length, eta = self.length, self.efficiency.times(100)
        digits, of_force = length.digits, eta.digits
        sentences = [
            f"The best {self.what} is {length.median:z.{digits}f} {self.unit} (90 % interval {length.q05:z.{digits}f} to "
            f"{length.q95:z.{digits}f} {self.unit}); {eta.median:z.{of_force}f} % of the force arrives there "
            f"({eta.q05:z.{of_force}f} to {eta.q95:z.{of_force}f} %){at}."
        ]
        if self.at_edge > _WORTH_SAYING:
            sentences.append(
                f"With {percent(self.at_edge, 0)} probability the best lies at an end of the range: a better {self.what} may "
                "lie outside what was measured."
            )
        return [*sentences, self.good_enough if self.is_certain else self.not_good_enough]

    @property
    def is_certain(self) -> bool:
        """Whether some length is good enough for sure."""
        return bool(np.isfinite(self.window.start))

    @property
    def good_enough(self) -> str:
        """Which lengths will do."""
        window = self.window
        digits = decimals(window.stop - window.start, window.start)
        return (
            f"Any {self.what} from {window.start:z.{digits}f} to {window.stop:z.{digits}f} {self.unit} is good enough: within "
            f"{percent(window.within, 0)} of the best with at least {percent(window.probability, 0)} probability."
        )

    @property
    def not_good_enough(self) -> str:
        """That none will do yet."""
        window = self.window
        return (
            f"No single {self.what} is within {percent(window.within, 0)} of the best with "
            f"{percent(window.probability, 0)} probability; more measurements are needed."
        )

    def _of_choices(self) -> list[str]:
        return ["", table(self.heads, self.rows)] if self.choices else []

    @property
    def heads(self) -> tuple[str, str, str]:
        """Of the table of choices."""
        return f"{self.what.capitalize()} ({self.unit})", "probability of being best", "expected loss of efficiency"

    @property
    def rows(self) -> list[tuple[str, str, str]]:
        """A row for each choice, under `heads`."""
        return [
            (f"{c.length:g}", percent(c.probability_best), f"{100 * c.expected_regret:.2f} points") for c in self.choices
        ]
