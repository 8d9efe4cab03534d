"""Force at the motor against the displacement of the motor: one load cell and one position, as at catheters and endoscopes."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from bowdenfit.description import Description, QuantityValue, Table
from bowdenfit.errors import DatasetError
from bowdenfit.files.columns import Column, Quantity, find_columns, require
from bowdenfit.files.csv_table import RawTable, read_csv
from bowdenfit.kinds.displacement.turns import Motion, in_order, sliding
from bowdenfit.kinds.kind import Found, Source
from bowdenfit.kinds.rows import (
    OwnAngles,
    RowOrigin,
    check_spelling,
    provenance_of,
    read_own_angles,
    read_route,
    read_strokes,
    shared_columns,
)
from bowdenfit.types import Flags, Labels, Vector
from bowdenfit.words import listed

_UNUSED = ("time", "velocity")  # columns that such a table may have and that nothing reads
_NAMES = {"force": ("force", "input_force"), "displacement": ("displacement", "position")}
_NEGATIVE = 0.05  # of the largest force, that noise about 0 may be below it
_FOLLOWS = 0.5  # correlation of the force with the displacement while the motor pulls, below which it does not follow
_GAINS = 1.1  # return over pull, that noise does not make of a cable without friction
_FEWEST = 4  # readings from which that can be said


class DisplacementSettings(Table):
    """The table of force against displacement; what is at the far end, and how the rows were taken.

    Rows are readings in the order in which they were taken, or, with a column stroke, readings of a rope that slides.
    """

    end: Literal["spring", "stop"] = "spring"
    stop: QuantityValue | None = None
    rows: Literal["in order", "sliding"] | None = None


@dataclass(frozen=True)
class DisplacementTable:
    """Force at the motor against displacement.

    Args:
        route: Route variable; NaN where the cable has no route.
        force: Force at the motor [N].
        displacement: Displacement of the rope at the motor, growing as it pulls [mm].
        motion: How the motor moved.
        run: Number of the run (one mounting at one bend) of each row.
        run_names: Name of each run.
        used: Which rows are readings of what lies at the far end.
        own: Wrap angles measured with the row.
        origin: Where each row was read.
        sliding: Whether rows are known to be taken while all of the rope slides.
    """

    route: Vector
    force: Vector
    displacement: Vector
    motion: Motion
    run: Labels
    run_names: tuple[str, ...]
    used: Flags
    own: OwnAngles
    origin: RowOrigin
    sliding: bool

    @property
    def pulls(self) -> Flags:
        """Which of the readings were taken while the motor pulled."""
        return self.used & (self.motion.stroke > 0)

    @property
    def shared(self) -> tuple[float, float]:
        """The displacements that pulling and returning readings have in common [mm]; the second is smaller without any."""
        x, back = self.displacement, self.used & (self.motion.stroke < 0)
        if not (self.pulls.any() and back.any()):
            return 0.0, -1.0
        return max(x[self.pulls].min(), x[back].min()), min(x[self.pulls].max(), x[back].max())


def contradiction(settings: DisplacementSettings | None, description: Description) -> str:
    """A loop, a friction model whose equations these are not, or a stop that is a spring."""
    if settings is None:
        return ""
    if description.cable.kind == "loop":
        return "the table displacement is of a single rope, and a loop has two; leave it out, or describe one rope alone"
    if description.friction_model != "capstan":
        return 'the equations of the table displacement hold for friction_model = "capstan" only; leave it out'
    if settings.stop is not None and settings.end != "stop":
        return 'tables.displacement says where a stop is, but not end = "stop"; write that beside it, or leave the stop out'
    return ""


def read_displacement(source: Source) -> Found[DisplacementTable]:
    """Read a table of the force at the motor against its displacement.

    Args:
        source: Where it is.

    Raises:
        DatasetError: See `read_csv` and `find_columns`; or a force is negative, there is a second force, the force does not
            follow the displacement, the return takes more force than the pull, or a stop is never reached.
    """
    path, route, contacts = source.file, source.description.route, source.description.angle_columns
    settings, table = source.settings, read_csv(path)
    ends = [Quantity(name, what) for names, what in zip(_NAMES.values(), ("force", "length"), strict=True) for name in names]
    others = (Quantity("run", "text"), Quantity("stroke", "text"))
    wanted = (*ends, Quantity("output_force", "force"), *others, *shared_columns(route, contacts))
    found = find_columns(table, wanted, source.columns, _UNUSED)
    check_spelling(table, found, others)
    force_column, x_column = (_one_of(table, found, name, unit) for name, unit in (("force", "N"), ("displacement", "mm")))
    if "output_force" in found:
        raise DatasetError(
            f"{table.file} has forces at both ends; name it under tables.forces, which tells friction without any spring, or "
            "leave one of the two columns out."
        )
    force, displacement = _forces(force_column), np.array(x_column.numbers())
    stroke = _strokes(found, len(force))
    how = settings.rows or ("sliding" if stroke is not None else "in order")
    if how == "sliding" and stroke is None:
        raise DatasetError(
            f"{table.file} has no stroke column, so nobody knows which way the rope slides in a row; add one (pull or return), "
            'or write rows = "in order" for readings in the order in which they were taken.'
        )
    own, at = read_own_angles(table, found, contacts), read_route(table, found, route)
    run, names = _runs(found.get("run"), at, own)
    motion = sliding(stroke, displacement, run) if how == "sliding" and stroke is not None else in_order(displacement, run)
    every, origin = np.ones(len(force), dtype=bool), provenance_of(table)
    rows = DisplacementTable(at, force, displacement, motion, run, names, every, own, origin, how == "sliding")
    rows, remarks = _chosen(rows, settings, "stroke" in found)
    _check_force(rows)
    return Found(rows, {path.name: path}, tuple(remarks), (table.account,))


def _one_of(table: RawTable, found: Mapping[str, Column], name: str, unit: str) -> Column:
    """A column by either of its names."""
    named = [each for each in _NAMES[name] if each in found]
    if len(named) > 1:
        raise DatasetError(f"{table.file} has the columns {listed(named)}, which are both read as {name}; leave one out.")
    return require(table, found, named[0] if named else name, f"{name}_{unit}")


def _forces(column: Column) -> Vector:
    """Forces, which are tensions; noise about no force may be a little below 0."""
    values = np.array(column.numbers())
    low = int(np.argmin(values))
    if values[low] < -_NEGATIVE * max(values.max(), 0.0):
        raise column.cells[low].refuse(
            f"{column.cells[low].shown} is negative, and a rope cannot be pushed; the usual causes are the sign convention of "
            "the load cell and its zero: write tension as positive, and take off what the cell shows of a slack rope."
        )
    return values


def _strokes(found: Mapping[str, Column], n: int) -> Labels | None:
    if "stroke" not in found:
        return None
    strokes = read_strokes(found, n, held="")
    if not strokes.all():
        raise found["stroke"].cells[int(np.flatnonzero(strokes == 0)[0])].refuse(
            "a held reading lies anywhere between pull and return; write pull or return, or leave the row out."
        )
    return strokes


def _runs(column: Column | None, route: Vector, own: OwnAngles) -> tuple[Labels, tuple[str, ...]]:
    """One run is what the column calls so, at one route value and one set of wrap angles."""
    said = [cell.text.strip() or "(no run)" for cell in column.cells] if column is not None else [""] * len(route)
    where = [
        ", ".join([f"{at:.5g}"] * bool(np.isfinite(at)) + [f"{angle:.5g} deg" for angle in angles if np.isfinite(angle)])
        for at, angles in zip(route, np.rad2deg(own.angle), strict=True)
    ]
    places: dict[str, set[str]] = {}
    for label, place in zip(said, where, strict=True):
        places.setdefault(label, set()).add(place)
    keys = [
        f"{label} ({place})" if label and len(places[label]) > 1 else label or place or "all"
        for label, place in zip(said, where, strict=True)
    ]
    names = tuple(dict.fromkeys(keys))
    return np.array([names.index(key) for key in keys]), names


def _chosen(table: DisplacementTable, settings: Any, has_strokes: bool) -> tuple[DisplacementTable, list[str]]:
    """Without readings of which nobody knows how the rope lay, or that lie before the stop; and what is said of that."""
    file, x, used, remarks = table.origin.files[0], table.displacement, table.used.copy(), []
    if table.sliding:
        remarks.append(
            f"{file} has a stroke column: every row is taken as read while all of the rope slides. If rows were taken in order "
            'through the turns of the motor, write rows = "in order" beside the file in cable.toml.'
        )
    else:
        ignored = " Its stroke column is not needed." if has_strokes else ""
        unknown = early(table)
        used &= ~unknown
        remarks.append(
            f"{file}: rows are taken in the order in which they stand, and turns of the motor as the displacement shows them."
            f"{ignored} {int(unknown.sum())} of {len(x)} rows are not used, the first half of the first stroke of each run, "
            "because nobody knows how the rope lay before."
        )
    if settings.stop is not None:
        at = settings.stop.to("length")
        if not np.any(x > at):
            raise DatasetError(
                f"{file}: the stop at {settings.stop.value:g} {settings.stop.unit} is never reached, the displacements end at "
                f"{x.max():.4g} mm; pull on to the stop, correct where it is, or leave it out if a spring is at the far end."
            )
        before = used & (x <= at)
        used &= ~before
        remarks.append(f"{file}: {int(before.sum())} rows lie before the stop, and are not used.")
    return replace(table, used=used), remarks


def early(table: DisplacementTable) -> Flags:
    """Rows of the first half of the first stroke of each run."""
    early, x = np.zeros(len(table.run), dtype=bool), table.displacement
    for run in range(len(table.run_names)):
        rows = np.flatnonzero((table.run == run) & table.motion.first)
        way = table.motion.stroke[rows[0]]
        early[rows] = way * (x[rows] - (x[rows[0]] + x[rows[-1]]) / 2) < 0
    return early


def _check_force(table: DisplacementTable) -> None:
    """The force follows the displacement, and the pull takes more of it than the return."""
    file, x, force, pulls = table.origin.files[0], table.displacement, table.force, table.pulls
    these = pulls if pulls.sum() >= _FEWEST else table.used
    if these.sum() >= _FEWEST and np.ptp(x[these]) > 0:
        alike = float(np.corrcoef(x[these], force[these])[0, 1]) if np.ptp(force[these]) > 0 else 0.0
        if alike < -_FOLLOWS:
            raise DatasetError(
                f"{file}: the force falls while the displacement grows (correlation {alike:.2f}); the usual cause is a "
                "displacement counted the other way: write it as growing while the motor pulls."
            )
        if alike < _FOLLOWS:
            raise DatasetError(
                f"{file}: the force does not follow the displacement (correlation {alike:.2f}); the usual causes are a dead "
                "load cell, a wrong column, and a stop or spring that is never reached: plot force against displacement."
            )
    low, high = table.shared
    if high > low:
        pull, back = (_mean_between(low, high, x[rows], force[rows]) for rows in (pulls, table.used & ~pulls))
        if back > _GAINS * pull:
            raise DatasetError(
                f"{file}: at the same displacement the return takes more force ({back:.4g} N) than the pull ({pull:.4g} N); "
                "the usual causes are strokes, or the rows of the table, the wrong way round."
            )


def _mean_between(low: float, high: float, x: Vector, force: Vector) -> float:
    """Mean force between two displacements [N]."""
    order = np.argsort(x, kind="stable")
    return float(np.mean(np.interp(np.linspace(low, high, 9), x[order], force[order])))
