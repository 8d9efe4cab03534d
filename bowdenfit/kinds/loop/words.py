"""Tables of a loop in words and in rows: what was read, what it cannot tell, what is plausible, how a file says it."""

import numpy as np
from pydantic import model_validator

from bowdenfit.description import Description, Finite, Table
from bowdenfit.description.elastic import PRELOAD
from bowdenfit.description.values import Frozen
from bowdenfit.kinds.design import Design, Stroke, radians, signs
from bowdenfit.kinds.loop.table import LoopTable
from bowdenfit.kinds.measurements import Measurements
from bowdenfit.kinds.pages import STROKE_NAMES, Page, fixed, in_words
from bowdenfit.kinds.plausibility import HIGHEST, LOWEST
from bowdenfit.kinds.preload.table import PreloadTable
from bowdenfit.kinds.rows import OwnAngles, RowOrigin
from bowdenfit.kinds.stretch.table import StretchTable
from bowdenfit.words import counted

_FREE = 0.25  # output over input force below which a loop moves all but freely


def contradiction(settings: Table | None, description: Description) -> str:
    """A loop's table of a cable that is none."""
    wrong = settings is not None and description.cable.kind != "loop"
    return 'the table loop needs kind = "loop" under [cable]' if wrong else ""


def describe(rows: LoopTable, description: Description) -> list[str]:
    """Readings of each direction, how large, and where their preload comes from."""
    forward = int(np.sum(rows.stroke > 0))
    how = "follows the wrap angle as the stretch model says" if description.preload_follows_stretch else "is constant"
    measured = int(np.isfinite(rows.preload).sum())
    own = f"; {measured} rows have their own measured preload" if measured else ""
    return [
        f"{rows.origin.files[0]}: {counted(len(rows.stroke), 'reading')} of a loop ({forward} moving forward, "
        f"{len(rows.stroke) - forward} back), input {in_words(rows.input_force, 'N')}; its preload {how}{own}"
    ]


def warnings_of(rows: LoopTable, description: Description, measurements: Measurements) -> list[str]:
    """What the table will not be able to tell, as far as counting shows."""
    warnings, has_preload = [], measurements.table(PreloadTable) is not None
    elastic = has_preload or measurements.table(StretchTable) is not None
    if description.preload_follows_stretch and not elastic:
        warnings.append(
            "the preload is said to follow the stretch of the rope, but no table has stretch or preload; how it changes with "
            "the wrap angle will rest on the priors."
        )
    stated = description.preload.value is not None or PRELOAD in description.prior or has_preload
    told = stated or np.isfinite(rows.preload).any()
    if not told and np.median(np.abs(rows.output_force)) < _FREE * np.median(np.abs(rows.input_force)):
        warnings.append(
            f"nearly all of {rows.origin.files[0]} was read in free motion, with hardly any output force; that tells only the "
            "product of friction and preload: load the loop until its return side is slack, or measure the preload."
        )
    return warnings


def implausible(real: LoopTable, made: LoopTable) -> str:
    """A loop that gains force, or loses none or nearly all of it."""
    lost = made.stroke * (made.input_force - made.output_force)
    if np.median(lost) < 0:
        return "a loop gains force"
    loaded = np.abs(real.input_force) >= 0.5 * np.abs(real.input_force).max()
    share = np.median(lost[loaded] / np.abs(made.input_force[loaded]))
    return "" if 1 - HIGHEST <= share <= 1 - LOWEST else "a loop loses less than 1 % or more than 80 % of its force"


def page(table: LoopTable, description: Description) -> Page:
    """Headings and rows of its file, as torques where both pulleys' radii are stated."""
    cable, names = description.cable, table.own.names
    radii = [radius.to("length") / 1000 for radius in (cable.input_pulley_radius, cable.output_pulley_radius) if radius]
    what, (first, second), digits = ("force_N", (1.0, 1.0), 3) if len(radii) < 2 else ("torque_N_m", radii, 5)
    inputs, outputs = fixed(first * table.input_force, digits), fixed(second * table.output_force, digits)
    rows = [
        [
            *(f"{angle:.6g}" for angle in np.rad2deg(table.own.angle[i])),
            STROKE_NAMES[int(table.stroke[i])],
            inputs[i],
            outputs[i],
        ]
        for i in range(len(table.stroke))
    ]
    return [*(f"{name}_deg" for name in names), "stroke", f"input_{what}", f"output_{what}"], rows


class _Rows(Frozen):
    """[design.loop]: wrap angles [deg] and input forces [N] under load, wrap angles of free motion [deg], and strokes."""

    wrap_angles: tuple[Finite, ...] = ()
    input_forces: tuple[Finite, ...] = ()
    strokes: tuple[Stroke, ...] = ("pull",)
    free_motion: tuple[Finite, ...] = ()

    @model_validator(mode="after")
    def _loads_are_given(self) -> "_Rows":
        if self.wrap_angles and not self.input_forces:
            raise ValueError("wrap_angles need input_forces, such as [5, 10, 20] (in N)")
        return self


class LoopDesign(Design):
    """[design]: how the loop is moved."""

    loop: _Rows = _Rows()


def empty(design: LoopDesign, description: Description, file: str) -> LoopTable:
    """A table of a design's shape with unremarkable readings."""
    loop, strokes = design.loop, signs(design.loop.strokes)
    loaded = [(a, f, s) for a in radians(loop.wrap_angles) for s in strokes for f in loop.input_forces]
    free = [(a, np.nan, s) for a in radians(loop.free_motion) for s in strokes]
    rows = np.array([*loaded, *free], dtype=float).reshape(-1, 3)
    names, n = description.angle_columns, len(rows)
    own = OwnAngles.none(names, n)
    column = next((c.wrap_angle.column for c in description.contact if c.wrap_angle.column), None)
    if column is not None:
        own.angle[:, names.index(column)] = rows[:, 0]
    nothing = np.full(n, np.nan)
    origin = RowOrigin.below_heading(file, n)
    return LoopTable(nothing, rows[:, 1], 0.8 * rows[:, 1], rows[:, 2].astype(int), nothing, own, origin)
