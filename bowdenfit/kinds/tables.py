"""The classes of all tables, until everything imports them from their kinds."""

from bowdenfit.kinds.angles.table import AngleTable
from bowdenfit.kinds.efficiencies.table import EfficiencyTable
from bowdenfit.kinds.forces.table import ForceTable
from bowdenfit.kinds.loop.table import LoopTable
from bowdenfit.kinds.preload.table import PreloadTable
from bowdenfit.kinds.rows import OwnAngles, Provenance
from bowdenfit.kinds.stretch.table import StretchTable

__all__ = [
    "AngleTable",
    "EfficiencyTable",
    "ForceTable",
    "LoopTable",
    "OwnAngles",
    "PreloadTable",
    "Provenance",
    "StretchTable",
]
