"""Stretch of the rope under load: how it is checked and described."""

from itertools import product

import numpy as np
from typing_extensions import override

from bowdenfit.description import Description, Finite
from bowdenfit.description.values import Frozen
from bowdenfit.files.columns import Quantity
from bowdenfit.kinds.copies import Compared, copies
from bowdenfit.kinds.init_questions import InitQuestions, WantedColumn
from bowdenfit.kinds.kind import Design, PlannedKind, Readings, RopeKind, Source, TableFromFiles
from bowdenfit.kinds.measurements import Measurements
from bowdenfit.kinds.pages import Page, fixed, in_words, radians
from bowdenfit.kinds.plausibility import parts, within_factor
from bowdenfit.kinds.preload.table import PreloadTable
from bowdenfit.kinds.rows import RowOrigin
from bowdenfit.kinds.stretch.table import StretchTable, read_stretch
from bowdenfit.types import Vector
from bowdenfit.words import counted, listed, significant

_LOW = 1 / 3  # share of the highest load above which a lowest load is not low
_STIFFNESSES = (0.1, 1e5)  # N/mm; a meter of thin cord and of crane rope
_FEWEST_LOADS = 4  # different loads from which stiffness and bedding-in can be told apart


class _StretchRows(Frozen):
    """[design.stretch]: loads of every loading [N], wrap angles [deg], and whether the way down is read too."""

    loads: tuple[Finite, ...]
    wrap_angles: tuple[Finite, ...]
    unloading: bool = False


class StretchDesign(Design):
    """[design]: how the rope is stretched."""

    stretch: _StretchRows = _StretchRows(loads=(), wrap_angles=())


