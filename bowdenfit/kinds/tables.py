"""Tables that several kinds of measurement use, and everything that was measured on one cable.

The table of a kind that nobody else looks at stands with its kind; recordings are `bowdenfit.recordings.recording.Recordings`.
"""

from dataclasses import dataclass, field, replace
from typing import Any, Literal, TypeVar

import numpy as np

from bowdenfit.description import QuantityValue, Table
from bowdenfit.display import Display
from bowdenfit.files.row_account import ExcludedReading
from bowdenfit.kinds.rows import OwnAngles, RowOrigin
from bowdenfit.types import Flags, Labels, Matrix, Vector

AnyTable = TypeVar("AnyTable")


@dataclass(frozen=True, repr=False)
class Measurements(Display):
    """Tables of one cable, looked up by class, and remarks on how they were read.

    Args:
        tables: At most one of a class.
        remarks: Assumptions that were made, in sentences.
        excluded: Readings that the user leaves out, by the name of their kind.
    """

    tables: tuple[Any, ...] = ()
    remarks: tuple[str, ...] = ()
    excluded: dict[str, tuple[ExcludedReading, ...]] = field(default_factory=dict)

    def sentences(self) -> list[str]:
        """Return which tables there are."""
        return [f"{', '.join(type(table).__name__ for table in self.tables) or 'No table'}.", *self.remarks]

    def table(self, of: type[AnyTable]) -> AnyTable | None:
        """Return the table of a class; None if nothing of that kind was measured."""
        return next((table for table in self.tables if type(table) is of), None)

    def excluded_points(self, kind: str, x: str, y: str, run: int | None = None) -> np.ndarray:
        """Return two quantities of the readings that the user leaves out, of those that have both; one row each.

        Args:
            kind: Name of their kind.
            x, y: Names of the quantities.
            run: Number of the run that they are of, where their kind tells; of any run if omitted.
        """
        of_all = (reading.values for reading in self.excluded.get(kind, ()))
        readings = [values for values in of_all if run is None or values.get("run") == run]
        return np.array([(values[x], values[y]) for values in readings if x in values and y in values]).reshape(-1, 2).T

    def with_tables(self, *tables: Any) -> "Measurements":
        """Return the measurements with other tables in place of those of their classes; None changes nothing."""
        new = {type(table): table for table in tables if table is not None}
        kept = {type(table): table for table in self.tables}
        return replace(self, tables=tuple((kept | new).values()))


class AngleSettings(Table):
    """The table of wrap angles; how angles too small to detect enter the fit."""

    detection_limit: QuantityValue | None = None
    undetected: Literal["censored", "zero", "dropped"] = "censored"


@dataclass(frozen=True)
class AngleTable:
    """Wrap angle of each curved contact against the route variable.

    Args:
        route: Route variable, in the unit of the description.
        names: Column of each contact.
        angle: Measured wrap angle [rad]; NaN where it was not detected.
        limit: Detection limit where it was not detected [rad]; NaN elsewhere.
        origin: Where each row was read.
    """

    route: Vector
    names: tuple[str, ...]
    angle: Matrix
    limit: Matrix
    origin: RowOrigin

    def column(self, name: str) -> tuple[Vector, Vector]:
        """Return angles and detection limits of one contact [rad]."""
        k = self.names.index(name)
        return self.angle[:, k], self.limit[:, k]


@dataclass(frozen=True)
class StretchTable:
    """Stretch of the rope, seen at its loaded end while the far end is held, under loads and at wrap angles.

    Args:
        load: Tension at the loaded end [N].
        wrap_angle: Total wrap angle of the cable [rad].
        stretch: Reading [mm]; what counts as zero is unknown.
        unloading: Whether the load was larger before, in the same cycle.
        peak: Largest load of the row's cycle [N].
        cycle: Number of the cycle of each row.
        cycle_names: Name of each cycle.
        origin: Where each row was read.
    """

    load: Vector
    wrap_angle: Vector
    stretch: Vector
    unloading: Flags
    peak: Vector
    cycle: Labels
    cycle_names: tuple[str, ...]
    origin: RowOrigin


class PreloadTableSettings(Table):
    """The table of preload, by which it follows the stretch of the rope unless the description says otherwise."""

    @property
    def measures_preload(self) -> bool:
        """Whether the table measures the preload, which it does."""
        return True


@dataclass(frozen=True)
class PreloadTable:
    """Preload between fixed ends at wrap angles.

    Args:
        wrap_angle: Total wrap angle of the cable [rad].
        preload: Tension at rest [N]; 0 where the rope is slack.
        origin: Where each row was read.
    """

    wrap_angle: Vector
    preload: Vector
    origin: RowOrigin


@dataclass(frozen=True)
class LoopTable:
    """Forces at both ends of a pull-pull loop while it moves.

    Args:
        route: Route variable; NaN where the cable has no route.
        input_force: Difference of the tensions at the motor side [N].
        output_force: Difference of the tensions at the load side [N].
        stroke: +1 moving forward, -1 moving back.
        preload: Preload measured with the row [N]; NaN where the cable's own counts.
        own: Wrap angles measured with the row.
        origin: Where each row was read.
    """

    route: Vector
    input_force: Vector
    output_force: Vector
    stroke: Labels
    preload: Vector
    own: OwnAngles
    origin: RowOrigin


def warn_of_single_angle(measurements: Measurements) -> list[str]:
    """Warn where stretch and preload are all read at one wrap angle, which leaves the lengthening unidentified."""
    tables = measurements.table(StretchTable), measurements.table(PreloadTable)
    different = np.unique(np.concatenate([table.wrap_angle for table in tables if table is not None]))
    if len(different) != 1:
        return []
    return [
        f"every row of stretch and preload is at one wrap angle, {np.rad2deg(different[0]):g} deg, so how far bending "
        "lengthens the sheath (lengthening) is not identifiable; read at several."
    ]
