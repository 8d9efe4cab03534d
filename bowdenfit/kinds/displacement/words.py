"""Tables of force against displacement in words and in rows: what was read, what it cannot tell, how a file says it."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Annotated

import numpy as np
from pydantic import Field

from bowdenfit.description import Description, Finite
from bowdenfit.description.values import Frozen
from bowdenfit.kinds.design import Design, radians
from bowdenfit.kinds.displacement.chosen import early
from bowdenfit.kinds.displacement.table import DisplacementSettings, DisplacementTable
from bowdenfit.kinds.displacement.turns import in_order
from bowdenfit.kinds.measurements import Measurements
from bowdenfit.kinds.pages import Page, fixed, in_words, route_cells, route_heading
from bowdenfit.kinds.plausibility import within_factor
from bowdenfit.kinds.rows import OwnAngles, RowOrigin

_SPRING, _ROPE = "end_spring", "rope_stiffness"
_FEW_SHARE = 0.2  # of all displacements, that pull and return must have in common to be a loop


def count(table: DisplacementTable) -> str:
    """How many readings are used, in how many runs."""
    runs = len(table.run_names)
    return f"{int(table.used.sum())} forces against displacement in {runs} run{'s' if runs > 1 else ''}"


def describe(table: DisplacementTable, description: Description) -> list[str]:
    """Readings of each stroke, what is at the far end, and where the loop closes."""
    pulling = int(table.pulls.sum())
    low, high = table.shared
    closes = f"pull and return from {low:.4g} to {high:.4g} mm" if high > low else "pull and return nowhere at one displacement"
    unused = int(np.sum(~table.used))
    left = f"; {unused} of {len(table.used)} rows are not used" if unused else ""
    return [
        f"{table.origin.files[0]}: {count(table)} ({pulling} pulling, {int(table.used.sum()) - pulling} returning), "
        f"{in_words(table.force, 'N')} over {in_words(table.displacement, 'mm')}, {closes}; far end: {_end(description)}{left}"
    ]


def _end(description: Description) -> str:
    """What is at the far end, and how much is known of it."""
    settings = description.table(DisplacementSettings)
    if settings is not None and settings.end == "stop":
        return "a stop"
    return f"a spring whose stiffness is {'stated' if _SPRING in description.prior else 'fitted'}"


def warnings_of(table: DisplacementTable, description: Description, measurements: Measurements) -> list[str]:
    """What the table will not be able to tell, as far as counting shows."""
    del measurements
    return list(_warnings(table, description))


def _warnings(table: DisplacementTable, description: Description) -> Iterator[str]:
    file, settings = table.origin.files[0], description.table(DisplacementSettings)
    springy = settings is None or settings.end == "spring"
    rope_known = _ROPE in description.prior or "stretch" in description.tables.stated
    free = [name for name, known in ((_SPRING, not springy or _SPRING in description.prior), (_ROPE, rope_known)) if not known]
    low, high = table.shared
    closes = high - low > _FEW_SHARE * np.ptp(table.displacement)
    if free and not closes:
        yield (
            f"in {file} pull and return do not meet over the same displacements, so the loop does not close, and "
            f"{' and '.join(free)} {'are' if len(free) > 1 else 'is'} free: friction cannot be told from the stiffness. Record "
            "the return too, or state what is known of spring and rope under [prior.NAME]."
        )
    elif table.sliding and len(free) == 2:
        yield (
            f"{file} has readings of the sliding rope alone, and neither {_SPRING} nor {_ROPE} is stated: the width of the "
            "loop tells the friction exponent only to a factor of two, between a rope that does not give and an end that does "
            "not. Read through the turns of the motor too, or state one of them under [prior.NAME]."
        )
    if not np.any(table.used):
        yield f"no row of {file} can be used."
    if not (np.nansum(table.own.angle, axis=1) > 0).any() and not any(
        c.wrap_angle.constant is not None or c.wrap_angle.curve for c in description.contact
    ):
        yield f"every row of {file} is at a wrap angle of 0, so it says nothing of friction; read at larger ones too."


def implausible(real: DisplacementTable, made: DisplacementTable) -> str:
    """Forces of another size than the measured, or a force below nothing."""
    if np.any(made.force < -0.05 * max(made.force.max(), 0.0)):
        return "a force is negative"
    return "" if within_factor(np.ptp(real.force), np.ptp(made.force)) else "the force is far from the measured one"


def page(table: DisplacementTable, description: Description) -> Page:
    """Headings and rows of its file."""
    names = table.own.names
    displacements, forces = fixed(table.displacement, 4), fixed(table.force, 4)
    rows = [
        [
            *route_cells(table.route[i], description),
            *("" if np.isnan(angle) else f"{angle:.6g}" for angle in np.rad2deg(table.own.angle[i])),
            table.run_names[table.run[i]],
            *(["pull" if table.motion.stroke[i] > 0 else "return"] if table.sliding else []),
            displacements[i],
            forces[i],
        ]
        for i in range(len(table.run))
    ]
    heads = [*route_heading(description), *(f"{name}_deg" for name in names), "run", *(["stroke"] if table.sliding else [])]
    return [*heads, "displacement_mm", "force_N"], rows


class _Rows(Frozen):
    """[design.displacement]: displacements of a stroke [mm], how often up and down, and the wrap angle of each run [deg]."""

    displacements: tuple[Finite, ...] = ()
    cycles: Annotated[int, Field(ge=1, le=100)] = 2
    wrap_angles: tuple[Finite, ...] = ()


class DisplacementDesign(Design):
    """[design]: how the motor moves."""

    displacement: _Rows = _Rows()


def empty(design: DisplacementDesign, description: Description, file: str) -> DisplacementTable:
    """A table of a design's shape with unremarkable readings, in the order in which the motor moves up and down."""
    moved, angles = design.displacement, radians(design.displacement.wrap_angles)
    up = np.array(sorted(set(moved.displacements)), dtype=float)
    path = np.append(np.tile(np.concatenate([up, up[-2:0:-1]]), moved.cycles), up[:1])
    runs, names = max(len(angles), 1), description.angle_columns
    x, run = np.tile(path, runs), np.repeat(np.arange(runs), len(path))
    own = OwnAngles.none(names, len(x))
    column = next((c.wrap_angle.column for c in description.contact if c.wrap_angle.column), None)
    if column is not None and len(angles):
        own.angle[:, names.index(column)] = angles[run]
    labels = tuple(f"{angle:.4g} deg" for angle in np.rad2deg(angles)) or ("all",)
    every, nowhere = np.ones(len(x), dtype=bool), np.full(len(x), np.nan)
    origin = RowOrigin.below_heading(file, len(x))
    table = DisplacementTable(nowhere, 1.0 + x, x, in_order(x, run), run, labels, every, own, origin, False)
    return replace(table, used=~early(table))
