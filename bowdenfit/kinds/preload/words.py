"""Tables of preload in words and in rows: what was read, what it cannot tell, what is plausible, how a file says it."""

import numpy as np

from bowdenfit.description import Description, Finite
from bowdenfit.description.values import Frozen
from bowdenfit.kinds.design import Design, radians
from bowdenfit.kinds.measurements import Measurements
from bowdenfit.kinds.pages import Page, fixed, in_words
from bowdenfit.kinds.plausibility import within_factor
from bowdenfit.kinds.preload.table import PreloadTable
from bowdenfit.kinds.rows import RowOrigin
from bowdenfit.kinds.stretch.table import StretchTable
from bowdenfit.kinds.stretch.words import one_angle_warning
from bowdenfit.words import counted

_FEWEST_TAUT = 3  # readings above 0 that a plausible table has


def describe(rows: PreloadTable, description: Description) -> list[str]:
    """Readings, how large and at which wrap angles."""
    del description
    slack = int(np.sum(rows.preload == 0))
    none = f" ({slack} of them 0, which says at most 0)" if slack else ""
    angles = in_words(np.rad2deg(rows.wrap_angle), "deg")
    n = counted(len(rows.preload), "preload")
    return [f"{rows.origin.files[0]}: {n}{none}, {in_words(rows.preload, 'N')}, at {angles}"]


def warnings_of(rows: PreloadTable, description: Description, measurements: Measurements) -> list[str]:
    """What the table will not be able to tell, as far as counting shows; with stretch, what both will not."""
    alone = measurements.table(StretchTable) is None
    file, warnings = rows.origin.files[0], one_angle_warning(measurements) if alone else []
    if not description.preload_follows_stretch:
        return warnings
    if not rows.preload.any():
        warnings.append(
            f"every preload in {file} reads 0, which says only that the rope is slack; read it where it is taut."
        )
    elif np.ptp(rows.wrap_angle) > 0 and np.corrcoef(rows.wrap_angle, rows.preload)[0, 1] < 0:
        warnings.append(
            f"the preload in {file} falls with the wrap angle, which bending alone cannot do; check the columns, or write "
            'model = "constant" under [preload] if springs hold it.'
        )
    if alone:
        warnings.append(
            "without a table of stretch, preloads tell only how lengthening compares with the give of the rope; stiffness, "
            "bedding-in and lengthening by themselves will rest on their priors."
        )
    return warnings


def implausible(real: PreloadTable, made: PreloadTable) -> str:
    """A rope that is slack nearly everywhere, or preload of another size than the measured."""
    if np.sum(made.preload > 0) < min(int(np.sum(real.preload > 0)), _FEWEST_TAUT):
        return "the rope is slack at nearly every angle"
    close = within_factor(real.preload.max(), made.preload.max())
    return "" if close else "the preload is far from the measured one"


def page(table: PreloadTable, description: Description) -> Page:
    """Headings and rows of its file."""
    del description
    columns = zip(np.rad2deg(table.wrap_angle), fixed(table.preload, 3), strict=True)
    return ["wrap_angle_deg", "preload_N"], [[f"{angle:.6g}", preload] for angle, preload in columns]


class _Rows(Frozen):
    """[design.preload]: wrap angles [deg]."""

    wrap_angles: tuple[Finite, ...]


class PreloadDesign(Design):
    """[design]: where the preload is read."""

    preload: _Rows = _Rows(wrap_angles=())


def empty(design: PreloadDesign, description: Description, file: str) -> PreloadTable:
    """A table of a design's shape with unremarkable readings."""
    del description
    angles = radians(design.preload.wrap_angles)
    return PreloadTable(angles, np.full(len(angles), 20.0), RowOrigin.below_heading(file, len(angles)))
