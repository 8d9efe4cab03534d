"""Tables of stretch, preload and loops in words: what was read, and what it cannot tell."""

from itertools import product

import numpy as np

from bowdenfit.description import Description
from bowdenfit.description.elastic import PRELOAD
from bowdenfit.kinds.measurements import Measurements
from bowdenfit.kinds.tables import LoopTable, PreloadTable, StretchTable

_LOW = 1 / 3  # share of the highest load above which a lowest load is not low
_FREE = 0.25  # output over input force below which a loop moves all but freely
_FEWEST_LOADS = 4  # different loads from which stiffness and bedding-in can be told apart


def elastic_tables(description: Description, measured: Measurements) -> list[str]:
    """What was understood of the tables, a line each."""
    lines = []
    if measured.stretch is not None:
        lines.append(_stretch(description, measured.stretch))
    if measured.preload is not None:
        lines.append(_preload(measured.preload))
    if measured.loop is not None:
        lines.append(_loop(description, measured.loop))
    if description.cable.sharp_bend:
        lines.append(f"  note: {description.cable.sharp_bend}")
    return lines


def _range(values: np.ndarray, unit: str) -> str:
    low, high = float(values.min()), float(values.max())
    return f"{low:.4g} {unit}" if low == high else f"{low:.4g} to {high:.4g} {unit}"


def _stretch(description: Description, rows: StretchTable) -> str:
    down = f", {int(rows.unloading.sum())} of them while the load came down" if rows.unloading.any() else ""
    angles = np.rad2deg(np.unique(rows.wrap_angle))
    own = description.stretch.friction or "a friction coefficient of its own, mu_stretch"
    return (
        f"  {rows.origin.files[0]}: {len(rows.load)} readings of stretch{down}, loads {_range(rows.load, 'N')}, at "
        f"{len(angles)} wrap angle{'s' if len(angles) > 1 else ''}, {_range(angles, 'deg')}; friction: {own}"
    )


def _preload(rows: PreloadTable) -> str:
    slack = int(np.sum(rows.preload == 0))
    none = f" ({slack} of them 0, which says at most 0)" if slack else ""
    angles = _range(np.rad2deg(rows.wrap_angle), "deg")
    return f"  {rows.origin.files[0]}: {len(rows.preload)} preloads{none}, {_range(rows.preload, 'N')}, at {angles}"


def _loop(description: Description, rows: LoopTable) -> str:
    forward = int(np.sum(rows.stroke > 0))
    how = "follows the wrap angle as the stretch model says" if description.preload_follows_stretch else "is constant"
    measured = int(np.isfinite(rows.preload).sum())
    own = f"; {measured} rows have their own measured preload" if measured else ""
    return (
        f"  {rows.origin.files[0]}: {len(rows.stroke)} readings of a loop ({forward} moving forward, "
        f"{len(rows.stroke) - forward} back), input {_range(rows.input_force, 'N')}; its preload {how}{own}"
    )


def elastic_warnings(description: Description, measured: Measurements) -> list[str]:
    """What stretch, preload and loop tables will not be able to tell, as far as counting shows."""
    warnings = []
    if measured.stretch is not None:
        warnings += _stretch_warnings(measured.stretch)
    angles = [t.wrap_angle for t in (measured.stretch, measured.preload) if t is not None]
    if angles and len(np.unique(np.concatenate(angles))) == 1:
        warnings.append(
            f"every row of stretch and preload is at one wrap angle, {np.rad2deg(angles[0][0]):g} deg, so how far bending "
            "lengthens the sheath (lengthening) is not identifiable; read at several."
        )
    if measured.preload is not None and description.preload_follows_stretch:
        warnings += _preload_warnings(measured.preload, measured.stretch is not None)
    if measured.loop is not None:
        warnings += _loop_warnings(description, measured)
    if "wrap_angle" in description.preload.model_fields_set and not description.preload_follows_stretch:
        warnings.append(
            "cable.toml gives the wrap angle at which the preload holds, but takes the preload as constant; write "
            'model = "stretch" under [preload] if it changes with the wrap angle.'
        )
    return warnings


def _stretch_warnings(rows: StretchTable) -> list[str]:
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
    return warnings


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


def _preload_warnings(rows: PreloadTable, has_stretch: bool) -> list[str]:
    file, warnings = rows.origin.files[0], []
    if not rows.preload.any():
        warnings.append(
            f"every preload in {file} reads 0, which says only that the rope is slack; read it where it is taut."
        )
    elif np.ptp(rows.wrap_angle) > 0 and np.corrcoef(rows.wrap_angle, rows.preload)[0, 1] < 0:
        warnings.append(
            f"the preload in {file} falls with the wrap angle, which bending alone cannot do; check the columns, or write "
            'model = "constant" under [preload] if springs hold it.'
        )
    if not has_stretch:
        warnings.append(
            "without a table of stretch, preloads tell only how lengthening compares with the give of the rope; stiffness, "
            "bedding-in and lengthening by themselves will rest on their priors."
        )
    return warnings


def _loop_warnings(description: Description, measured: Measurements) -> list[str]:
    rows, warnings = measured.loop, []
    assert rows is not None  # the caller checked
    elastic = measured.stretch is not None or measured.preload is not None
    if description.preload_follows_stretch and not elastic:
        warnings.append(
            "the preload is said to follow the stretch of the rope, but no table has stretch or preload; how it changes with "
            "the wrap angle will rest on the priors."
        )
    stated = description.preload.value is not None or PRELOAD in description.prior or measured.preload is not None
    told = stated or np.isfinite(rows.preload).any()
    if not told and np.median(np.abs(rows.output_force)) < _FREE * np.median(np.abs(rows.input_force)):
        warnings.append(
            f"nearly all of {rows.origin.files[0]} was read in free motion, with hardly any output force; that tells only the "
            "product of friction and preload: load the loop until its return side is slack, or measure the preload."
        )
    return warnings
