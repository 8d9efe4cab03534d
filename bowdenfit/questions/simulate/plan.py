"""What a plan says is measured ([design]), and simulated tables as the rows of their files."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from bowdenfit.description import Description
from bowdenfit.errors import DescriptionError
from bowdenfit.kinds.elastic_simulation import ElasticDesign
from bowdenfit.kinds.measurements import Measurements
from bowdenfit.kinds.tables import AngleTable, EfficiencyTable, ForceTable, LoopTable, PreloadTable, StretchTable
from bowdenfit.questions.simulate.simulation import Design

Page = tuple[list[str], list[list[str]]]  # headings and rows
Stroke = Literal["pull", "return"]
_STROKES: Mapping[str, int] = {"pull": 1, "return": -1}
_STROKE_NAMES = {sign: name for name, sign in _STROKES.items()}


class _Page(BaseModel):
    """Base of all parts."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class _StretchPage(_Page):
    """[design.stretch]: loads in N, wrap angles in deg, and whether the rope is read on the way down too."""

    loads: tuple[float, ...]
    wrap_angles: tuple[float, ...]
    unloading: bool = False


class _PreloadPage(_Page):
    """[design.preload]: wrap angles in deg."""

    wrap_angles: tuple[float, ...]


class _LoopPage(_Page):
    """[design.loop]: wrap angles in deg, input forces in N at each of them; wrap angles of free motion."""

    wrap_angles: tuple[float, ...] = ()
    input_forces: tuple[float, ...] = ()
    strokes: tuple[Stroke, ...] = ("pull",)
    free_motion: tuple[float, ...] = ()


class _DesignPage(_Page):
    """[design] as written: route values, input forces in N, strokes by name."""

    angles: tuple[float, ...] = ()
    efficiencies: tuple[float, ...] = ()
    runs: tuple[float, ...] = ()
    input_forces: tuple[float, ...] = ()
    strokes: tuple[Stroke, ...] = ("pull", "return")
    stretch: _StretchPage = Field(default=_StretchPage(loads=(), wrap_angles=()))
    preload: _PreloadPage = Field(default=_PreloadPage(wrap_angles=()))
    loop: _LoopPage = _LoopPage()


def read_design(page: Mapping[str, Any], file: str) -> Design:
    """The design of a plan.

    Args:
        page: [design] as read.
        file: Its file, for errors.

    Raises:
        DescriptionError: A key or a value is wrong.
    """
    try:
        design = _DesignPage.model_validate(dict(page))
    except ValidationError as error:
        first = error.errors()[0]
        raise DescriptionError(f"{file}, design.{'.'.join(map(str, first['loc']))}: {first['msg'].lower()}.") from None
    if design.runs and not design.input_forces:
        raise DescriptionError(f"{file}, design: runs need input_forces, such as [20, 40, 60] (in N).")
    if design.loop.wrap_angles and not design.loop.input_forces:
        raise DescriptionError(f"{file}, design.loop: wrap_angles need input_forces, such as [5, 10, 20] (in N).")
    elastic = ElasticDesign(
        tuple(sorted(design.stretch.loads)),
        _radians(design.stretch.wrap_angles),
        design.stretch.unloading,
        _radians(design.preload.wrap_angles),
        _radians(design.loop.wrap_angles),
        design.loop.input_forces,
        tuple(_STROKES[stroke] for stroke in design.loop.strokes),
        _radians(design.loop.free_motion),
    )
    strokes = tuple(_STROKES[stroke] for stroke in design.strokes)
    return Design(design.angles, design.efficiencies, design.runs, design.input_forces, strokes, elastic=elastic)


def _radians(degrees: Sequence[float]) -> tuple[float, ...]:
    return tuple(float(angle) for angle in np.deg2rad(degrees))


def table_pages(description: Description, measured: Measurements) -> dict[str, Page]:
    """Headings and rows of every table, by file name."""
    return dict(_pages(description, measured))


