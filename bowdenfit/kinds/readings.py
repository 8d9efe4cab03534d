"""What the readings of a term are called in sentences, tables and figures."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Readings:
    """Words and units of a term's readings.

    Args:
        name: Name in results, which is the term's.
        table: The table they stand in, as in "the table of forces".
        words: What they are, as in "the readings of force runs".
        one: One of them, with its label in place of the braces.
        axis: Label of an axis that shows them.
        scatter_unit: Unit in which their residual standard deviation is said; empty where it is not.
        are_efficiencies: Whether they are output force over input force, shown in percent.
        are_runs: Whether each is a whole run.
    """

    name: str
    table: str
    words: str
    one: str
    axis: str
    scatter_unit: str = ""
    are_efficiencies: bool = False
    are_runs: bool = False

    @property
    def shown_scale(self) -> float:
        """Shown value over value."""
        return 100.0 if self.are_efficiencies else 1.0


def efficiencies(name: str, table: str, words: str, one: str, are_runs: bool = False) -> Readings:
    """Readings that are efficiencies."""
    return Readings(name, table, words, one, "Efficiency (%)", "% of the force", True, are_runs)
