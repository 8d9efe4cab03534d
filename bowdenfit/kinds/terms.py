"""Every kind's half in the likelihood, by the names of KINDS; what the kinds of a data set ask for together."""

from collections.abc import Iterator
from typing import Any

from bowdenfit.cable.cable import ANGLE_NOISE, Cable
from bowdenfit.cable.elasticity import (
    BEDDING_LOAD,
    BEDDING_STRETCH,
    LENGTHENING,
    STIFFNESS,
    STRETCH_FRICTION,
    STRETCH_ZERO,
)
from bowdenfit.cable.elasticity import PRELOAD as REFERENCE_PRELOAD
from bowdenfit.cable.load_cells import (
    BLOCK_NOISE,
    DELAY_ERROR,
    FORCE_NOISE,
    GAIN_ERROR,
    INPUT_OFFSET,
    OUTPUT_OFFSET,
    RUN_SCATTER,
)
from bowdenfit.kinds import each_table, kind_of
from bowdenfit.kinds.angles.term import AngleTerms
from bowdenfit.kinds.candidate import CandidateKind
from bowdenfit.kinds.displacement.term import DisplacementTerms
from bowdenfit.kinds.efficiencies.term import EfficiencyTerms
from bowdenfit.kinds.forces.term import ForceTerms
from bowdenfit.kinds.loop.term import LOOP_MOUNTING, LoopTerms
from bowdenfit.kinds.measurements import Measurements
from bowdenfit.kinds.preload.term import PRELOAD_NOISE, PreloadTerms
from bowdenfit.kinds.recordings.term import RecordingTerms
from bowdenfit.kinds.ringdown.term import RingDownTerms
from bowdenfit.kinds.shared_parameters import gain_error
from bowdenfit.kinds.stretch.term import STRETCH_NOISE, StretchTerms
from bowdenfit.kinds.term import Circumstances, TermKind
from bowdenfit.parameters.space import Parameter

_ALL: tuple[TermKind[Any], ...] = (
    AngleTerms(),
    EfficiencyTerms(),
    ForceTerms(),
    RecordingTerms(),
    StretchTerms(),
    PreloadTerms(),
    LoopTerms(),
    DisplacementTerms(),
    RingDownTerms(),
)

TERMS: dict[str, TermKind[Any]] = {kind.name: kind for kind in _ALL}
"""What each kind adds to the likelihood."""

_ORDER = (
    *(STIFFNESS, BEDDING_STRETCH, BEDDING_LOAD, LENGTHENING, STRETCH_ZERO, STRETCH_FRICTION, REFERENCE_PRELOAD),
    *(LOOP_MOUNTING, ANGLE_NOISE, RUN_SCATTER, FORCE_NOISE, BLOCK_NOISE, STRETCH_NOISE, PRELOAD_NOISE),
    *(GAIN_ERROR, INPUT_OFFSET, OUTPUT_OFFSET, DELAY_ERROR),
)  # in z, which what a seed draws depends on; those of other kinds come after these


def measured_kinds(measurements: Measurements) -> Iterator[tuple[TermKind[Any], Any]]:
    """Every table with what its kind adds to the likelihood, in the order of the kinds."""
    for kind, table in each_table(measurements):
        yield TERMS[kind.name], table


def parameters_asked_for(cable: Cable, measurements: Measurements) -> list[Parameter]:
    """The parameters that the kinds of a data set ask for, each declared once."""
    kinds = list(measured_kinds(measurements))
    circumstances = Circumstances(cable, measurements, any(kind.tells_mountings for kind, _ in kinds))
    needed = {p.name: p for kind, table in kinds for p in kind.parameters(table, circumstances)}
    needed |= {p.name: p for p in gain_error(cable.description)}
    return sorted(needed.values(), key=lambda p: _ORDER.index(p.name) if p.name in _ORDER else len(_ORDER))


def candidate_kinds() -> dict[str, CandidateKind]:
    """What can be measured next, by its name."""
    kinds = (kind.candidate for kind in TERMS.values() if kind.candidate is not None)
    return {candidate.name: candidate for candidate in sorted(kinds, key=lambda candidate: candidate.order)}


def term_kind(readings: str) -> TermKind[Any]:
    """The kind whose readings have a name in results.

    Raises:
        KeyError: None has.
    """
    kind = kind_of(readings)
    return TERMS[kind.name if kind is not None else readings]
