"""`Kind`: how tables of one kind of measurement are read, checked, described and written, in NumPy.

Its half in the likelihood is a `TermKind` (`kinds/term.py`).

A kind is one class, `kinds/<kind>/kind.py`, and one line in `KINDS`; one of another package has an entry point instead. It
must give five things, and Python and mypy refuse a class that lacks one:

- `name`: what a table is called under [tables] in cable.toml, and in fit.json;
- `table`: the class of its tables, which hold arrays in N, mm, rad and s;
- `readings`: what its readings are called in sentences, tables and figures;
- `read`: a table from its files;
- `describe`: what was understood of a table, for `bowdenfit check`.

What else `Kind` has is optional; its plain default adds nothing and refuses nothing. Some things belong together, and a kind
that has them derives from their class too:

- `FrictionKind`: its readings show friction, at some lengths, wrap angles, forces and speeds, and of some groups
  (`FrictionTableKind` is one whose rows carry their own lengths and wrap angles);
- `RopeKind`: its readings show the rope itself, at some bends and under some tensions;
- `PlannedKind`: `bowdenfit simulate` can make such a table from the [design] of a plan.

The class says the short things itself. What is longer than a page stands in modules beside it: `table.py` with the class of
its tables where several modules import it, its reader, and whatever else has a name of its own. Nothing here or there may
import JAX, because reading a table must not wait for it.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

import numpy as np
from typing_extensions import override

from bowdenfit.description import ContactSettings, Description, Table, TableSettings
from bowdenfit.description.file import Stated
from bowdenfit.description.values import Frozen
from bowdenfit.errors import DatasetError, Faults
from bowdenfit.kinds.bench_error import BenchError
from bowdenfit.kinds.measured_columns import MeasuredColumn
from bowdenfit.kinds.plausibility import CoarseReadings
from bowdenfit.kinds.rows import FileRows, ForceRows, Rows
from bowdenfit.kinds.table_files import AnyTable, InitQuestions, Source, TableFromFiles
from bowdenfit.kinds.tables import AngleTable, Measurements
from bowdenfit.types import Vector

AnyRows = TypeVar("AnyRows", bound=Rows)


@dataclass(frozen=True)
class Readings:
    """Words and units of a term's readings.

    Args:
        name: Name in results, which is the term's.
        table: The table they stand in, as in "the table of forces".
        words: Name of the readings in sentences, as in "the readings of force runs".
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
        """Factor from a value to how it is shown: 100 for efficiencies in percent."""
        return 100.0 if self.are_efficiencies else 1.0


def efficiency_readings(name: str, table: str, words: str, one: str, are_runs: bool = False) -> Readings:
    """Return words for readings that are efficiencies."""
    return Readings(name, table, words, one, "Efficiency (%)", "% of the force", True, are_runs)


class Design(Frozen):
    """Part of a plan's [design] that a kind reads; a whole design has the fields of every kind (`descriptions.py`)."""


