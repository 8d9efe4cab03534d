"""What a simulated bench measures of each kind ([design] of a plan)."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from bowdenfit.errors import DescriptionError

Stroke = Literal["pull", "return"]
_STROKES: Mapping[str, int] = {"pull": 1, "return": -1}


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


@dataclass(frozen=True)
class Design:
    """What is measured: at which lengths, and for forces at which input forces.

    Args:
        angles: Route values at which wrap angles are read.
        efficiencies: Route values at which an efficiency is measured.
        runs: Route value of each force run.
        input_forces: Input forces of every stroke of a run [N].
        strokes: +1 pulling, -1 return, in order.
        own_angles: Wrap angle of each run [rad], by column of a contact without a curve.
        elastic: What is measured of stretch, preload and a loop.
    """

    angles: tuple[float, ...] = ()
    efficiencies: tuple[float, ...] = ()
    runs: tuple[float, ...] = ()
    input_forces: tuple[float, ...] = ()
    strokes: tuple[int, ...] = (1, -1)
    own_angles: Mapping[str, tuple[float, ...]] | None = None
    elastic: ElasticDesign = field(default_factory=ElasticDesign)


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
