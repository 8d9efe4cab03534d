"""A kind's half in the likelihood: what a term is, and what a kind declares of its terms."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol, runtime_checkable

import numpy as np
from jax import Array

from bowdenfit.cable.cable import Cable
from bowdenfit.cable.noise import NoiseLaw, noise_law
from bowdenfit.description import Description, PriorDefaults
from bowdenfit.kinds.angles.table import AngleTable
from bowdenfit.kinds.bench import Remeasurement
from bowdenfit.kinds.candidate import CandidateKind
from bowdenfit.kinds.measurements import Measurements
from bowdenfit.parameters.space import Parameter, ParameterSpace


@runtime_checkable
class Term(Protocol):
    """One table against one cable: what inference, predictions and reports need of it.

    It may also have `depends_on_conditions`: whether its functions depend on `cable.friction.conditions`. Where it is False,
    one compiled program serves data sets that were measured at different loads and speeds; without it they have one each.
    """

    @property
    def cable(self) -> Cable:
        """The cable."""
        ...

    @property
    def data(self) -> dict[str, Any]:
        """Arrays that its functions take."""
        ...

    @property
    def labels(self) -> tuple[str, ...]:
        """Each reading in words."""
        ...

    @property
    def name(self) -> str:
        """Name of its readings in results."""
        ...

    @property
    def unit(self) -> str:
        """Unit of its readings in results."""
        ...

    @property
    def noise(self) -> str:
        """The noise scale that its residuals are standardized by."""
        ...

    @property
    def residual_blocks(self) -> tuple[tuple[int, int], ...]:
        """Its residuals by what makes them scatter, in order: how many there are, how many of them vary independently."""
        ...

    def log_likelihood(self, values: Mapping[str, Array], data: Mapping[str, Any]) -> Array:
        """Log likelihood of each reading."""
        ...

    def residuals(self, values: Mapping[str, Array], data: Mapping[str, Any]) -> Array:
        """Standardized residuals of the same likelihood."""
        ...

    def expected(self, values: Mapping[str, Array], data: Mapping[str, Any]) -> Array:
        """Expected readings in the term's unit."""
        ...

    def simulate(self, values: Mapping[str, Array], data: Mapping[str, Any], key: Array) -> Array:
        """Readings drawn at given parameters, in the term's unit."""
        ...

    def observed(self) -> np.ndarray:
        """Readings in the term's unit."""
        ...


@dataclass(frozen=True)
class Circumstances:
    """What a kind looks at when it says which parameters it needs.

    Args:
        cable: The cable.
        measurements: Everything measured on it.
        mountings_scatter: Whether readings of any kind tell how mountings scatter.
        defaults: Priors of what the user says nothing of.
    """

    cable: Cable
    measurements: Measurements
    mountings_scatter: bool
    defaults: PriorDefaults = field(default_factory=PriorDefaults)

    @property
    def description(self) -> Description:
        """What was said about the cable."""
        return self.cable.description

    @property
    def noise(self) -> NoiseLaw:
        """How readings scatter."""
        return noise_law(self.cable.description)


LOAD, WRAP_ANGLE, GROUP = "Load (N)", "Wrap angle (deg)", "Group"  # labels of places


def what_was_read(term: Term, description: Description) -> np.ndarray:
    """The readings, and of how many samples each was made."""
    del description
    return np.column_stack([term.observed(), term.data["n"]] if "n" in term.data else [term.observed()])


def why_not_alike(name: str, descriptions: Mapping[str, Description]) -> str:
    """That other readings are missing somewhere."""
    del name, descriptions
    return "the others are not in all fits"


@dataclass(frozen=True)
class Events:
    """Which events readings are: models can be compared only by how well they predict the same ones.

    Args:
        said: Of each reading of a term, numbers that are the same wherever it is the same event; NaN where it is a limit
            alone.
        why_not_alike: Why readings of a name are not the same events under several descriptions, by the names of the fits.
        choice: What sets a description apart from others of the same files; empty where it is as usual.
        chosen: Whether descriptions choose which rows are readings.
    """

    said: Callable[[Term, Description], np.ndarray] = what_was_read
    why_not_alike: Callable[[str, Mapping[str, Description]], str] = why_not_alike
    choice: Callable[[Description], str] = lambda _: ""
    chosen: bool = False


@dataclass(frozen=True)
class TermKind:
    """What a kind of measurement adds to the likelihood.

    Args:
        name: What it is called in KINDS.
        terms: Terms of a table against a cable; wrap angles that were measured hold outside the range of the curves.
        parameters: The parameters that they need, those that other kinds share included.
        bench: How such a table is measured again on the computer.
        candidate: The measurement that could be made next for such a table; None where another kind offers it.
        tells_mountings: Whether its readings tell how mountings scatter.
        check: Whether parameters that the user fixed leave the table a model.
        count: How many readings of a term entered, in words; empty where they are those that were read.
        where: Loads and wrap angles of a term's readings, by axis label.
        back: Which rows were read on the way back, or while unloading; None where none was.
        events: Which events they are.
    """

    name: str
    terms: Callable[[Cable, Any, AngleTable | None], Sequence[Term]]
    parameters: Callable[[Any, Circumstances], list[Parameter]]
    bench: Remeasurement
    candidate: CandidateKind | None = None
    tells_mountings: bool = False
    check: Callable[[Any, ParameterSpace], None] = lambda *_: None
    count: Callable[[Term, Description], str] = lambda *_: ""
    where: Callable[[Any, Term], Mapping[str, np.ndarray]] = lambda *_: {}
    back: Callable[[Any], np.ndarray] | None = None
    events: Events = field(default_factory=Events)
