"""What the figures show, as plain arrays: drawing needs no model, and can be done in another process.

Loads no JAX, and must not: the process that draws would pay for it.
"""

from dataclasses import dataclass, field

import numpy as np

from bowdenfit.questions.bends.figure_data import ElasticFigures
from bowdenfit.questions.check.figure_data import CheckedTable
from bowdenfit.results.length import OptimalLength

BAND_QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)


@dataclass(frozen=True)
class Band:
    """Quantiles (`BAND_QUANTILES`, first axis) against the route; one row, the least-squares line, without draws."""

    route: np.ndarray
    quantiles: np.ndarray

    @property
    def is_line(self) -> bool:
        """Whether there is only the least-squares line."""
        return len(self.quantiles) == 1


@dataclass(frozen=True)
class AngleCurve:
    """One contact's wrap angle [deg]: the curve, and the readings by how they entered.

    Args:
        contact: Name of the contact.
        band: The curve.
        route, angle: Detected readings inside the range of the curve.
        undetected_route, limit: Readings below the detection limit inside the range.
        outside_route, outside_angle: Readings outside the range, which the curve does not use.
    """

    contact: str
    band: Band
    route: np.ndarray
    angle: np.ndarray
    undetected_route: np.ndarray
    limit: np.ndarray
    outside_route: np.ndarray
    outside_angle: np.ndarray


@dataclass(frozen=True)
class EfficiencyPoints:
    """Measured efficiencies [1], of rows or of runs.

    Args:
        what: "efficiency", "run_efficiency" or "recorded_efficiency".
        labels: Each in words.
        route: Route value; NaN without a route.
        measured: Efficiency.
        predicted: Quantiles (`BAND_QUANTILES`, first axis) of readings drawn anew; one row, least squares', without
            draws.
        inside: Whether it lies within the range of the curves.
    """

    what: str
    labels: tuple[str, ...]
    route: np.ndarray
    measured: np.ndarray
    predicted: np.ndarray
    inside: np.ndarray


@dataclass(frozen=True)
class ParameterDraws:
    """One free parameter in its shown unit.

    Args:
        name, symbol, unit, role: As declared; `symbol` is in matplotlib's math notation.
        draws: Walkers (ordered by ensemble) by draws; None without MCMC.
        prior: Draws from the prior.
        least_squares: Estimate; NaN where not identified.
        standard_error: Its standard error.
    """

    name: str
    symbol: str
    unit: str
    role: str
    draws: np.ndarray | None
    prior: np.ndarray | None
    least_squares: float
    standard_error: float


@dataclass(frozen=True)
class RecordedTrace:
    """One recording: what was read in every block, what the rope did, and what the fit says of it.

    Args:
        name: Name of the recording.
        run: Mounting that it belongs to.
        time: Middle of each block [s].
        input_force, output_force: Mean forces of each block [N].
        velocity: Mean velocity of each block, in `FigureData.velocity_unit`; NaN where not known.
        stroke: +1 pulling, -1 returning, 0 switching or held.
        used: Blocks safely inside a sliding phase.
        saturated: Blocks at the end of a load cell's range.
        predicted: Output force [N] of each block that the cable gives at the measured input force, 5 %, 50 % and 95 %
            quantiles (first axis) over draws and over new mountings; one row, least squares', without draws.
        fitted: Output force [N] of each block with this run's own mounting effect.
        exponent: Friction exponent of the cable here, 5 %, 50 % and 95 % quantiles; three times the estimate without draws.
        own_exponent: Friction exponent of this recording by itself [1].
        efficiency: Expected efficiency of the run, 5 %, 50 % and 95 % quantiles.
        own_efficiency: Efficiency of the run as measured [1].
        own_efficiency_sd: Its standard error from the readings alone [1].
        lag: Lags of the autocorrelation [s].
        autocorrelation: Of the deviations of log F_out from the fitted operator, in blocks that are used.
        flagged_kind, flagged_time, flagged_input, flagged_output: Samples left out: why, when [s], and what was read [N].
    """

    name: str
    run: str
    time: np.ndarray
    input_force: np.ndarray
    output_force: np.ndarray
    velocity: np.ndarray
    stroke: np.ndarray
    used: np.ndarray
    saturated: np.ndarray
    predicted: np.ndarray
    fitted: np.ndarray
    exponent: np.ndarray
    own_exponent: float
    efficiency: np.ndarray
    own_efficiency: float
    own_efficiency_sd: float
    lag: np.ndarray
    autocorrelation: np.ndarray
    flagged_kind: tuple[str, ...]
    flagged_time: np.ndarray
    flagged_input: np.ndarray
    flagged_output: np.ndarray


@dataclass(frozen=True)
class Dependence:
    """How efficiency depends on the load or the speed, where the fit allows it to.

    Args:
        what: "load" or "speed".
        label: Axis label with unit.
        x: Loads [N] or speeds (shown unit).
        quantiles: Efficiency there, 5 %, 50 % and 95 % quantiles (first axis); one row without draws.
        constant: Efficiency by the capstan equation alone at the reference, for comparison [1].
        points_x, points_efficiency: Measured, load by load or speed by speed.
        points_label: Run of each point.
        place: Where on the route, in words, such as "at 470 mm"; empty without a route.
    """

    what: str
    label: str
    x: np.ndarray
    quantiles: np.ndarray
    constant: float
    points_x: np.ndarray
    points_efficiency: np.ndarray
    points_label: tuple[str, ...]
    place: str


@dataclass(frozen=True)
class FigureData:
    """Everything the figures of one fit show.

    Args:
        name: Name of the cable.
        route_label: Axis label of the route with unit, such as "Cable length (mm)"; empty without a route.
        route_range: Where the curves hold.
        angles: Curves of the curved contacts.
        efficiency: Efficiency against the route; None without a route.
        points: Measured efficiencies.
        optimum: The design answer; None without draws or route.
        optimal_length, optimal_efficiency: Draws, walkers by draws; None likewise.
        parameters: Free parameters.
        n_ensembles: Number of ensembles (walkers are ordered by ensemble).
        recordings: Recordings, in the order of the data set.
        velocity_unit: Unit of their velocities as shown, "mm/s" or "r/min"; empty without any.
        dependences: How efficiency depends on load and speed.
        elastic: Stretch, preload and loops.
        checks: Readings against their predictions from all the others.
    """

    name: str
    route_label: str
    route_range: tuple[float, float]
    angles: tuple[AngleCurve, ...]
    efficiency: Band | None
    points: tuple[EfficiencyPoints, ...]
    optimum: OptimalLength | None
    optimal_length: np.ndarray | None
    optimal_efficiency: np.ndarray | None
    parameters: tuple[ParameterDraws, ...]
    n_ensembles: int
    recordings: tuple[RecordedTrace, ...] = ()
    velocity_unit: str = ""
    dependences: tuple[Dependence, ...] = ()
    elastic: ElasticFigures = field(default_factory=ElasticFigures)
    checks: tuple[CheckedTable, ...] = ()
