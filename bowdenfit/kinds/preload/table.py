"""Preload between fixed ends at wrap angles."""

from dataclasses import dataclass

import numpy as np

from bowdenfit.description import Table
from bowdenfit.display import Part
from bowdenfit.files.columns import Quantity, find_columns, require
from bowdenfit.files.tables import read_table
from bowdenfit.kinds.kind import Found, Source
from bowdenfit.kinds.rows import RowOrigin, provenance_of, read_angle, read_tension
from bowdenfit.types import Vector

_UNUSED = ("time", "position", "run")  # columns that such a table may have and that nothing reads


class PreloadTableSettings(Table):
    """The table of preload, by which it follows the stretch of the rope unless the description says otherwise."""

    @property
    def tells_preload(self) -> bool:
        """It does."""
        return True


@dataclass(frozen=True, repr=False)
class PreloadTable(Part):
    """Preload between fixed ends at wrap angles.

    Args:
        wrap_angle: Total wrap angle of the cable [rad].
        preload: Tension at rest [N]; 0 where the rope is slack.
        origin: Where each row was read.
    """

    wrap_angle: Vector
    preload: Vector
    origin: RowOrigin


def read_preload(source: Source) -> Found[PreloadTable]:
    """Read a table of preload against wrap angle, measured between fixed ends; 0 where the rope is slack.

    Args:
        source: Where it is.

    Raises:
        DatasetError: See `read_table` and `find_columns`; or a preload is negative.
    """
    path = source.file
    table = read_table(path)
    wanted = (Quantity("preload", "force"), Quantity("wrap_angle", "angle"))
    found = find_columns(table, wanted, source.columns, _UNUSED)
    angles = require(table, found, "wrap_angle", "wrap_angle_deg")
    preloads = require(table, found, "preload", "preload_N")
    rows = PreloadTable(
        np.array(angles.each(lambda cell: read_angle(cell, angles), np.nan)),
        np.array(preloads.each(lambda cell: read_tension(cell, preloads, "a preload"), np.nan)),
        provenance_of(table),
    )
    return Found(rows, {path.name: path}, accounts=(table.account,))
