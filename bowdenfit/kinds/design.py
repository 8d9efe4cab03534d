"""What a simulated bench measures ([design] of a plan): each `PlannedKind` declares its part, and `designs` joins them."""

from collections.abc import Sequence
from typing import Literal

import numpy as np

from bowdenfit.description.values import Frozen
from bowdenfit.kinds.pages import STROKE_NAMES
from bowdenfit.types import Vector

Stroke = Literal["pull", "return"]
_SIGNS = {name: sign for sign, name in STROKE_NAMES.items()}


class Design(Frozen):
    """What a kind reads of [design], as written; a whole design has the fields of every kind."""


def signs(strokes: Sequence[Stroke]) -> list[int]:
    """+1 for each pull, -1 for each return."""
    return [_SIGNS[stroke] for stroke in strokes]


def radians(degrees: Sequence[float]) -> Vector:
    """Wrap angles as tables have them."""
    return np.deg2rad(np.array(degrees, dtype=float))
