"""A kind's half in the likelihood, in JAX: `Term`, `TermKind`, and the simplest term.

Beside its `Kind` (`kinds/kind.py`, NumPy) every kind has a `TermKind`, `kinds/<kind>/term.py`, and one line in `TERMS`
(`kinds/terms.py`). It must give four things:

- `name`: that of the kind;
- `terms`: the terms of a table against a cable; mostly one;
- `parameters`: the parameters that they need;
- `draw`: the same table measured again on the computer.

What else `TermKind` has is optional. A kind whose next reading can be ranked by `bowdenfit next` gives a `CandidateKind` too
(`kinds/candidate.py`). The simplest term is a subclass of `IndependentReadings`, whose readings scatter alike.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Generic, Protocol, TypeVar, runtime_checkable

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

from bowdenfit.cable.cable import CableContacts
from bowdenfit.cable.sensors import NoiseLaw, noise_law, scatter
from bowdenfit.description import Description, PriorDefaults
from bowdenfit.kinds.candidate import CandidateKind
from bowdenfit.kinds.row_angles import RowAngles, collect_row_angles, resolve_angles
from bowdenfit.kinds.rows import ForceRows, UnusedColumn
from bowdenfit.kinds.tables import AngleTable, Measurements
from bowdenfit.parameters.space import Parameter, ParameterSpace

AnyTable = TypeVar("AnyTable")
Data = TypeVar("Data")
_FEWEST_SPARE = 16  # rows for which a program with room for more is compiled at least; a judgement
LOAD, WRAP_ANGLE, GROUP = "Load (N)", "Wrap angle (deg)", "Group"  # labels of covariates


@runtime_checkable
class Term(Protocol):
    """One table against one cable: what inference, predictions and reports need of it.

    It may also have `depends_on_conditions`: whether its functions depend on `cable.friction.conditions`. Where it is False,
    one compiled program serves data sets that were measured at different loads and speeds; without it they have one each.
    And `is_slow`: whether one log likelihood takes milliseconds, because it follows a recording through thousands of steps.
    """

    @property
    def cable(self) -> CableContacts:
        """The cable."""
        ...

    @property
    def data(self) -> Any:
        """Arrays that its functions take: a dataclass that JAX knows as a tree.

        See `find_row_angles`. An array `counts` says which readings count in the log density; all
        where there is none.
        """
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
        """Name of the noise scale by which its residuals are standardized."""
        ...

    @property
    def residual_blocks(self) -> tuple[tuple[int, int], ...]:
        """Its residuals by what makes them scatter, in order: how many there are, how many of them vary independently."""
        ...

    def log_likelihood(self, values: Mapping[str, Array], data: Any) -> Array:
        """Log likelihood of each reading."""
        ...

    def residuals(self, values: Mapping[str, Array], data: Any) -> Array:
        """Standardized residuals of the same likelihood."""
        ...

    def expected(self, values: Mapping[str, Array], data: Any) -> Array:
        """Expected readings in the term's unit."""
        ...

    def simulate(self, values: Mapping[str, Array], data: Any, key: Array) -> Array:
        """Readings drawn at given parameters, in the term's unit."""
        ...

    def observed(self) -> np.ndarray:
        """Readings in the term's unit."""
        ...


@dataclass(frozen=True)
class Circumstances:
    """Cable, measurements and defaults by which a kind decides which parameters it needs.

    Args:
        cable: The cable.
        measurements: Everything measured on it.
        mountings_scatter: Whether readings of any kind show the scatter of mountings.
        defaults: Priors of what the user says nothing of.
    """

    cable: CableContacts
    measurements: Measurements
    mountings_scatter: bool
    defaults: PriorDefaults = field(default_factory=PriorDefaults)

    @property
    def description(self) -> Description:
        """Description of the cable."""
        return self.cable.description

    @property
    def noise(self) -> NoiseLaw:
        """Law by which readings scatter."""
        return noise_law(self.cable.description)


