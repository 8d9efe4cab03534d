"""Standard deviations that a table of forces states for each reading: they take the place of the noise that a fit estimates.

Stated noise is that of the reading alone; how mountings differ stays a parameter of the fit.
"""

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path

import numpy as np

from bowdenfit.description import Description
from bowdenfit.errors import DatasetError
from bowdenfit.files.cells import Cell
from bowdenfit.files.columns import Column, Quantity
from bowdenfit.files.tables import RawTable
from bowdenfit.kinds.rows import convert_to_forces
from bowdenfit.types import Labels, Matrix, Vector
from bowdenfit.words import counted, listed, shown, significant

STATED_NOISE = "sd_factor"
"""Factor on the stated standard deviations: 1, but where a description gives it a prior."""
_ENDS = ("input", "output")
FORCE_SDS = tuple(Quantity(f"{end}_{what}_sd", what, optional=True) for end in _ENDS for what in ("force", "torque"))
_LARGE = 0.3  # standard deviation over the force, from which its logarithm is skewed by more than a tenth of itself
# Healthy tables in which the scatter is said to differ from what is stated, and by which factor at least. Judgements.
_FALSE_ALARM, _FACTOR, _FEWEST = 1e-3, 1.3, 6
_FEWEST_FOR_LINE = 4  # readings of a group from which what hidden tension does at low loads is taken out


def read_force_sds(
    table: RawTable, columns: Mapping[str, Column], description: Description
) -> tuple[Matrix | None, list[str]]:
    """Return the stated standard deviations of the input and the output force of each row [N], and remarks.

    They are None where an end states none; a weight that hangs at the input needs none there. What is wrong is noted among the
    table's faults.

    Args:
        table: The file.
        columns: Its columns, by quantity.
        description: Radii, ratios of the load cells, and whether weights hang at the input.
    """
    stated = {end: name for end in _ENDS if (name := _find_sd_column(table, columns, end))}
    hung = description.sensors.noise_ratio == 0
    if not stated:
        return None, []
    heading = listed([shown(columns[name].heading) for name in stated.values()])
    with table.faults.collect():
        if hung and "input" in stated:
            raise DatasetError(
                f"{table.file}: the column {shown(columns[stated['input']].heading)} states errors of the input force, and "
                "[sensors] input_force_noise = 0 in cable.toml says that it has none; leave one of the two out."
            )
    if "output" not in stated or ("input" not in stated and not hung):
        other = next(end for end in _ENDS if end not in stated)
        return None, [
            f"{table.file}: the standard deviations in {heading} are not used, because none is stated for the {other} force, "
            f"and how well a loss is known rests on both; add a column {other}_force_sd"
            + (", or [sensors] input_force_noise = 0 where weights hang there." if other == "input" else ".")
        ]
    sd = np.zeros((len(table.rows), 2))
    for i, end in enumerate(_ENDS):
        if end in stated:
            column, of = columns[stated[end]], columns[stated[end].removesuffix("_sd")]
            cells_by_row = {cell.row: cell for cell in of.cells}
            read = np.array(column.read_cells(partial(_read_sd, column, of, cells_by_row), np.nan))
            with table.faults.collect():
                sd[:, i] = convert_to_forces(read, table, columns, end, description)
    remarks = [
        f"{table.file}: the standard deviations in {heading} are taken for the noise of these readings, in the place of an "
        "estimated one" + (", and of [sensors] force_noise." if description.sensors.force_noise is not None else ".")
    ]
    return sd, remarks


def remark_on_large_sds(file: str, sd: Matrix | None, forces: Matrix) -> list[str]:
    """Return a remark on readings whose standard deviation is a large part of the force.

    Args:
        file: Name of the file.
        sd, forces: Standard deviations and forces at input and output, row by row [N].
    """
    large = 0 if sd is None else int(np.sum(np.any(sd > _LARGE * forces, axis=1)))
    if not large:
        return []
    have = counted(large, "reading has a standard deviation", "readings have standard deviations")
    return [
        f"{file}: {have} above {_LARGE:.0%} of the force, of which the logarithm is no longer normal; their part in the "
        "intervals is approximate."
    ]