class Kind(ABC, Generic[AnyTable]):
    """A kind of measurement; what a subclass must give is abstract here.

    Attributes:
        settings: Model of the settings under its name in [tables].
        heading: Heading over the lines of `describe`, where they are a section of their own.
        methods_sentence: How its readings are modeled, in a sentence of a paper.
        needs_load_cell: Whether it cannot stand beside a [motor] in the place of the input's load cell.
        takes_channels: Whether its files are recordings, whose channels can be named on the command line.
        init_questions: How `bowdenfit init` recognizes its files, and what it asks about them; None if it never offers it.
        term_class: Module and class of its half in the likelihood, such as "scratch.losses.term:LossTerms", if another package
            adds it; those of bowdenfit stand in `kinds/terms.py`.
    """

    settings: type[TableSettings] = Table
    heading: str = ""
    methods_sentence: str = ""
    needs_load_cell: bool = False
    takes_channels: bool = False
    init_questions: InitQuestions | None = None
    term_class: str = ""

    @property
    @abstractmethod
    def name(self) -> str:
        """Name under [tables] in cable.toml, and in fit.json."""

    @property
    @abstractmethod
    def table(self) -> type[AnyTable]:
        """Class of its tables; no two kinds share one."""

    @property
    @abstractmethod
    def readings(self) -> tuple[Readings, ...]:
        """Names and units of its readings, one entry for each name that its terms give them."""

    @abstractmethod
    def read(self, source: Source) -> TableFromFiles[AnyTable]:
        """Read the files of a table.

        Raises:
            DatasetError: Says what is wrong, the usual cause and what to do.
        """

    @abstractmethod
    def describe(self, table: AnyTable, description: Description) -> list[str]:
        """Return what was understood of a table, line by line."""

    def describe_single_file(self, table: AnyTable) -> str:
        """Return what a file is that holds such a table alone, in words with an article."""
        return "a table"

    def count_readings(self, table: AnyTable) -> str:
        """Return how many readings were fitted, in words; empty where `TermKind.count_readings` says it."""
        return ""

    def file_rows(self, table: AnyTable, description: Description) -> FileRows | None:
        """Return the headings and rows of a file that holds the table; None if such files are not made of rows."""
        return None

    def file_name(self, settings: Any) -> str:
        """Return the file that a table is written to: as stated, or by the name of its kind."""
        return getattr(settings, "file", None) or f"{self.name}.csv"

    def contradiction(self, settings: Any, description: Description) -> str:
        """Return what is contradictory in a description, in a sentence without its full stop; empty if nothing is.

        Args:
            settings: Settings under [tables]; None without such a table.
            description: The whole description.
        """
        return ""

    def quantities(self, settings: Any, description: Description) -> list[Stated]:
        """Return the quantities in the settings, whose units are checked."""
        return []

    def check(self, table: AnyTable, description: Description, measurements: Measurements) -> None:
        """Refuse a table that does not fit the description or the other tables.

        Raises:
            DatasetError: Says what does not fit, and what to do.
        """

    def warnings(self, table: AnyTable, description: Description, measurements: Measurements) -> list[str]:
        """Return warnings of what a table cannot determine, as far as counting shows."""
        return []

    def copied_readings(self, table: AnyTable) -> list[str]:
        """Return which readings were copied from others, in sentences without a first capital or remedy."""
        return []

    def misread_angles(self, table: AnyTable, description: Description) -> str:
        """Describe wrap angles that must be wrong, because equal ones lose too differently; empty if there are none."""
        return ""

    def bench_faults(self, table: AnyTable, description: Description) -> list[str]:
        """Return faults of the bench that the readings show by themselves, each with its usual cause and what to do."""
        return []

    def coarse_readings(self, table: AnyTable) -> CoarseReadings | None:
        """Return what is known of a table whose repeated readings are equal to the last digit; None for any other."""
        return None

    def measured_columns(self, table: AnyTable) -> list[MeasuredColumn]:
        """Return the columns that a table's instruments filled, in which readings may be cut off or far from all others."""
        return []

    def with_bench_error(self, table: AnyTable, error: BenchError) -> AnyTable:
        """Return the table as a bench with another systematic error would have given it; the same where it shows none."""
        return table

    def why_implausible(self, measured: AnyTable, simulated: AnyTable) -> str:
        """Return why no bench would hand in the simulated table, in a few words; empty if one might."""
        return ""


class FrictionKind(Kind[AnyTable]):
    """A kind whose readings show friction."""

    @abstractmethod
    def conditions(self, table: AnyTable) -> ForceRows:
        """Return the lengths and wrap angles at which friction was measured."""

    def forces(self, table: AnyTable) -> Vector:
        """Return the forces that friction acted on [N]."""
        return np.zeros(0)

    def speeds(self, table: AnyTable) -> Vector:
        """Return the speeds of sliding [`velocity_unit`]."""
        return np.zeros(0)

    def typical_speeds(self, table: AnyTable) -> list[float]:
        """Return a few speeds that represent all [`velocity_unit`]."""
        return []

    def velocity_unit(self, table: AnyTable) -> str:
        """Return "mm/s" for speeds of the rope and "rad/s" for those of the motor; empty without velocities."""
        return ""

    def groups(self, table: AnyTable) -> tuple[str, ...]:
        """Return the group of each row, such as "new rope"; empty without groups."""
        return ()


