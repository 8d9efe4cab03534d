"""What is asked of a file that is to hold a kind of measurement, where no description says it yet."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import inf
from typing import Any

from bowdenfit.files.matching import Quantity


@dataclass(frozen=True)
class Wanted:
    """A column of a table.

    Args:
        quantity: What it holds.
        words: The same for people, such as "the force at the motor".
        also: Quantities that do instead.
        optional: Whether a table can be without it.
        numbers: The lowest and the highest that may stand for words.
    """

    quantity: Quantity
    words: str
    also: tuple[Quantity, ...] = ()
    optional: bool = False
    numbers: tuple[float, float] = (-inf, inf)


@dataclass(frozen=True)
class Switch:
    """What a person says with yes or no where no column says it.

    Args:
        unless: Name of the column that would.
        words: The question.
        key, value: What a yes writes beside the file.
    """

    unless: str
    words: str
    key: str
    value: str


@dataclass(frozen=True)
class Asked:
    """How files of a kind are told, and what is asked of them.

    Args:
        holds: What such a file holds, for people.
        columns: Its columns but for lengths and wrap angles of contacts.
        switches: What is asked beside them.
        by_length: Whether its columns are the wrap angles of contacts at several lengths.
        has_own_angles: Whether its rows may have a length, and wrap angles of contacts.
        several: Whether it may be several files.
        is_guessed: Whether a file that has the columns is taken for one.
        description: What such a table makes of the rest of the description.
    """

    holds: str
    columns: tuple[Wanted, ...] = ()
    switches: tuple[Switch, ...] = ()
    by_length: bool = False
    has_own_angles: bool = False
    several: bool = False
    is_guessed: bool = True
    description: Mapping[str, Any] = field(default_factory=dict, hash=False)

    @property
    def required(self) -> tuple[Wanted, ...]:
        """The columns that a table cannot be without."""
        return tuple(each for each in self.columns if not each.optional)
