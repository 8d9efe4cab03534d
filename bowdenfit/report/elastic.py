"""Stretch, preload and loops in words: what was read, what it cannot tell, and what the fit answers."""

from typing import Any

import numpy as np

from bowdenfit.description import Description
from bowdenfit.measurements.tables import LoopTable, Measurements, PreloadTable, StretchTable
from bowdenfit.report.layout import filled, table
from bowdenfit.results.elastic_summary import elastic_page
from bowdenfit.results.fit import Fit

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
    rows = measured.stretch
    if rows is not None:
        loads = len(np.unique(rows.load))
        if loads == 1:
            warnings.append(
                f"{rows.origin.files[0]} has a single load, {rows.load[0]:g} N, so the stiffness of the rope is not "
                "identifiable; read the stretch at several loads."
            )
        elif loads < _FEWEST_LOADS:
            warnings.append(
                f"{rows.origin.files[0]} has {loads} different loads, too few to tell stiffness from bedding-in; read the "
                f"stretch at {_FEWEST_LOADS} or more, some of them low."
            )
    angles = [t.wrap_angle for t in (rows, measured.preload) if t is not None]
    if angles and len(np.unique(np.concatenate(angles))) == 1:
        warnings.append(
            f"every row of stretch and preload is at one wrap angle, {np.rad2deg(angles[0][0]):g} deg, so how far bending "
            "lengthens the sheath (lengthening) is not identifiable; read at several."
        )
    if measured.loop is not None and description.preload_follows_stretch and not angles:
        warnings.append(
            "the preload is said to follow the stretch of the rope, but no table has stretch or preload; how it changes with "
            "the wrap angle will rest on the priors."
        )
    return warnings


def elastic_counts(measured: Measurements) -> list[str]:
    """How many readings of each kind were fitted."""
    kinds = (
        (measured.stretch and len(measured.stretch.load), "readings of stretch"),
        (measured.preload and len(measured.preload.preload), "preloads"),
        (measured.loop and len(measured.loop.stroke), "readings of a loop"),
    )
    return [f"{count} {what}" for count, what in kinds if count is not None]


def elastic_text(fit: Fit) -> str:
    """The answers about stretch, preload and the loop, with their intervals."""
    page = elastic_page(fit)
    if not page:
        return ""
    tables = [_answers(page, columns) for columns in _COLUMNS] if page["bends"] else []
    blocks = [*([_HEADING] if tables else []), *(t for t in tables if t), *(filled(s) for s in page["sentences"])]
    return "\n".join(blocks)


_HEADING = "Stretch and preload, median (90 % interval)"
_COLUMNS = (
    (
        ("preload", "preload (N)", 3),
        ("friction", "felt in free motion ({unit})", 3),
        ("slack_load", "return side slack from (N)", 3),
    ),
    (
        ("efficiency", "efficiency (%)", 3),
        ("position_error", "position error (mm)", 3),
        ("lost_motion", "lost motion (mm)", 2),
        ("stiffness", "stiffness (N/mm)", 3),
    ),
)


def _answers(page: dict[str, Any], columns: tuple[tuple[str, str, int], ...]) -> str:
    """Some of the answers, a row for each wrap angle; empty where the cable has none of them."""
    there = [column for column in columns if column[0] in page["bends"][0]]
    if not there:
        return ""
    under = f", {page['input_force']:g} N" if any(key in _UNDER_LOAD for key, _, _ in there) else ""
    heads = [f"at (deg){under}", *(head.format(unit=page["friction_unit"]) for _, head, _ in there)]
    rows = [
        [f"{bend['wrap_angle']:g}", *(_interval(bend[key], digits) for key, _, digits in there)]
        for bend in page["bends"]
    ]
    return table(heads, rows)


_UNDER_LOAD = {"efficiency", "position_error", "stiffness"}


def _interval(row: dict[str, float], digits: int) -> str:
    return f"{row['median']:.{digits}g} ({row['q05']:.{digits}g} to {row['q95']:.{digits}g})"
