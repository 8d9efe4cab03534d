"""The best length with its uncertainty, as plain data that show themselves; loads no model."""

from dataclasses import dataclass
from html import escape
from typing import ClassVar

import numpy as np

from bowdenfit.inference.interval import Interval
from bowdenfit.results.choices import Choice, Window
from bowdenfit.words import html_table


@dataclass(frozen=True)
class OptimalLength:
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

    def __str__(self) -> str:
        return "\n".join(self.lines())

    def lines(self) -> list[str]:
        """The answer in sentences and a small table."""
        at = "" if self.at_input_force is None else f" at an input force of {self.at_input_force:.3g} N"
        what, unit, length, eta = self.variable.replace("_", " "), self.unit, self.length, self.efficiency
        lines = [
            f"Best {what}: {length.median:.1f} {unit} (90 % interval {length.q05:.1f} to {length.q95:.1f} {unit}), "
            f"efficiency there {eta.median:.1%} ({eta.q05:.1%} to {eta.q95:.1%}){at}."
        ]
        if self.at_edge > 0.005:
            lines.append(
                f"In {self.at_edge:.0%} of the draws the optimum lies at an end of the range: a better {what} may lie "
                "outside what was measured."
            )
        window = self.window
        if np.isfinite(window.start):
            lines.append(
                f"Any {what} from {window.start:.0f} to {window.stop:.0f} {unit} is within {window.within:.0%} of the "
                f"best with at least {window.probability:.0%} probability."
            )
        else:
            lines.append(
                f"No single {what} is within {window.within:.0%} of the best with {window.probability:.0%} probability; "
                "more measurements are needed."
            )
        if self.choices:
            lines += [
                "",
                f"{what.capitalize() + ' (' + unit + ')':>20}  {'P(best)':>8}  {'expected loss of efficiency':>28}",
            ]
            lines += [
                f"{c.length:>20g}  {c.probability_best:>8.1%}  {100 * c.expected_regret:>21.2f} points"
                for c in self.choices
            ]
        return lines

    def _repr_html_(self) -> str:
        shown = [line for line in self.lines() if line and "P(best)" not in line]
        sentences = shown[: len(shown) - len(self.choices)]
        text = "".join(f"<p>{escape(line)}</p>" for line in sentences)
        heads = (
            f"{self.variable.replace('_', ' ').capitalize()} ({self.unit})",
            "P(best)",
            "Expected loss of efficiency",
        )
        rows = [
            (f"{c.length:g}", f"{c.probability_best:.1%}", f"{100 * c.expected_regret:.2f} points")
            for c in self.choices
        ]
        return text + (html_table(heads, rows) if rows else "")
