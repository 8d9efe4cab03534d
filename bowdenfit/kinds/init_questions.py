"""How `bowdenfit init` recognizes the files of a kind of measurement, and what it asks about them."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import inf
from typing import Any

from bowdenfit.files.matching import Quantity


@dataclass(frozen=True)
class WantedColumn:
    """A column of a table.

    Args:
        quantity: What it holds.
        words: The same for people, such as "the force at the motor".
        also: Quantities that do instead.
        optional: Whether a table can be without it.
        numbers: The lowest and the highest number that may stand for words.
    """

    quantity: Quantity
    words: str
    also: tuple[Quantity, ...] = ()
    optional: bool = False
    numbers: tuple[float, float] = (-inf, inf)


@dataclass(frozen=True)
class YesNoQuestion:
    """A question whose yes writes a setting beside the file.

    Args:
        unless: Name of the column that answers it; it is asked only where there is none.
        words: The question, with braces for the name of the file.
        key, value: The setting.
    """

    unless: str
    words: str
    key: str
    value: str


@dataclass(frozen=True)
class InitQuestions:
    """How files of a kind are recognized, and what is asked about them.

    Args:
        holds: What such a file holds, for people.
        columns: Its columns but for lengths and wrap angles of contacts.
        yes_no: Questions beside those for its columns.
        by_length: Whether its columns are the wrap angles of contacts at several lengths.
        has_own_angles: Whether its rows may have a length, and wrap angles of contacts.
        several: Whether it may be several files.
        is_guessed: Whether a file that has the columns is taken for one.
        description: What such a table makes of the rest of the description.
    """

    holds: str
    columns: tuple[WantedColumn, ...] = ()
    yes_no: tuple[YesNoQuestion, ...] = ()
    by_length: bool = False
    has_own_angles: bool = False
    several: bool = False
    is_guessed: bool = True
    description: Mapping[str, Any] = field(default_factory=dict, hash=False)

    @property
    def required(self) -> tuple[WantedColumn, ...]:
        """The columns that a table cannot be without."""
        return tuple(column for column in self.columns if not column.optional)
