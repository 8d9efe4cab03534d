"""What a plan says is measured ([design]), and simulated tables as the rows of their files."""

from collections.abc import Mapping, Sequence
from typing import Any, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from bowdenfit.description import Description
from bowdenfit.errors import DescriptionError
from bowdenfit.kinds import each_table
from bowdenfit.kinds.elastic_simulation import ElasticDesign
from bowdenfit.kinds.kind import Page
from bowdenfit.kinds.measurements import Measurements
from bowdenfit.questions.simulate.simulation import Design

Stroke = Literal["pull", "return"]
_STROKES: Mapping[str, int] = {"pull": 1, "return": -1}


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
    pages = {}
    for kind, table in each_table(measured):
        settings = getattr(description.tables, kind.name, None)
        if settings and kind.page:
            pages[settings.file or f"{kind.name}.csv"] = kind.page(table, description)
    return pages