class RopeKind(Kind[AnyTable]):
    """A kind whose readings show the rope itself: how it stretches, or how it is preloaded."""

    @abstractmethod
    def bends(self, table: AnyTable) -> Vector:
        """Return the total wrap angles of the cable [rad]."""

    def tensions(self, table: AnyTable) -> Vector:
        """Return tensions of the rope that are not `FrictionKind.forces` [N]."""
        return np.zeros(0)


class PlannedKind(Kind[AnyTable]):
    """A kind that a plan can ask for: `bowdenfit simulate` makes its tables from [design]."""

    @property
    @abstractmethod
    def design(self) -> type[Design]:
        """Model of the part of [design] that it reads."""

    @abstractmethod
    def empty_table(self, design: Any, description: Description, file: str) -> AnyTable:
        """Return a table of a design's shape with unremarkable readings.

        Args:
            design: The whole design, which has what `design` declares.
            description: The cable.
            file: Name of the file that it will be written to.
        """

    @abstractmethod
    def file_rows(self, table: AnyTable, description: Description) -> FileRows:
        """Return the headings and rows of the file that is written."""

    def design_contradiction(self, design: Any, description: Description) -> str:
        """Return what of a design this cable cannot have, in a sentence; empty if it can have all."""
        return ""


class FrictionTableKind(FrictionKind[AnyRows]):
    """A kind of table that has `route`, `own` wrap angles and `origin` row by row."""

    @override
    def conditions(self, table: AnyRows) -> AnyRows:
        return table

    @override
    def check(self, table: AnyRows, description: Description, measurements: Measurements) -> None:
        """Refuse a row that cannot be given a wrap angle in every contact.

        Raises:
            DatasetError: Says which rows, and what to do.
        """
        faults, angles = Faults(), measurements.table(AngleTable)
        for contact in description.contact:
            with faults.collect():
                if contact.wrap_angle.constant is None:
                    _check_contact(description, angles, contact, table)
        faults.refuse()


def _check_contact(description: Description, angles: AngleTable | None, contact: ContactSettings, table: Rows) -> None:
    column = contact.wrap_angle.column or ""
    own_angles, _ = table.own.column(column)
    if not contact.wrap_angle.curve:
        missing = np.flatnonzero(np.isnan(own_angles))
        if len(missing) == len(own_angles):
            raise DatasetError(
                f"{table.origin.files[0]} has no column {column!r}, the wrap angle of the contact {contact.name!r}; "
                f"add it (as {column}_deg), or give the contact a constant angle or a curve in cable.toml.",
                key_path=description.angle_column_keys.get(column, ()),
            )
        reason = (
            f"the cell is blank, but the contact {contact.name!r} has no curve that could stand in for it; fill in the "
        )
        Faults([_in_row(table, i, column, reason + "measured angle.") for i in map(int, missing)]).refuse()
        return
    route = description.route
    assert route is not None and angles is not None  # the description guarantees both
    outside = np.isnan(own_angles) & ((table.route < route.range[0]) | (table.route > route.range[1]))
    reason = (
        f"lies outside the range {route.range[0]:g} to {route.range[1]:g} {route.unit} where the angle curves hold, and the "
        f"angle table has no row there; measure the wrap angles at that {route.variable.replace('_', ' ')}, or write them "
        "into this row."
    )
    rows = [int(i) for i in np.flatnonzero(outside) if not np.any(angles.route == table.route[i])]
    Faults([_in_row(table, i, route.variable, reason, f"{table.route[i]:g} {route.unit} ") for i in rows]).refuse()


def _in_row(table: Rows, i: int, column: str, what: str, value: str = "") -> DatasetError:
    """Return an error about a column in a row of a table, behind the value that stands there."""
    error = DatasetError(f"{table.origin.describe_row(i)}, column {column!r}: {value}{what}")
    error.fault_key, error.row = (table.origin.files[table.origin.file[i]], column, what), int(table.origin.row[i])
    return error
