"""Tables of stretch in words and in rows: what was read, what it cannot tell, what is plausible, how a file says it."""

from itertools import product

import numpy as np

from bowdenfit.description import Description, Finite
from bowdenfit.description.values import Frozen
from bowdenfit.kinds.design import Design, radians
from bowdenfit.kinds.measurements import Measurements
from bowdenfit.kinds.pages import Page, fixed, in_words
from bowdenfit.kinds.plausibility import parts, within_factor
from bowdenfit.kinds.preload.table import PreloadTable
from bowdenfit.kinds.rows import RowOrigin
from bowdenfit.kinds.stretch.table import StretchTable
from bowdenfit.words import counted, significant

_LOW = 1 / 3  # share of the highest load above which a lowest load is not low
_STIFFNESSES = (0.1, 1e5)  # N/mm; a meter of thin cord and of crane rope
_FEWEST_LOADS = 4  # different loads from which stiffness and bedding-in can be told apart


def describe(rows: StretchTable, description: Description) -> list[str]:
    """Readings, loads, wrap angles, and the friction that acts."""
    down = f", {int(rows.unloading.sum())} of them while the load came down" if rows.unloading.any() else ""
    angles = np.rad2deg(np.unique(rows.wrap_angle))
    own = description.stretch.friction or "a friction coefficient of its own, mu_stretch"
    return [
        f"{rows.origin.files[0]}: {counted(len(rows.load), 'reading')} of stretch{down}, loads {in_words(rows.load, 'N')}, at "
        f"{len(angles)} wrap angle{'s' if len(angles) > 1 else ''}, {in_words(angles, 'deg')}; friction: {own}"
    ]


def warnings_of(rows: StretchTable, description: Description, measurements: Measurements) -> list[str]:
    """What the table will not be able to tell, as far as counting shows."""
    del description
    file, loads, warnings = rows.origin.files[0], np.unique(rows.load), []
    if len(loads) == 1:
        warnings.append(
            f"{file} has a single load, {loads[0]:g} N, so the stiffness of the rope is not identifiable; read the stretch at "
            "several loads."
        )
    elif len(loads) < _FEWEST_LOADS:
        warnings.append(
            f"{file} has {len(loads)} different loads, too few to tell stiffness from bedding-in; read the stretch at "
            f"{_FEWEST_LOADS} or more, some of them low."
        )
    elif loads[0] > _LOW * loads[-1]:
        warnings.append(
            f"{file} has no low loads, only {loads[0]:g} to {loads[-1]:g} N, so how the rope beds in may not be identifiable; "
            "read the stretch at some low loads too."
        )
    more, given = float(np.ptp(loads)), float(np.ptp(rows.stretch))
    if more > 0 and not _STIFFNESSES[0] * given < more < _STIFFNESSES[1] * given:
        warnings.append(
            f"the rope of {file} gives {significant(given)} mm under {significant(more)} N more, as hardly any rope does; the "
            "usual cause is a unit: check those of stretch and load."
        )
    falling = _falling(rows)
    if falling:
        warnings.append(
            f"in {file} the stretch falls while the load grows, {falling}; check its sign, and whether the readings differ by "
            "more than their noise."
        )
    if not rows.wrap_angle.any():
        warnings.append(
            f"every row of {file} is at a wrap angle of 0, so it says nothing of friction; read at larger ones too."
        )
    return warnings + one_angle_warning(measurements)


def _falling(rows: StretchTable) -> str:
    """Where the stretch under the largest load is less than under the smallest, in words; empty where it is not."""
    for cycle, unloading in product(range(len(rows.cycle_names)), (False, True)):
        these = np.flatnonzero((rows.cycle == cycle) & (rows.unloading == unloading))
        if len(np.unique(rows.load[these])) < 2:
            continue
        low, high = these[np.argmin(rows.load[these])], these[np.argmax(rows.load[these])]
        if rows.stretch[high] < rows.stretch[low]:
            return f"from row {rows.origin.row[low]} to row {rows.origin.row[high]}"
    return ""


def one_angle_warning(measurements: Measurements) -> list[str]:
    """Of stretch and preload that are all read at a single wrap angle no lengthening can be told."""
    tables = measurements.table(StretchTable), measurements.table(PreloadTable)
    different = np.unique(np.concatenate([table.wrap_angle for table in tables if table is not None]))
    if len(different) != 1:
        return []
    return [
        f"every row of stretch and preload is at one wrap angle, {np.rad2deg(different[0]):g} deg, so how far bending "
        "lengthens the sheath (lengthening) is not identifiable; read at several."
    ]


def implausible(real: StretchTable, made: StretchTable) -> str:
    """Stretch of another size than the measured, or that falls with the load."""
    if not within_factor(np.ptp(real.stretch), np.ptp(made.stretch)):
        return "the stretch is far from the measured one"
    of_cycle = 2 * made.cycle + made.unloading
    load, stretch = (
        np.concatenate([part - part.mean() for part in parts(of_cycle, values)]) for values in (made.load, made.stretch)
    )
    return "the stretch falls with the load" if load @ stretch <= 0 else ""


def page(table: StretchTable, description: Description) -> Page:
    """Headings and rows of its file."""
    del description
    branch = np.where(table.unloading, "unload", "load")
    columns = zip(np.rad2deg(table.wrap_angle), branch, table.load, fixed(table.stretch, 4), strict=True)
    rows = [[f"{angle:.6g}", way, f"{load:g}", stretch] for angle, way, load, stretch in columns]
    return ["wrap_angle_deg", "branch", "load_N", "stretch_mm"], rows


class _Rows(Frozen):
    """[design.stretch]: loads of every loading [N], wrap angles [deg], and whether the way down is read too."""

    loads: tuple[Finite, ...]
    wrap_angles: tuple[Finite, ...]
    unloading: bool = False


class StretchDesign(Design):
    """[design]: how the rope is stretched."""

    stretch: _Rows = _Rows(loads=(), wrap_angles=())


def empty(design: StretchDesign, description: Description, file: str) -> StretchTable:
    """A table of a design's shape with unremarkable readings."""
    del description
    loads, angles = np.array(sorted(design.stretch.loads), dtype=float), radians(design.stretch.wrap_angles)
    cycle = np.concatenate([loads, loads[-2::-1]]) if design.stretch.unloading else loads
    down = np.arange(len(cycle)) >= len(loads)
    n = len(angles)
    load, wrap_angle = np.tile(cycle, n), np.repeat(angles, len(cycle))
    peak = np.full(len(load), loads.max(initial=0.0))
    names = tuple(f"{angle:.4g} deg" for angle in np.rad2deg(angles))
    of_cycle = np.repeat(np.arange(n), len(cycle))
    origin = RowOrigin.below_heading(file, len(load))
    return StretchTable(load, wrap_angle, 0.01 * load, np.tile(down, n), peak, of_cycle, names, origin)
