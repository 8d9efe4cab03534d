"""Tables of stretch, preload and a loop, measured on the computer."""

from dataclasses import dataclass

import numpy as np

from bowdenfit.description import Description
from bowdenfit.kinds.measurements import Measurements
from bowdenfit.kinds.tables import LoopTable, OwnAngles, PreloadTable, Provenance, StretchTable


@dataclass(frozen=True)
class ElasticDesign:
    """What is measured of stretch, preload and a loop.

    Args:
        loads: Loads of every loading of the rope, growing [N].
        stretch_angles: Wrap angles at which the rope is stretched [rad].
        unloading: Whether it is read on the way down too.
        preload_angles: Wrap angles at which the preload is read [rad].
        loop_angles: Wrap angles at which the loop is moved under load [rad].
        input_forces: Input forces of the loop at each of them [N].
        strokes: +1 forward, -1 back, in order.
        free_angles: Wrap angles at which the loop is moved without load [rad].
    """

    loads: tuple[float, ...] = ()
    stretch_angles: tuple[float, ...] = ()
    unloading: bool = False
    preload_angles: tuple[float, ...] = ()
    loop_angles: tuple[float, ...] = ()
    input_forces: tuple[float, ...] = ()
    strokes: tuple[int, ...] = (1,)
    free_angles: tuple[float, ...] = ()


def empty_elastic_tables(description: Description, design: ElasticDesign) -> Measurements:
    """Tables of the design's shape with unremarkable readings."""
    tables = description.tables
    return Measurements().with_tables(
        _stretch_rows(design, tables.stretch.file or "stretch.csv") if tables.stretch else None,
        _preload_rows(design, tables.preload.file or "preload.csv") if tables.preload else None,
        _loop_rows(description, design, tables.loop.file or "loop.csv") if tables.loop else None,
    )


def _stretch_rows(design: ElasticDesign, file: str) -> StretchTable:
    loads, angles = np.asarray(design.loads, dtype=float), np.asarray(design.stretch_angles, dtype=float)
    cycle = np.concatenate([loads, loads[-2::-1]]) if design.unloading else loads
    down = np.arange(len(cycle)) >= len(loads)
    n = len(angles)
    load, wrap_angle = np.tile(cycle, n), np.repeat(angles, len(cycle))
    peak = np.full(len(load), loads.max(initial=0.0))
    names = tuple(f"{angle:.4g} deg" for angle in np.rad2deg(angles))
    of_cycle = np.repeat(np.arange(n), len(cycle))
    origin = _origin(file, len(load))
    return StretchTable(load, wrap_angle, 0.01 * load, np.tile(down, n), peak, of_cycle, names, origin)


def _preload_rows(design: ElasticDesign, file: str) -> PreloadTable:
    angles = np.asarray(design.preload_angles, dtype=float)
    return PreloadTable(angles, np.full(len(angles), 20.0), _origin(file, len(angles)))


def _loop_rows(description: Description, design: ElasticDesign, file: str) -> LoopTable:
    """Rows under load, wrap angle by wrap angle, then those of free motion, which have no input force yet."""
    loaded = [(a, f, s) for a in design.loop_angles for s in design.strokes for f in design.input_forces]
    free = [(a, np.nan, s) for a in design.free_angles for s in design.strokes]
    rows = np.array([*loaded, *free], dtype=float).reshape(-1, 3)
    names, n = description.angle_columns, len(rows)
    own = OwnAngles(names, np.full((n, len(names)), np.nan), np.full((n, len(names)), np.nan))
    column = next((c.wrap_angle.column for c in description.contact if c.wrap_angle.column), None)
    if column is not None:
        own.angle[:, names.index(column)] = rows[:, 0]
    nothing = np.full(n, np.nan)
    return LoopTable(nothing, rows[:, 1], 0.8 * rows[:, 1], rows[:, 2].astype(int), nothing, own, _origin(file, n))


def _origin(file: str, n: int) -> Provenance:
    return Provenance((file,), np.zeros(n, dtype=int), np.arange(2, n + 2))