class StretchKind(RopeKind[StretchTable], PlannedKind[StretchTable]):
    """Stretch of the rope at its loaded end, the far end held."""

    name = "stretch"
    table = StretchTable
    readings = (Readings("stretch", "stretch", "stretch", "stretch under {}", "Stretch (mm)"),)
    methods_sentence = (
        "Under the tension T the rope stretched by e(T) = T/k + d (1 - exp(-T/T_c)), with what friction held back along it."
    )
    init_questions = InitQuestions(
        "stretch of the rope under load, the far end held",
        (
            WantedColumn(Quantity("load", "force"), "the load on the rope's end"),
            WantedColumn(Quantity("wrap_angle", "angle"), "the wrap angle of the cable"),
            WantedColumn(Quantity("stretch", "length"), "the stretch"),
        ),
    )
    design = StretchDesign

    @override
    def read(self, source: Source) -> TableFromFiles[StretchTable]:
        return read_stretch(source)

    @override
    def describe(self, table: StretchTable, description: Description) -> list[str]:
        """Return how many readings there are, loads, wrap angles, and the friction that acts."""
        down = f", {int(table.unloading.sum())} of them while the load came down" if table.unloading.any() else ""
        angles = np.rad2deg(np.unique(table.wrap_angle))
        own = description.stretch.friction or "a friction coefficient of its own, mu_stretch"
        return [
            f"{table.origin.files[0]}: {self.count_readings(table)}{down}, loads {in_words(table.load, 'N')}, at "
            f"{len(angles)} wrap angle{'s' if len(angles) > 1 else ''}, {in_words(angles, 'deg')}; friction: {own}"
        ]

    @override
    def count_readings(self, table: StretchTable) -> str:
        return f"{counted(len(table.load), 'reading')} of stretch"

    @override
    def bends(self, table: StretchTable) -> Vector:
        return table.wrap_angle

    @override
    def tensions(self, table: StretchTable) -> Vector:
        return table.load

    @override
    def warnings(self, table: StretchTable, description: Description, measurements: Measurements) -> list[str]:
        file, loads, warnings = table.origin.files[0], np.unique(table.load), []
        if len(loads) == 1:
            warnings.append(
                f"{file} has a single load, {loads[0]:g} N, so the stiffness of the rope is not identifiable; read the stretch "
                "at several loads."
            )
        elif len(loads) < _FEWEST_LOADS:
            warnings.append(
                f"{file} has {len(loads)} different loads, too few to tell stiffness from bedding-in; read the stretch at "
                f"{_FEWEST_LOADS} or more, some of them low."
            )
        elif loads[0] > _LOW * loads[-1]:
            warnings.append(
                f"{file} has no low loads, only {loads[0]:g} to {loads[-1]:g} N, so how the rope beds in may not be "
                "identifiable; read the stretch at some low loads too."
            )
        more, stretch = float(np.ptp(loads)), float(np.ptp(table.stretch))
        if more > 0 and not _STIFFNESSES[0] * stretch < more < _STIFFNESSES[1] * stretch:
            warnings.append(
                f"the rope of {file} gives {significant(stretch)} mm under {significant(more)} N more, as hardly any rope "
                "does; the usual cause is a unit: check those of stretch and load."
            )
        falling = _falling(table)
        if falling:
            warnings.append(
                f"in {file} the stretch falls while the load grows, {falling}; check its sign, and whether the readings "
                "differ by more than their noise."
            )
        if not table.wrap_angle.any():
            warnings.append(
                f"every row of {file} is at a wrap angle of 0, so it says nothing of friction; read at larger ones too."
            )
        return warnings + one_angle_warning(measurements)

    @override
    def copied_readings(self, table: StretchTable) -> list[str]:
        names = tuple(f"cycle {name}" for name in table.cycle_names)
        places = np.column_stack([table.load, table.wrap_angle, table.unloading])
        curve = 2 * table.cycle + table.unloading
        read = table.stretch[:, None]
        return copies(Compared(listed(table.origin.files), table.cycle, names, places, read, table.load, curve))

    @override
    def why_implausible(self, measured: StretchTable, simulated: StretchTable) -> str:
        """Return that the stretch is of another size than the measured, or falls with the load."""
        if not within_factor(np.ptp(measured.stretch), np.ptp(simulated.stretch)):
            return "the stretch is far from the measured one"
        of_cycle = 2 * simulated.cycle + simulated.unloading
        load, stretch = (
            np.concatenate([part - part.mean() for part in parts(of_cycle, values)])
            for values in (simulated.load, simulated.stretch)
        )
        return "the stretch falls with the load" if load @ stretch <= 0 else ""

    @override
    def file_rows(self, table: StretchTable, description: Description) -> Page:
        branch = np.where(table.unloading, "unload", "load")
        columns = zip(np.rad2deg(table.wrap_angle), branch, table.load, fixed(table.stretch, 4), strict=True)
        rows = [[f"{angle:.6g}", way, f"{load:g}", stretch] for angle, way, load, stretch in columns]
        return ["wrap_angle_deg", "branch", "load_N", "stretch_mm"], rows

    @override
    def empty_table(self, design: StretchDesign, description: Description, file: str) -> StretchTable:
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


def _falling(table: StretchTable) -> str:
    """Return where the stretch under the largest load is less than under the smallest, in words; empty if nowhere."""
    for cycle, unloading in product(range(len(table.cycle_names)), (False, True)):
        rows = np.flatnonzero((table.cycle == cycle) & (table.unloading == unloading))
        if len(np.unique(table.load[rows])) < 2:
            continue
        low, high = rows[np.argmin(table.load[rows])], rows[np.argmax(table.load[rows])]
        if table.stretch[high] < table.stretch[low]:
            return f"from row {table.origin.row[low]} to row {table.origin.row[high]}"
    return ""


def one_angle_warning(measurements: Measurements) -> list[str]:
    """Return a warning where stretch and preload are all read at one wrap angle, which tells no lengthening."""
    tables = measurements.table(StretchTable), measurements.table(PreloadTable)
    different = np.unique(np.concatenate([table.wrap_angle for table in tables if table is not None]))
    if len(different) != 1:
        return []
    return [
        f"every row of stretch and preload is at one wrap angle, {np.rad2deg(different[0]):g} deg, so how far bending "
        "lengthens the sheath (lengthening) is not identifiable; read at several."
    ]
