"""What a simulated bench measures ([design] of a plan): every kind says what it reads of it, and `designs` joins them."""

from collections.abc import Sequence
from typing import Literal

import numpy as np

from bowdenfit.description import Description
from bowdenfit.description.values import Frozen
from bowdenfit.kinds.pages import STROKE_NAMES
from bowdenfit.types import Vector

Stroke = Literal["pull", "return"]
_SIGNS = {name: sign for sign, name in STROKE_NAMES.items()}


class Design(Frozen):
    """What a kind reads of [design], as written; a whole design is that of every kind at once."""

    def contradiction(self, description: Description) -> str:
        """What of it a cable cannot have, in a sentence; empty if it can have all."""
        del description
        return ""


def signs(strokes: Sequence[Stroke]) -> list[int]:
    """+1 for each pull, -1 for each return."""
    return [_SIGNS[stroke] for stroke in strokes]


def radians(degrees: Sequence[float]) -> Vector:
    """Wrap angles as tables have them."""
    return np.deg2rad(np.array(degrees, dtype=float))