@dataclass(frozen=True)
class Truth:
    """True values and random key with which tables are simulated anew.

    Args:
        cable: The cable.
        angles: Measured wrap angles, which hold outside the range of the curves.
        values: True values [internal units].
        key: Random key of the whole bench. A kind makes one of its own of it that no other uses, so that its readings do not
            depend on which other tables there are.
        scale: Factor on all noise.
    """

    cable: CableContacts
    angles: AngleTable | None
    values: Mapping[str, Array]
    key: Array
    scale: float = 1.0

    def scatter(self, key: Array, shape: tuple[int, ...]) -> Array:
        """Deviations of readings in units of their scale."""
        return scatter(key, shape, self.cable.description)

    def wrap_angles(self, rows: ForceRows) -> tuple[Array, Array]:
        """Wrap angle [rad] of each row and contact without its error, and the error's variance [rad^2]."""
        angles = collect_row_angles(self.cable.description, rows, self.angles)
        return resolve_angles(self.cable, self.values, jax.tree.map(jnp.asarray, angles))

    def simulate(self, term: Any, key: Array) -> Array:
        """Return readings drawn from a term whose `simulate` takes a factor on its noise.

        Args:
            term: The term, whose readings are those of its table in the same order.
            key: The kind's own key.
        """
        return term.simulate(self.values, jax.tree.map(jnp.asarray, term.data), key, self.scale)


class TermKind(ABC, Generic[AnyTable]):
    """A kind of measurement in the likelihood; what a subclass must give is abstract here.

    Attributes:
        candidate: The measurement that could be made next for such a table; None where another kind offers it.
        shows_mounting_scatter: Whether its readings show the scatter of mountings.
        chooses_rows: Whether descriptions choose which rows are readings.
    """

    candidate: CandidateKind | None = None
    shows_mounting_scatter: bool = False
    chooses_rows: bool = False

    @property
    @abstractmethod
    def name(self) -> str:
        """Name of the kind in KINDS."""

    @abstractmethod
    def terms(self, cable: CableContacts, table: AnyTable, angles: AngleTable | None) -> Sequence[Term]:
        """Return the terms of a table.

        Args:
            cable: The cable.
            table: The table.
            angles: Measured wrap angles, which hold outside the range of the curves.
        """

    @abstractmethod
    def parameters(self, table: AnyTable, at: Circumstances) -> list[Parameter]:
        """Return the parameters that the terms need, those that other kinds share included."""

    @abstractmethod
    def draw(self, table: AnyTable, truth: Truth) -> dict[str, Array]:
        """Draw new readings by name, as the likelihood takes readings to scatter; JAX compiles this function.

        An array called "slipped" says which readings a bench could not have taken as it says it did.
        """

    def with_readings(self, description: Description, table: AnyTable, readings: Mapping[str, np.ndarray]) -> AnyTable:
        """Return the table with the readings that `draw` gave; here they have the names of the table's fields."""
        changed: AnyTable = replace(table, **readings)  # type: ignore[type-var]
        return changed

    def check_drawable(self, description: Description, table: AnyTable) -> None:
        """Refuse a table that cannot be measured again.

        Raises:
            DatasetError: Says why.
        """

    def check(self, table: AnyTable, space: ParameterSpace) -> None:
        """Refuse parameters that the user fixed so that the table has no model.

        Raises:
            DescriptionError: Says which, and what to do.
        """

    def count_readings(self, term: Term, description: Description) -> str:
        """Return how many readings of a term entered, in words; empty where `Kind.count_readings` says it."""
        return ""

    def covariates(self, table: AnyTable, term: Term) -> Mapping[str, np.ndarray]:
        """Return loads, wrap angles and the like of a term's readings, by axis label."""
        return {}

    def unused_columns(self, table: AnyTable, term: Term) -> Mapping[str, UnusedColumn]:
        """Return what columns that the fit does not use say of a term's readings, by heading."""
        return {}

    def on_way_back(self, table: AnyTable) -> np.ndarray | None:
        """Return which readings were taken on the way back, or while unloading; None where none was."""
        return None

    def events(self, term: Term, description: Description) -> np.ndarray:
        """Return numbers for each reading that are equal wherever it is the same event; NaN where it is a limit alone.

        Models can be compared only by how well they predict the same events.
        """
        n = getattr(term.data, "n", None)
        return np.column_stack([term.observed()] if n is None else [term.observed(), n])

    def why_events_differ(self, readings: str, descriptions: Mapping[str, Description]) -> str:
        """Return why readings of a name are not the same events under several descriptions, by the names of the fits."""
        return "the others are not in all fits"

    def describe_choice(self, description: Description) -> str:
        """Return what sets a description apart from others of the same files; empty where it is as usual."""
        return ""


