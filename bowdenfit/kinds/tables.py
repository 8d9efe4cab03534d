"""The tables as validated arrays: one frozen class a kind of table, in N and rad."""

from dataclasses import dataclass

import numpy as np

from bowdenfit.types import Flags, Labels, Matrix, Vector


@dataclass(frozen=True)
class Provenance:
    """Where each row of a table was read, so that any row can be named.

    Args:
        files: File names.
        file: Number of the file of each row.
        row: Line of the file.
    """

    files: tuple[str, ...]
    file: Labels
    row: Labels

    def place(self, i: int) -> str:
        """Row i in words."""
        return f"{self.files[self.file[i]]}, row {self.row[i]}"


@dataclass(frozen=True)
class OwnAngles:
    """Wrap angles measured row by row: NaN where a row has none and the curve must serve.

    Args:
        names: Column of each contact.
        angle: Wrap angle [rad].
        sd: Its standard deviation where the table gives one [rad], else NaN.
    """

    names: tuple[str, ...]
    angle: Matrix
    sd: Matrix

    def column(self, name: str) -> tuple[Vector, Vector]:
        """Angles and standard deviations of one contact; all NaN if the table has no such column."""
        if name not in self.names:
            return np.full(len(self.angle), np.nan), np.full(len(self.angle), np.nan)
        k = self.names.index(name)
        return self.angle[:, k], self.sd[:, k]


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
    origin: Provenance

    def column(self, name: str) -> tuple[Vector, Vector]:
        """Angles and detection limits of one contact."""
        k = self.names.index(name)
        return self.angle[:, k], self.limit[:, k]


@dataclass(frozen=True)
class EfficiencyTable:
    """Measured transmission efficiencies.

    Args:
        route: Route variable; NaN where the cable has no route.
        efficiency: Output force over input force while pulling [1].
        sd: Standard deviation where given [1], else 0.
        own: Wrap angles measured with the row.
        origin: Where each row was read.
    """

    route: Vector
    efficiency: Vector
    sd: Vector
    own: OwnAngles
    origin: Provenance


@dataclass(frozen=True)
class ForceTable:
    """Pairs of forces read at both ends.

    Args:
        route: Route variable; NaN where the cable has no route.
        input_force: Force at the motor side [N].
        output_force: Force at the load side [N].
        run: Number of the run (one mounting of the cable) of each row.
        run_names: Name of each run.
        stroke: +1 pulling, -1 return, 0 held.
        own: Wrap angles measured with the row.
        origin: Where each row was read.
        velocity: Velocity of the rope [mm/s] or of the motor [rad/s]; NaN where it is not known.
        velocity_unit: Which of the two; empty without velocities.
    """

    route: Vector
    input_force: Vector
    output_force: Vector
    run: Labels
    run_names: tuple[str, ...]
    stroke: Labels
    own: OwnAngles
    origin: Provenance
    velocity: Vector
    velocity_unit: str = ""


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
    origin: Provenance


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
    origin: Provenance


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
    origin: Provenance
