"""Everything measured on one cable: at most one table a kind."""

from dataclasses import dataclass, replace
from typing import Any, TypeVar

from bowdenfit.display import Display

AnyTable = TypeVar("AnyTable")


@dataclass(frozen=True, repr=False)
class Measurements(Display):
    """The tables of one cable, each found by its class, and remarks on how they were read.

    Args:
        tables: At most one of a class.
        remarks: What had to be assumed.
    """

    tables: tuple[Any, ...] = ()
    remarks: tuple[str, ...] = ()

    def sentences(self) -> list[str]:
        """Which tables there are."""
        return [f"{', '.join(type(table).__name__ for table in self.tables) or 'No table'}.", *self.remarks]

    def table(self, of: type[AnyTable]) -> AnyTable | None:
        """The table of a class; None if nothing of that kind was measured."""
        return next((table for table in self.tables if type(table) is of), None)

    def with_tables(self, *tables: Any) -> "Measurements":
        """The same with other tables in place of those of their classes; None changes nothing."""
        new = {type(table): table for table in tables if table is not None}
        kept = {type(table): table for table in self.tables}
        return replace(self, tables=tuple((kept | new).values()))