def _pages(description: Description, measured: Measurements) -> Iterator[tuple[str, Page]]:
    tables, route = description.tables, description.route
    heading = [f"{route.variable}_{route.unit}"] if route else []
    if tables.angles and measured.angles:
        yield tables.angles.file or "angles.csv", _angles(measured.angles, heading)
    if tables.efficiencies and measured.efficiencies:
        yield tables.efficiencies.file or "efficiencies.csv", _efficiencies(measured.efficiencies, heading)
    if tables.forces and measured.forces:
        yield str(tables.forces.file or "forces.csv"), _forces(measured.forces, heading)
    if tables.stretch and measured.stretch:
        yield tables.stretch.file or "stretch.csv", _stretch(measured.stretch)
    if tables.preload and measured.preload:
        yield tables.preload.file or "preload.csv", _preload(measured.preload)
    if tables.loop and measured.loop:
        yield tables.loop.file or "loop.csv", _loop(description, measured.loop)


def _angles(table: AngleTable, heading: list[str]) -> Page:
    shown, limits = np.rad2deg(table.angle), np.rad2deg(table.limit)
    cells = [
        [f"<{limits[i, k]:g}" if np.isnan(angle) else f"{angle:.1f}" for k, angle in enumerate(row)]
        for i, row in enumerate(shown)
    ]
    rows = [[f"{length:g}", *row] for length, row in zip(table.route, cells, strict=True)]
    return [*(heading or [""]), *(f"{name}_deg" for name in table.names)], rows


def _efficiencies(table: EfficiencyTable, heading: list[str]) -> Page:
    values = zip(table.route, table.efficiency, strict=True)
    return [*heading, "efficiency"], [[*_placed(length, heading), f"{eta:.5f}"] for length, eta in values]


def _placed(route: float, heading: list[str]) -> list[str]:
    return [f"{route:g}"] if heading else []


def _forces(table: ForceTable, heading: list[str]) -> Page:
    rows = [
        [
            *_placed(table.route[i], heading),
            table.run_names[table.run[i]],
            _STROKE_NAMES[int(table.stroke[i])],
            f"{table.input_force[i]:.3f}",
            f"{table.output_force[i]:.3f}",
        ]
        for i in range(len(table.run))
    ]
    return [*heading, "run", "stroke", "input_force_N", "output_force_N"], rows


def _stretch(table: StretchTable) -> Page:
    branch = np.where(table.unloading, "unload", "load")
    columns = zip(np.rad2deg(table.wrap_angle), branch, table.load, table.stretch, strict=True)
    rows = [[f"{angle:.6g}", way, f"{load:g}", f"{stretch:.4f}"] for angle, way, load, stretch in columns]
    return ["wrap_angle_deg", "branch", "load_N", "stretch_mm"], rows


def _preload(table: PreloadTable) -> Page:
    columns = zip(np.rad2deg(table.wrap_angle), table.preload, strict=True)
    return ["wrap_angle_deg", "preload_N"], [[f"{angle:.6g}", f"{preload:.3f}"] for angle, preload in columns]


def _loop(description: Description, table: LoopTable) -> Page:
    """As torques where both pulleys' radii are stated."""
    cable, names = description.cable, table.own.names
    radii = [radius.to("length") / 1000 for radius in (cable.input_pulley_radius, cable.output_pulley_radius) if radius]
    what, (first, second), digits = ("force_N", (1.0, 1.0), 3) if len(radii) < 2 else ("torque_N_m", radii, 5)
    rows = [
        [
            *(f"{angle:.6g}" for angle in np.rad2deg(table.own.angle[i])),
            _STROKE_NAMES[int(table.stroke[i])],
            f"{first * table.input_force[i]:.{digits}f}",
            f"{second * table.output_force[i]:.{digits}f}",
        ]
        for i in range(len(table.stroke))
    ]
    return [*(f"{name}_deg" for name in names), "stroke", f"input_{what}", f"output_{what}"], rows
