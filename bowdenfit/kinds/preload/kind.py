"""Preload between fixed ends: how it is read, checked and described."""

from dataclasses import replace

import numpy as np
from typing_extensions import override

from bowdenfit.description import Description, Finite
from bowdenfit.description.values import Frozen
from bowdenfit.files.columns import Quantity, require_column
from bowdenfit.kinds.bench_error import BenchError
from bowdenfit.kinds.kind import Design, PlannedKind, Readings, RopeKind
from bowdenfit.kinds.measured_columns import MeasuredColumn
from bowdenfit.kinds.plausibility import is_within_factor
from bowdenfit.kinds.rows import (
    FileRows,
    RowOrigin,
    convert_to_radians,
    describe_range,
    format_fixed,
    origin_of_rows,
    read_angle,
    read_tension,
)
from bowdenfit.kinds.table_files import InitQuestions, Source, TableFromFiles, WantedColumn
from bowdenfit.kinds.tables import Measurements, PreloadTable, PreloadTableSettings, StretchTable, warn_of_single_angle
from bowdenfit.types import Vector
from bowdenfit.words import counted

_UNUSED = ("time", "position", "run")  # columns that such a table may have and that nothing reads
_FEWEST_TAUT = 3  # readings above 0 in a plausible table; a judgement


class _PreloadRows(Frozen):
    """[design.preload]: wrap angles [deg]."""

    wrap_angles: tuple[Finite, ...]


class PreloadDesign(Design):
    """[design]: where the preload is read."""

    preload: _PreloadRows = _PreloadRows(wrap_angles=())


class PreloadKind(RopeKind[PreloadTable], PlannedKind[PreloadTable]):
    """Tension of the rope between fixed ends, at several wrap angles."""

    name = "preload"
    table = PreloadTable
    settings = PreloadTableSettings
    readings = (Readings("measured_preload", "preload", "preload", "preload at {}", "Preload (N)"),)
    methods_sentence = "The preload between fixed ends was that of the model at each wrap angle."
    init_questions = InitQuestions(
        "preload between fixed ends at several wrap angles",
        (
            WantedColumn(Quantity("preload", "force"), "the preload"),
            WantedColumn(Quantity("wrap_angle", "angle"), "the wrap angle of the cable"),
        ),
    )
    design = PreloadDesign

    @override
    def read(self, source: Source) -> TableFromFiles[PreloadTable]:
        """Read a table of preload against wrap angle, measured between fixed ends; 0 where the rope is slack.

        Raises:
            DatasetError: See `read_table` and `find_columns`; or a preload is negative.
        """
        path = source.file
        wanted = (Quantity("preload", "force"), Quantity("wrap_angle", "angle"))
        table, columns = source.read_table(path, wanted, _UNUSED)
        angles = require_column(table, columns, "wrap_angle", "wrap_angle_deg")
        preloads = require_column(table, columns, "preload", "preload_N")
        rows = PreloadTable(
            np.array(angles.read_cells(lambda cell: read_angle(cell, angles), np.nan)),
            np.array(preloads.read_cells(lambda cell: read_tension(cell, preloads, "a preload"), np.nan)),
            origin_of_rows(table),
        )
        return TableFromFiles(rows, {path.name: path}, accounts=(table.account,))

    @override
    def describe(self, table: PreloadTable, description: Description) -> list[str]:
        """Return how many readings there are, how large and at which wrap angles."""
        slack = int(np.sum(table.preload == 0))
        none = f" ({slack} of them 0, which says at most 0)" if slack else ""
        angles = describe_range(np.rad2deg(table.wrap_angle), "deg")
        file, n = table.origin.files[0], self.count_readings(table)
        return [f"{file}: {n}{none}, {describe_range(table.preload, 'N')}, at {angles}"]

    @override
    def count_readings(self, table: PreloadTable) -> str:
        return counted(len(table.preload), "preload")

    @override
    def bends(self, table: PreloadTable) -> Vector:
        return table.wrap_angle

    @override
    def tensions(self, table: PreloadTable) -> Vector:
        return table.preload

    @override
    def warnings(self, table: PreloadTable, description: Description, measurements: Measurements) -> list[str]:
        lacks_stretch = measurements.table(StretchTable) is None
        file, warnings = table.origin.files[0], warn_of_single_angle(measurements) if lacks_stretch else []
        if not description.preload_follows_stretch:
            return warnings
        if not table.preload.any():
            warnings.append(
                f"every preload in {file} reads 0, which says only that the rope is slack; read it where it is taut."
            )
        elif np.ptp(table.wrap_angle) > 0 and np.corrcoef(table.wrap_angle, table.preload)[0, 1] < 0:
            warnings.append(
                f"the preload in {file} falls with the wrap angle, which bending alone cannot do; check the columns, or write "
                'model = "constant" under [preload] if springs hold it.'
            )
        if lacks_stretch:
            warnings.append(
                "without a table of stretch, preloads determine only how lengthening compares with the give of the rope; "
                "stiffness, bedding-in and lengthening by themselves will rest on their priors."
            )
        return warnings

    @override
    def measured_columns(self, table: PreloadTable) -> list[MeasuredColumn]:
        return [MeasuredColumn("preload", "N", table.preload, table.wrap_angle)]

    @override
    def with_bench_error(self, table: PreloadTable, error: BenchError) -> PreloadTable:
        """Return the table with the error in its preloads and wrap angles."""
        preload = error.apply_to_force(table.preload, 0.0)
        return replace(table, preload=preload, wrap_angle=error.apply_to_angles(table.wrap_angle))

    @override
    def why_implausible(self, measured: PreloadTable, simulated: PreloadTable) -> str:
        """Return that the rope is slack nearly everywhere, or the preload of another size than the measured."""
        if np.sum(simulated.preload > 0) < min(int(np.sum(measured.preload > 0)), _FEWEST_TAUT):
            return "the rope is slack at nearly every angle"
        close = is_within_factor(measured.preload.max(), simulated.preload.max())
        return "" if close else "the preload is far from the measured one"

    @override
    def file_rows(self, table: PreloadTable, description: Description) -> FileRows:
        columns = zip(np.rad2deg(table.wrap_angle), format_fixed(table.preload, 3), strict=True)
        return ["wrap_angle_deg", "preload_N"], [[f"{angle:.6g}", preload] for angle, preload in columns]

    @override
    def empty_table(self, design: PreloadDesign, description: Description, file: str) -> PreloadTable:
        angles = convert_to_radians(design.preload.wrap_angles)
        return PreloadTable(angles, np.full(len(angles), 20.0), RowOrigin.below_heading(file, len(angles)))