def _find_sd_column(table: RawTable, columns: Mapping[str, Column], end: str) -> str:
    """Return the name of the column with the standard deviations of one end; empty where there is none."""
    name, other = (f"{end}_{what}_sd" for what in (("torque", "force") if f"{end}_torque" in columns else ("force", "torque")))
    with table.faults.collect():
        if other in columns:
            raise DatasetError(
                f"{table.file}: the column {shown(columns[other].heading)} states errors of a {other.split('_')[1]}, and the "
                f"readings of the {end} are those of a {name.split('_')[1]}; state their own errors, or delete the column."
            )
    return name if name in columns and name.removesuffix("_sd") in columns else ""


def _read_sd(column: Column, of: Column, beside: Mapping[int, Cell], cell: Cell) -> float:
    """Return the standard deviation of a force or torque, in the internal unit."""
    if cell.blank:
        raise cell.refuse(
            "the cell is blank, and other rows state a standard deviation; a table states it in every row or in none: fill it "
            "in, or rename the column so that it is not read."
        )
    value = column.value(cell)
    if value <= 0:
        raise cell.refuse(
            f"a standard deviation of {cell.shown} is not possible; write how much the reading scatters. Weights that hang at "
            "the input have no noise: leave their column out, and state [sensors] input_force_noise = 0."
        )
    force = of.value(beside[cell.row])
    if value >= force:
        raise cell.refuse(
            f"a standard deviation of {cell.shown} is as large as the reading, {beside[cell.row].shown}; the usual cause is a "
            "column in percent, or of another unit. Correct it, or leave the row out: it says nothing."
        )
    return value


def concatenate_sds(sds: Sequence[Matrix | None], paths: Sequence[Path]) -> Matrix | None:
    """Return the standard deviations of all files of a table.

    Raises:
        DatasetError: Some state them and others do not.
    """
    known = [sd for sd in sds if sd is not None]
    if not known:
        return None
    if len(known) < len(sds):
        names = [[path.name for path, sd in zip(paths, sds, strict=True) if (sd is None) == lacks] for lacks in (False, True)]
        raise DatasetError(
            f"{listed(names[0])} states a standard deviation of each force, and {listed(names[1])} does not; a table states it "
            "in every row or in none."
        )
    return np.concatenate(known)


def log_ratio_variance(sd: Matrix, input_force: Vector, output_force: Vector) -> Vector:
    """Return the variance of log(F_in/F_out) of readings with stated standard deviations [1]."""
    return np.asarray((sd[:, 0] / input_force) ** 2 + (sd[:, 1] / output_force) ** 2)


def describe_scatter(file: str, log_ratio: Vector, variance: Vector, load: Vector, group: Labels) -> list[str]:
    """Return a sentence where readings of one run scatter otherwise than their stated standard deviations say.

    Args:
        file: Name of the file.
        log_ratio: s log(F_in/F_out) of each reading.
        variance: Its variance as stated.
        load: Sum of both forces [N]; a line in one over the load takes hidden tension out of the scatter.
        group: Run, stroke and bend of each, as one number.
    """
    from scipy.special import chdtr, chdtrc  # here, because reading a table must not wait for it

    squares, freedom = 0.0, 0
    for rows in np.split(np.argsort(group, kind="stable"), np.cumsum(np.bincount(group))[:-1]):
        columns = [np.ones(len(rows))]
        if len(rows) >= _FEWEST_FOR_LINE and np.ptp(load[rows]) > 1e-9 * np.max(load[rows]):
            columns.append(1 / load[rows] - np.mean(1 / load[rows]))
        root = np.sqrt(variance[rows])
        lines = np.column_stack(columns) / root[:, None]
        left = log_ratio[rows] / root
        left = left - lines @ np.linalg.lstsq(lines, left, rcond=None)[0]
        squares, freedom = squares + float(left @ left), freedom + len(rows) - len(columns)
    if freedom < _FEWEST:
        return []
    factor = float(np.sqrt(squares / freedom))
    if factor > _FACTOR and chdtrc(freedom, squares) < _FALSE_ALARM:
        how = f"{significant(factor)} times as much as"
        cause = "a standard deviation that is that of a mean, or of the display alone"
    elif factor < 1 / _FACTOR and chdtr(freedom, squares) < _FALSE_ALARM:
        how = f"only {significant(factor)} times as much as"
        cause = "an error that all readings share, which belongs under [sensors] or [errors]"
    else:
        return []
    return [
        f"{file}: readings of one run scatter {how} their stated standard deviations say; the usual cause is {cause}. Correct "
        "them, or take the columns out, and the scatter is estimated; or let the fit estimate a common factor, "
        f"[prior.{STATED_NOISE}] prior = {{ half_cauchy = {{ scale = 1 }} }}."
    ]
