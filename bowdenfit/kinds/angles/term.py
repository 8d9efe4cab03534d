"""Angle tables: each reading against its curve; what was too small to detect enters as exactly that."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar

import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

from bowdenfit.cable.cable import ANGLE_NOISE, Cable
from bowdenfit.cable.noise import noise_law, scatter
from bowdenfit.kinds.angles.bench import detection_limit, drawn_angles
from bowdenfit.kinds.angles.table import AngleSettings, AngleTable
from bowdenfit.kinds.angles.undetected import EVENTS, count
from bowdenfit.kinds.bench import Remeasurement
from bowdenfit.kinds.bounds import first_less, joined, last_less
from bowdenfit.kinds.candidate import Candidate, CandidateKind, Simulation, Situation
from bowdenfit.kinds.term import Circumstances, TermKind
from bowdenfit.parameters.priors import HalfCauchy
from bowdenfit.parameters.space import Parameter


@dataclass(frozen=True)
class AnglesTerm:
    r"""Likelihood of an angle table.

    Detected angles are :math:`\text{Normal}(\theta(l), \sigma_\theta)`; one below the detection limit L contributes
    :math:`\Phi((L - \theta(l)) / \sigma_\theta)`. With Student noise both are a Student-t's of the same scale. Readings
    outside the range of the curves do not enter.

    Args:
        cable: The cable.
        data: Route values of each curve's readings; the order that puts detected readings first; detected angles and
            the limits of undetected ones [rad]. Where these are NaN there is none.
        labels: Each reading in words, detected ones first.
    """

    cable: Cable = field(repr=False)
    data: dict[str, Any] = field(repr=False)
    labels: tuple[str, ...] = field(repr=False)
    name: str = "wrap_angle"
    unit: str = "deg"
    noise: str = ANGLE_NOISE
    depends_on_conditions: ClassVar[bool] = False  # see `Term`

    @property
    def residual_blocks(self) -> tuple[tuple[int, int], ...]:
        """All readings scatter alike."""
        return ((len(self.labels), len(self.labels)),)

    @property
    def padded(self) -> dict[str, Any]:
        """See `LogDensity.padded`: every reading in its own place, as one that was detected and as one that was not."""
        order = self.data["order"]
        angle, limit = np.full((2, len(order)), np.nan)
        angle[order[: len(self.data["angle"])]] = self.data["angle"]
        limit[order[len(self.data["angle"]) :]] = self.data["limit"]
        return self.data | {"order": np.arange(len(order)), "angle": angle, "limit": limit}

    def _expected(self, values: Mapping[str, Array], data: Mapping[str, Any]) -> Float[Array, " readings"]:
        curves = self.cable.curves
        parts = [curve.wrap_angle(values, data["route"][column]) for column, curve in curves.items()]
        return jnp.concatenate(parts)[data["order"]]

    def _split(
        self, values: Mapping[str, Array], data: Mapping[str, Any]
    ) -> tuple[Float[Array, " detected"], Float[Array, " undetected"]]:
        """Standardized deviations: of the detected readings, and of the limits of the undetected ones."""
        theta, sigma = self._expected(values, data), values[ANGLE_NOISE]
        return first_less(data["angle"], theta) / sigma, last_less(data["limit"], theta) / sigma

    def log_likelihood(self, values: Mapping[str, Array], data: Mapping[str, Any]) -> Float[Array, " readings"]:
        """Log likelihood of each reading."""
        (deviation, u), law = self._split(values, data), noise_law(self.cable.description)
        read = law.log_density(deviation) - jnp.log(values[ANGLE_NOISE])
        return joined((data["angle"], read), (data["limit"], law.log_cdf(u)))

    def residuals(self, values: Mapping[str, Array], data: Mapping[str, Any]) -> Float[Array, " readings"]:
        """Standardized residuals; sqrt(-2 log likelihood) for undetected angles."""
        (deviation, u), law = self._split(values, data), noise_law(self.cable.description)
        return joined((data["angle"], law.residual(deviation)), (data["limit"], law.bound_residual(u)))

    def expected(self, values: Mapping[str, Array], data: Mapping[str, Any]) -> Float[Array, " readings"]:
        """Expected readings [deg]."""
        return jnp.rad2deg(self._expected(values, data))

    def simulate(self, values: Mapping[str, Array], data: Mapping[str, Any], key: Array) -> Float[Array, " readings"]:
        """Readings as the bench would give them, undetected ones included [deg]."""
        theta = self._expected(values, data)
        return jnp.rad2deg(theta + values[ANGLE_NOISE] * scatter(key, theta.shape, self.cable.description))

    def observed(self) -> np.ndarray:
        """Readings [deg]; NaN where undetected."""
        return np.rad2deg(np.concatenate([self.data["angle"], np.full(len(self.data["limit"]), np.nan)]))


def angles_term(cable: Cable, table: AngleTable) -> AnglesTerm:
    """The term of an angle table, with undetected angles entering as the description says."""
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
    data = {
        "route": routes,
        "order": order,
        "angle": np.array([readings[i][0] for i in order[: detected.sum()]]),
        "limit": np.array([readings[i][1] for i in order[detected.sum() :]]),
    }
    return AnglesTerm(cable, data, tuple(readings[i][2] for i in order))


def _parameters(table: AngleTable, at: Circumstances) -> list[Parameter]:
    """Those of every curve, with priors by the angles inside its range, and how angles scatter."""
    route, degree, sd = at.description.route, float(np.rad2deg(1.0)), at.defaults.angle_noise_degrees
    assert route is not None  # an angle table is read only with one
    inside = (table.route >= route.range[0]) & (table.route <= route.range[1])
    read = {column: table.column(column)[0] for column in at.cable.curves}
    curves = [
        parameter
        for column, curve in at.cable.curves.items()
        for parameter in curve.parameters(read[column][np.isfinite(read[column]) & inside], at.defaults)
    ]
    noise = Parameter(
        ANGLE_NOISE, r"$\sigma_\theta$", at.noise.meaning("standard deviation of an angle reading"), "noise",
        HalfCauchy(sd / degree), "deg", degree,
    )  # fmt: skip
    return [*curves, noise]


def _simulation(at: Situation, wanted: Sequence[Candidate]) -> Simulation:
    """Angles of all curved contacts; what is read below the detection limit is not detected."""
    columns, settings = tuple(at.cable.curves), at.cable.description.table(AngleSettings)
    route, _, origin = at.rows(wanted)
    shape = (len(wanted), len(columns))
    table = AngleTable(route, columns, np.full(shape, np.deg2rad(30)), np.full(shape, np.nan), origin)
    term = angles_term(at.cable, table)
    # Every row is detected, so readings are curve by curve; a curve may hold over a part of the range only.
    read_at = np.concatenate([term.data["route"][column] for column in columns])
    limit = settings.detection_limit.to("angle") if settings and settings.detection_limit else 0.0
    found = [tuple(int(k) for k in np.flatnonzero(read_at == length)) for length in route]
    return Simulation(term.simulate, term.data, found, float(np.rad2deg(limit)))


ANGLES = TermKind(
    "angles",
    lambda cable, table, _: (angles_term(cable, table),),
    _parameters,
    Remeasurement(drawn_angles, check=detection_limit),
    CandidateKind(
        name="angle",
        title="Wrap angles",
        words=lambda cable: "the wrap angles" if len(cable.curves) > 1 else "the wrap angle",
        order=0,
        needs=(ANGLE_NOISE,),
        possible=lambda at: bool(at.cable.curves),
        unknown="no contact of this cable has a curve that an angle could tell of.",
        offered=lambda at: [Candidate("angle", length) for length in at.lengths] if at.angles is not None else [],
        simulation=_simulation,
        along_route=True,
        tells_curves=True,
        angles="none",
    ),
    count=count,
    events=EVENTS,
)
