r"""Read force against displacement: columns, runs and strokes; choose the rows that are used, and refuse impossible forces.

Rows that depend on how the rope lay before, and rows before a stop, are not used. Nobody knows how the rope lay before the
motor first moved. It may have been pulled or let out; from its let-out state, where the force is F_t, all of it slides once the
force is :math:`F_t e^{2\Lambda}`, whatever the spring and the rope. At one displacement the pull is over the return by at
least :math:`e^\Lambda` (`bowdenfit.physics.tendon`), whose square is enough; the last quarter of the stroke is used all the
same, lest a loop have no pull.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from bowdenfit.errors import DatasetError, combine_errors
from bowdenfit.files.columns import Column, Quantity, require_column
from bowdenfit.files.tables import RawTable
from bowdenfit.kinds.displacement.table import ZERO, DisplacementTable, follow_motor, history_of_sliding_rope
from bowdenfit.kinds.rows import (
    OwnAngles,
    check_spelling,
    number_names,
    origin_of_rows,
    read_labels,
    read_own_angles,
    read_route,
    shared_columns,
)
from bowdenfit.kinds.strokes import read_strokes
from bowdenfit.kinds.table_files import Source, TableFromFiles
from bowdenfit.types import Flags, Labels, Vector
from bowdenfit.words import few, listed

_LEAST_SHARE = 0.01  # least force at a turn over the largest, to keep ratios finite; a judgement
_MOST_ROWS = 600  # rows that are used of longer tables: time grows with rows, information hardly. A judgement
_N_COMPARED = 9  # displacements at which pull and return are compared; a judgement
_UNUSED = ("time", "velocity")  # columns that such a table may have and that nothing reads
_NAMES = {"force": ("force", "input_force"), "displacement": ("displacement", "position")}
# Limits of what a rope with a spring shows: judgements, far beyond noise of a percent.
_NEGATIVE = 0.05  # depth of a force below 0 over the largest force, as noise about 0
_FOLLOWS = 0.5  # least correlation of the force with the displacement while the motor pulls
_GAINS = 1.1  # mean force of the return over that of the pull
_FEWEST = 4  # readings from which a correlation is looked at


def read_displacement(source: Source) -> TableFromFiles[DisplacementTable]:
    """Read a table of the force at the motor against its displacement.

    Args:
        source: Where it is.

    Raises:
        DatasetError: See `read_csv` and `find_columns`; or a force is negative, there is a second force, the force does not
            follow the displacement, the return takes more force than the pull, a stop is never reached, or a run has one
            reading and nobody stated where its displacement begins.
    """
    path, route, contacts = source.file, source.description.route, source.description.angle_columns
    settings = source.settings
    ends = [
        Quantity(name, what) for names, what in zip(_NAMES.values(), ("force", "length"), strict=True) for name in names
    ]
    optional_columns = (Quantity("run", "text"), Quantity("stroke", "text"))
    wanted = (*ends, Quantity("output_force", "force"), *optional_columns, *shared_columns(source.description))
    table, columns = source.read_table(path, wanted, _UNUSED)
    check_spelling(table, columns, optional_columns)
    force_column, x_column = (
        _require_either_name(table, columns, name, unit) for name, unit in (("force", "N"), ("displacement", "mm"))
    )
    if "output_force" in columns:
        raise DatasetError(
            f"{table.file} has forces at both ends; name it under tables.forces, which determines friction without any spring, "
            "or leave one of the two columns out."
        )
    force, displacement = np.array(force_column.numbers()), np.array(x_column.numbers())
    own_angles, at = read_own_angles(table, columns, contacts), read_route(table, columns, route)
    strokes = read_strokes(columns, len(force), held="")
    table.faults.refuse()
    _check_tensions(force, force_column)
    stroke = _check_strokes(strokes, columns)
    how = settings.rows or ("sliding" if stroke is not None else "in order")
    if how == "sliding" and stroke is None:
        raise DatasetError(
            f"{table.file} has no stroke column, so it is not known which way the rope slides in a row; add one (pull or "
            "return), "
            'or write rows = "in order" for readings in the order in which they were taken.'
        )
    run, names = _assign_runs(columns.get("run"), at, own_angles)
    motion = (
        history_of_sliding_rope(stroke, displacement, run)
        if how == "sliding" and stroke is not None
        else follow_motor(displacement, run)
    )
    every, origin = np.ones(len(force), dtype=bool), origin_of_rows(table)
    rows = DisplacementTable(at, force, displacement, motion, run, names, every, own_angles, origin, how == "sliding")
    if not any(name.startswith(ZERO) for name in source.description.prior):
        _check_runs(rows)
    rows, remarks = _choose_rows(rows, settings, "stroke" in columns)
    _check_force(rows)
    return TableFromFiles(rows, {path.name: path}, tuple(remarks), (table.account,))


def _require_either_name(table: RawTable, columns: Mapping[str, Column], name: str, unit: str) -> Column:
    """Return a column by either of its names."""
    present = [spelling for spelling in _NAMES[name] if spelling in columns]
    if len(present) > 1:
        raise DatasetError(
            f"{table.file} has the columns {listed(present)}, which are both read as {name}; leave one out."
        )
    return require_column(table, columns, present[0] if present else name, f"{name}_{unit}")


def _check_tensions(values: Vector, column: Column) -> None:
    """Refuse forces that are clearly negative; noise about no force may be a little below 0."""
    low = int(np.argmin(values))
    if values[low] < -_NEGATIVE * max(values.max(), 0.0):
        raise column.cells[low].refuse(
            f"{column.cells[low].shown} is negative, and a rope cannot be pushed; the usual causes are the sign convention of "
            "the load cell and its zero: write tension as positive, and take off what the cell shows of a slack rope."
        )


def _check_strokes(strokes: Labels, columns: Mapping[str, Column]) -> Labels | None:
    """Return the strokes, None without such a column; refuse held ones."""
    if "stroke" not in columns:
        return None
    if not strokes.all():
        reason = "a held reading lies anywhere between pull and return; write pull or return, or leave the row out."
        raise combine_errors([columns["stroke"].cells[i].refuse(reason) for i in np.flatnonzero(strokes == 0)])
    return strokes


def _assign_runs(column: Column | None, route: Vector, own: OwnAngles) -> tuple[Labels, tuple[str, ...]]:
    """Return the run of each row and the names of runs: one label at one route value and one set of wrap angles."""
    labels = read_labels(column.cells, "(no run)") if column is not None else [""] * len(route)
    conditions = [
        ", ".join(
            [f"{at:.5g}"] * bool(np.isfinite(at)) + [f"{angle:.5g} deg" for angle in angles if np.isfinite(angle)]
        )
        for at, angles in zip(route, np.rad2deg(own.angle), strict=True)
    ]
    conditions_of_label: dict[str, set[str]] = {}
    for label, condition in zip(labels, conditions, strict=True):
        conditions_of_label.setdefault(label, set()).add(condition)
    keys = [
        f"{label} ({condition})" if label and len(conditions_of_label[label]) > 1 else label or condition or "all"
        for label, condition in zip(labels, conditions, strict=True)
    ]
    return number_names(keys)


def _check_runs(table: DisplacementTable) -> None:
    """Refuse a run of one reading, which says nothing because where its displacement begins is fitted."""
    n = np.bincount(table.run)
    single_rows = np.flatnonzero(n[table.run] == 1).tolist()
    if single_rows:
        which = few([f"{table.origin.describe_row(i)} ({table.run_names[table.run[i]]})" for i in single_rows])
        raise DatasetError(
            f"{which}: a run of one reading, which determines nothing, since where its displacement begins is fitted; the "
            "usual causes are a slipped digit in its wrap angle, another label than the rows next to it, and angles that "
            "differ from row to row: write one angle and one label for all rows of a mounting, or leave the row out."
        )


def _check_force(table: DisplacementTable) -> None:
    """Refuse a force that does not follow the displacement, or a return that takes more force than the pull."""
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
    """Return the mean force between two displacements [N]."""
    order = np.argsort(x, kind="stable")
    return float(np.mean(np.interp(np.linspace(low, high, 9), x[order], force[order])))


def _choose_rows(table: DisplacementTable, settings: Any, has_strokes: bool) -> tuple[DisplacementTable, list[str]]:
    """Return the table with the rows that are used, and remarks on the others.

    Args:
        table: All rows.
        settings: Settings of the table in cable.toml.
        has_strokes: Whether it has a column stroke.

    Raises:
        DatasetError: A stop is never reached.
    """
    file, x, used, remarks = table.origin.files[0], table.displacement, table.used.copy(), []
    if table.sliding:
        remarks.append(
            f"{file} has a stroke column: every row is taken as read while all of the rope slides. If rows were taken in order "
            'through the turns of the motor, write rows = "in order" next to the file in cable.toml.'
        )
    else:
        ignored = " Its stroke column is not needed." if has_strokes else ""
        unknown = find_early_rows(table)
        used &= ~unknown
        remarks.append(
            f"{file}: rows are taken in the order of the file, and turns of the motor as the displacement shows them."
            f"{ignored} {int(unknown.sum())} of {len(x)} rows, at the start of each run, are not used, because there the force "
            "depends on how the rope lay before, which is not known."
        )
    if "end" not in settings.model_fields_set:
        remarks.append(
            f"{file}: the far end is taken for a spring whose stiffness is fitted; if the rope pulls against a stop, write "
            'end = "stop" next to the file in cable.toml, or --set tables.displacement.end=stop.'
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
    n = int(used.sum())
    if n > _MOST_ROWS:
        step = -(-n // _MOST_ROWS)
        used[np.flatnonzero(used)[np.arange(n) % step != 0]] = False
        remarks.append(
            f"{file}: of the {n} rows that are left one in {step} is used, {int(used.sum())} in all; those between them say "
            "hardly more, and the turns of the motor are those of all rows."
        )
    return replace(table, used=used), remarks


def find_early_rows(table: DisplacementTable) -> Flags:
    """Flag rows of the first stroke of each run in which the force may depend on what was before it."""
    unknown = np.zeros(len(table.run), dtype=bool)
    for run in range(len(table.run_names)):
        rows = np.flatnonzero((table.run == run) & table.motion.first)
        back = np.flatnonzero((table.run == run) & (table.motion.stroke == -table.motion.stroke[rows[0]]))
        may = _is_before_middle(table, rows) if len(back) < 2 else _is_before_full_slip(table, rows, back)
        last = np.flatnonzero(may)
        unknown[rows[: last[-1] + 1 if len(last) else 0]] = True
    return unknown


def _is_before_middle(table: DisplacementTable, rows: np.ndarray) -> Flags:
    """Flag rows before the middle of a stroke, where no other stroke gives more information."""
    x = table.displacement[rows]
    return np.asarray(table.motion.stroke[rows[0]] * (x - (x[0] + x[-1]) / 2) < 0)


def _is_before_full_slip(table: DisplacementTable, rows: np.ndarray, back: np.ndarray) -> Flags:
    """Flag rows of a stroke before all of the rope is known to slide, judged by the way back."""
    way, x, force = int(table.motion.stroke[rows[0]]), table.displacement, table.force
    order = back[np.argsort(x[back], kind="stable")]
    first, low, high = x[rows[0]], x[order[0]], x[order[-1]]
    beyond = first < low - 0.05 * (high - low) if way > 0 else first > high + 0.05 * (high - low)
    turned = np.sort(x[rows])
    shared = np.linspace(max(low, turned[0]), min(high, turned[-1]), _N_COMPARED)[_N_COMPARED // 2 : -1]
    there, here = (
        np.interp(shared, x[these], force[these]) for these in (rows[np.argsort(x[rows], kind="stable")], order)
    )
    ratios = (there / np.maximum(here, 1e-12 * force.max())) ** way
    if beyond or shared[0] >= shared[-1] or not np.median(ratios) > 1:
        return _is_before_middle(table, rows)
    most, turned_at = np.median(ratios) ** 2, float(np.interp(first, x[order], force[order]))
    turned_at = max(turned_at, _LEAST_SHARE * force.max())
    depends = force[rows] < turned_at * most if way > 0 else force[rows] > turned_at / most
    return np.asarray(depends & (way * (x[rows] - (x[rows[0]] + 3 * x[rows[-1]]) / 4) < 0))
