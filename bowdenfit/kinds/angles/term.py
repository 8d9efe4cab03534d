"""Angle tables in the likelihood: readings about their curve, and angles too small to detect as censored."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import ClassVar

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float
from typing_extensions import override

from bowdenfit.cable.cable import ANGLE_NOISE, CableContacts
from bowdenfit.cable.sensors import noise_law, scatter
from bowdenfit.description import Description
from bowdenfit.errors import DatasetError
from bowdenfit.kinds.candidate import Candidate, CandidateKind, Simulation, Situation
from bowdenfit.kinds.tables import AngleSettings, AngleTable
from bowdenfit.kinds.term import (
    Circumstances,
    Term,
    TermKind,
    Truth,
    deviations_of_bounds,
    deviations_of_readings,
    join_contributions,
)
from bowdenfit.parameters.priors import HalfCauchy
from bowdenfit.parameters.space import Parameter
from bowdenfit.types import DataArray


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class AnglesData:
    """Arrays of an angle table.

    Args:
        route: Route values of each curve's readings, by column, (readings of the curve).
        order: Order that puts detected readings first, (readings).
        angle: Detected angles [rad], (detected); NaN where there is none.
        limit: Limits of undetected angles [rad], (undetected); NaN where there is none.
    """

    route: dict[str, DataArray]
    order: DataArray
    angle: DataArray
    limit: DataArray


@dataclass(frozen=True)
class AnglesTerm:
    r"""Likelihood of an angle table.

    Detected angles are :math:`\text{Normal}(\theta(l), \sigma_\theta)`; one below the detection limit L contributes
    :math:`\Phi((L - \theta(l)) / \sigma_\theta)`. With Student noise both are a Student-t's of the same scale. Readings
    outside the range of the curves do not enter.

    Args:
        cable: The cable.
        data: Its arrays.
        labels: Each reading in words, detected ones first.
    """

    cable: CableContacts = field(repr=False)
    data: AnglesData = field(repr=False)
    labels: tuple[str, ...] = field(repr=False)
    name: str = "wrap_angle"
    unit: str = "deg"
    noise: str = ANGLE_NOISE
    depends_on_conditions: ClassVar[bool] = False  # see `Term`

    @property
    def residual_blocks(self) -> tuple[tuple[int, int], ...]:
        """One block: all readings scatter alike."""
        return ((len(self.labels), len(self.labels)),)

    @property
    def padded(self) -> AnglesData:
        """See `LogDensity.padded`: every reading in its own place, as one that was detected and as one that was not."""
        order, detected = self.data.order, len(self.data.angle)
        angle, limit = np.full((2, len(order)), np.nan)
        angle[order[:detected]], limit[order[detected:]] = self.data.angle, self.data.limit
        return replace(self.data, order=np.arange(len(order)), angle=angle, limit=limit)

    def _expected(self, values: Mapping[str, Array], data: AnglesData) -> Float[Array, " readings"]:
        curves = self.cable.curves
        parts = [curve.wrap_angle(values, data.route[column]) for column, curve in curves.items()]
        return jnp.concatenate(parts)[data.order]

    def _deviations(
        self, values: Mapping[str, Array], data: AnglesData
    ) -> tuple[Float[Array, " detected"], Float[Array, " undetected"]]:
        """Return standardized deviations of the detected readings, and of the limits of the undetected ones."""
        theta, sigma = self._expected(values, data), values[ANGLE_NOISE]
        return deviations_of_readings(data.angle, theta) / sigma, deviations_of_bounds(data.limit, theta) / sigma

    def log_likelihood(self, values: Mapping[str, Array], data: AnglesData) -> Float[Array, " readings"]:
        """Log likelihood of each reading."""
        (deviation, u), law = self._deviations(values, data), noise_law(self.cable.description)
        read = law.log_density(deviation) - jnp.log(values[ANGLE_NOISE])
        return join_contributions((data.angle, read), (data.limit, law.log_cdf(u)))

    def residuals(self, values: Mapping[str, Array], data: AnglesData) -> Float[Array, " readings"]:
        """Standardized residuals; sqrt(-2 log likelihood) for undetected angles."""
        (deviation, u), law = self._deviations(values, data), noise_law(self.cable.description)
        return join_contributions((data.angle, law.residual(deviation)), (data.limit, law.bound_residual(u)))

    def expected(self, values: Mapping[str, Array], data: AnglesData) -> Float[Array, " readings"]:
        """Expected readings [deg]."""
        return jnp.rad2deg(self._expected(values, data))

    def simulate(self, values: Mapping[str, Array], data: AnglesData, key: Array) -> Float[Array, " readings"]:
        """Readings as the bench would give them, undetected ones included [deg]."""
        theta = self._expected(values, data)
        return jnp.rad2deg(theta + values[ANGLE_NOISE] * scatter(key, theta.shape, self.cable.description))

    def observed(self) -> np.ndarray:
        """Readings [deg]; NaN where undetected."""
        return np.rad2deg(np.concatenate([self.data.angle, np.full(len(self.data.limit), np.nan)]))


def make_angles_term(cable: CableContacts, table: AngleTable) -> AnglesTerm:
    """Return the term of an angle table, with undetected angles entering as the description says."""
    description = cable.description
    settings, route, published = (
        description.table(AngleSettings),
        description.route,
        description.geometry == "published",
    )
    assert settings is not None and route is not None  # an angle table is read only with both
    readings: list[tuple[float, float, str]] = []
    routes: dict[str, np.ndarray] = {}
    for contact in description.curved:
        column = contact.wrap_angle.column or ""
        low, high = (contact.wrap_angle.published_range if published else None) or route.range
        how = "zero" if published else settings.undetected
        angle, limit = table.column(column)
        used = (table.route >= low) & (table.route <= high) & ((how != "dropped") | np.isfinite(angle))
        routes[column] = table.route[used]
        for length, reading, at_most in zip(table.route[used], angle[used], limit[used], strict=True):
            shown = 0.0 if how == "zero" and np.isnan(reading) else reading
            readings.append((shown, at_most, f"{column} at {length:g} {route.unit}"))
    detected = np.array([np.isfinite(reading) for reading, _, _ in readings], dtype=bool)
    order = np.concatenate([np.flatnonzero(detected), np.flatnonzero(~detected)])
    angles, limits = ([readings[i][k] for i in part] for k, part in enumerate(np.split(order, [detected.sum()])))
    data = AnglesData(routes, order, np.array(angles), np.array(limits))
    return AnglesTerm(cable, data, tuple(readings[i][2] for i in order))


def draw_angles(table: AngleTable, truth: Truth, everywhere: bool = False) -> dict[str, Array]:
    """Draw wrap angles and detection limits of an angle table [rad].

    Args:
        table: The table.
        truth: True values and random key.
        everywhere: Whether rows outside the range of the curves are drawn too; else they are kept.
    """
    cable, key, route = truth.cable, jax.random.split(truth.key, 3)[0], jnp.asarray(table.route)
    theta = jnp.stack([curve.wrap_angle(truth.values, route) for curve in cable.curves.values()], axis=-1)
    reading = theta + truth.scale * truth.values[ANGLE_NOISE] * truth.scatter(key, theta.shape)
    limit = detection_limit(cable.description, table)
    low, high = cable.description.route.range if cable.description.route else (-np.inf, np.inf)
    retained = np.zeros(len(table.route), dtype=bool) if everywhere else (table.route < low) | (table.route > high)
    undetected = reading < limit
    angle = jnp.where(undetected, jnp.nan, jnp.maximum(reading, 0.0))
    return {
        "angle": jnp.where(retained[:, None], table.angle, angle),
        "limit": jnp.where(retained[:, None], table.limit, jnp.where(undetected, limit, jnp.nan)),
    }


def detection_limit(description: Description, table: AngleTable) -> float:
    """Return the angle below which nothing is detected [rad]: that of the description, or the one in the table's cells.

    Raises:
        DatasetError: The cells name several, so that it is not known which one holds where an angle was detected.
    """
    settings = description.table(AngleSettings)
    if settings is not None and settings.detection_limit is not None:
        return settings.detection_limit.to("angle")
    limits = np.unique(table.limit[np.isfinite(table.limit)])
    if len(limits) > 1:
        shown = " and ".join(f"<{limit:.3g}" for limit in np.rad2deg(limits[:2]))
        raise DatasetError(
            f"{table.origin.files[0]} has cells with different detection limits ({shown} deg), so that it is not known what "
            "would be detected in the other cells; state detection_limit for the table in cable.toml."
        )
    return float(limits[0]) if len(limits) else -np.inf


def _treatment_of_undetected(description: Description) -> str:
    """Return how angles too small to detect enter: "censored", "zero" or "dropped"."""
    settings = description.table(AngleSettings)
    if description.geometry == "published":
        return "zero"
    return settings.undetected if settings is not None else "censored"


class AngleCandidates(CandidateKind):
    """The wrap angles of all curved contacts at a length."""

    name = "angle"
    order = 0
    needs = (ANGLE_NOISE,)
    unknown = "no contact of this cable has a curve that an angle could determine."
    along_route = True
    angles = "none"
    measures_curves = True
    heading = "Wrap angles"

    @override
    def is_possible(self, at: Situation) -> bool:
        return bool(at.cable.curves)

    @override
    def describe_measurement(self, cable: CableContacts) -> str:
        return "the wrap angles" if len(cable.curves) > 1 else "the wrap angle"

    @override
    def candidates(self, at: Situation) -> list[Candidate]:
        return [Candidate(self.name, length) for length in at.lengths] if at.angles is not None else []

    @override
    def simulation(self, at: Situation, candidates: Sequence[Candidate]) -> Simulation:
        """Return how the angles would be read; what is below the detection limit is not detected."""
        columns, settings = tuple(at.cable.curves), at.cable.description.table(AngleSettings)
        route, _, origin = at.rows(candidates)
        shape = (len(candidates), len(columns))
        table = AngleTable(route, columns, np.full(shape, np.deg2rad(30)), np.full(shape, np.nan), origin)
        term = make_angles_term(at.cable, table)
        # Every row is detected, so readings are curve by curve; a curve may hold over a part of the range only.
        read_at = np.concatenate([term.data.route[column] for column in columns])
        limit = settings.detection_limit.to("angle") if settings and settings.detection_limit else 0.0
        readings = [tuple(int(k) for k in np.flatnonzero(read_at == length)) for length in route]
        return Simulation(term.simulate, term.data, readings, float(np.rad2deg(limit)))


class AngleTerms(TermKind[AngleTable]):
    """Angle tables in the likelihood."""

    name = "angles"
    candidate = AngleCandidates()
    chooses_rows = True

    @override
    def terms(self, cable: CableContacts, table: AngleTable, angles: AngleTable | None) -> tuple[AnglesTerm]:
        return (make_angles_term(cable, table),)

    @override
    def parameters(self, table: AngleTable, at: Circumstances) -> list[Parameter]:
        """Return the parameters of every curve, with priors by the angles inside its range, and the noise of an angle."""
        route, degree, sd = at.description.route, float(np.rad2deg(1.0)), at.defaults.angle_noise_degrees
        assert route is not None  # an angle table is read only with one
        inside = (table.route >= route.range[0]) & (table.route <= route.range[1])
        read = {column: table.column(column)[0] for column in at.cable.curves}
        detected = {column: angle[np.isfinite(angle) & inside] for column, angle in read.items()}
        by_column = at.cable.curves.items()
        curves = [
            *(p for column, curve in by_column for p in curve.parameters(detected[column], at.defaults)),
            *(p for column, curve in by_column for p in curve.departure_parameters(detected[column], at.defaults)),
        ]
        noise = Parameter(
            ANGLE_NOISE, r"$\sigma_\theta$", at.noise.meaning("standard deviation of an angle reading"), "noise",
            HalfCauchy(sd / degree), "deg", degree,
        )  # fmt: skip
        return [*curves, noise]

    @override
    def draw(self, table: AngleTable, truth: Truth) -> dict[str, Array]:
        return draw_angles(table, truth)

    @override
    def check_drawable(self, description: Description, table: AngleTable) -> None:
        """Refuse cells with several detection limits; see `detection_limit`."""
        detection_limit(description, table)

    @override
    def count_readings(self, term: Term, description: Description) -> str:
        """Return how many readings the curves were fitted to, and how those too small to detect entered."""
        entered, censored = len(term.data.angle), len(term.data.limit)
        how = {
            "censored": "",
            "zero": ", those too small to detect taken as 0",
            "dropped": ", those too small to detect left out",
        }
        if censored:
            return f"{entered} wrap angles and {censored} too small to detect (known to be below the limit)"
        return f"{entered} wrap angles{how[_treatment_of_undetected(description)]}"

    @override
    def why_events_differ(self, readings: str, descriptions: Mapping[str, Description]) -> str:
        how = {"censored": "below the limit", "zero": "zeros", "dropped": "dropped"}
        ways = [
            f"{name}: {'zeros, in the published regions' if d.geometry == 'published' else how[_treatment_of_undetected(d)]}"
            for name, d in descriptions.items()
        ]
        return (
            "angles too small to detect, and angles where a curve does not hold, are not the same readings in all fits "
            f"({', '.join(ways)})"
        )

    @override
    def describe_choice(self, description: Description) -> str:
        if description.geometry == "published":
            return ""
        words = {"censored": "", "zero": "undetected angles as zeros", "dropped": "undetected angles dropped"}
        return words[_treatment_of_undetected(description)]