@dataclass(frozen=True)
class IndependentReadings(ABC):
    r"""Likelihood of readings that scatter alike about what the model expects of them.

    .. math:: y_i \sim \text{Normal}(f_i, \sigma)

    With Student noise the same mean and scale are a Student-t's. A subclass gives `name`, `unit`, `noise` (see `Term`) and
    `expected`, which is f.

    Args:
        cable: The cable.
        data: Arrays; `reading` holds the readings, and `expected` takes the others.
        labels: Each reading in words.
    """

    cable: CableContacts = field(repr=False)
    data: Any = field(repr=False)
    labels: tuple[str, ...] = field(repr=False)

    @property
    @abstractmethod
    def name(self) -> str:
        """Name of its readings in results."""

    @property
    @abstractmethod
    def unit(self) -> str:
        """Unit of its readings."""

    @property
    @abstractmethod
    def noise(self) -> str:
        """Parameter that is the standard deviation of a reading."""

    @abstractmethod
    def expected(self, values: Mapping[str, Array], data: Any) -> Float[Array, " rows"]:
        """Expected readings in the term's unit."""

    @property
    def residual_blocks(self) -> tuple[tuple[int, int], ...]:
        """All readings scatter alike."""
        return ((len(self.labels), len(self.labels)),)

    def log_likelihood(self, values: Mapping[str, Array], data: Any) -> Float[Array, " rows"]:
        """Log likelihood of each reading."""
        deviation = (data.reading - self.expected(values, data)) / values[self.noise]
        return noise_law(self.cable.description).log_density(deviation) - jnp.log(values[self.noise])

    def residuals(self, values: Mapping[str, Array], data: Any) -> Float[Array, " rows"]:
        """Standardized residuals; the noise follows the parameters but is not differentiated."""
        noise = jax.lax.stop_gradient(values[self.noise])
        return noise_law(self.cable.description).residual((data.reading - self.expected(values, data)) / noise)

    def simulate(
        self, values: Mapping[str, Array], data: Any, key: Array, scale: float = 1.0
    ) -> Float[Array, " rows"]:
        """Readings drawn at given parameters, with their noise times `scale`."""
        expected = self.expected(values, data)
        return expected + scale * values[self.noise] * scatter(key, expected.shape, self.cable.description)

    def observed(self) -> np.ndarray:
        """Readings in the term's unit."""
        readings: np.ndarray = self.data.reading
        return readings


def find_row_angles(data: Any) -> RowAngles | None:
    """Return the wrap angles of a term's rows, cells or recordings; None where its data have none."""
    return getattr(getattr(data, "cells", data), "angles", None)


def deviations_of_readings(reading: Float[Array, " read"], expected: Float[Array, " rows"]) -> Float[Array, " read"]:
    """Return readings less what is expected of the first rows; 0 where there is no reading."""
    of_read = expected[: reading.shape[0]]
    return jnp.where(jnp.isnan(reading), 0.0, reading - of_read)


def deviations_of_bounds(bound: Float[Array, " bounds"], expected: Float[Array, " rows"]) -> Float[Array, " bounds"]:
    """Return bounds less what is expected of the last rows; 0 where there is no bound."""
    of_bounds = expected[expected.shape[0] - bound.shape[0] :]
    return jnp.where(jnp.isnan(bound), 0.0, bound - of_bounds)


def join_contributions(*parts: tuple[Array, Array]) -> Float[Array, " entries"]:
    """Concatenate the contributions of readings and bounds; 0 where there is none."""
    return jnp.concatenate([jnp.where(jnp.isnan(known), 0.0, contributed) for known, contributed in parts])


def repeat_rows(data: Data, rows: int, spare: int) -> Data:
    """Return arrays of rows followed by copies of them that do not count, by `counts`.

    Args:
        data: Arrays, one entry a row.
        rows: How many rows there are.
        spare: How many there are to be.
    """
    source = np.arange(spare) % rows
    repeated = jax.tree.map(lambda values: values[source], data)
    repeated_rows: Data = replace(repeated, counts=np.arange(spare) < rows)
    return repeated_rows


def spare_count(count: int) -> int:
    """Return a number of rows with room for more, which hardly ever changes: 16, and twice as many where they are full."""
    return max(_FEWEST_SPARE, 1 << (count - 1).bit_length())


def round_up_count(count: int) -> int:
    """Return the next of few counts: each up to eight, then four to every doubling, at most a quarter more than `count`."""
    step = 1 << max(0, (count - 1).bit_length() - 3)
    return -(-count // step) * step
