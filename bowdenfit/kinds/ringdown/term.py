"""Ring-downs in the likelihood: the free vibration of the joint against the rope, read with noise."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float
from typing_extensions import override

from bowdenfit.cable.cable import CableContacts
from bowdenfit.kinds.ringdown.kind import RingDownTable
from bowdenfit.kinds.tables import AngleTable
from bowdenfit.kinds.term import Circumstances, IndependentReadings, Term, TermKind, Truth
from bowdenfit.parameters.priors import HalfCauchy, HalfNormal, LogNormal, Normal, TruncatedNormal
from bowdenfit.parameters.space import Parameter
from bowdenfit.physics.ring_down import ring_down
from bowdenfit.types import DataArray

INERTIA, STIFFNESS, DAMPING, FRICTION = "ring_inertia", "ring_stiffness", "rope_damping", "ring_friction"
NOISE = "sigma_ringdown"
_LOG_SD = 0.5  # half the prior's log sd of inertia and stiffness about what period and added inertia give; a judgement
_TIMES = 1.5  # prior sd of damping and of friction over what would stop the joint alone; wide by judgement
# Shares of the first deflection: noise, as of an encoder of 2000 counts a turn, and the zero of a sensor; judgements.
_NOISE_SHARE, _REST_SHARE = 0.005, 0.1
# Starts in z: how many half swings friction leaves is a whole number, and each has a best fit of its own.
# Three starts pass tests/kinds/ringdown/test_ring_down_coverage.py.
_STARTS = (-1.5, 0.0, 1.5)
_LEAST = 1e-9  # least first estimate, because priors are positive
_LARGE = 0.15  # share of the first swing above which one counts; smaller ones are mostly noise. A judgement
_LEAST_DECAY, _MOST_DECAY = 0.05, 0.999  # decays of a half swing between which one is estimated; wide by judgement
_MORE_SWINGS = 3  # half swings that are followed over those seen: less friction than the best fit's leaves more of them


def run_parameter_name(name: str, run: int) -> str:
    """Return the name of a run's own parameter."""
    return f"ring_{name}_{run + 1}"


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class RingDownData:
    """Arrays of a table of ring-downs.

    Args:
        reading: Angles [rad] or torques [N m], (rows).
        time: Time of each row [s], (rows).
        run: Number of each row's run, (rows).
        added: Inertia added in each run [kg m^2], (runs).
        torque: 1 where torques were read, else 0, (runs).
        swings: Zeros, one for each half swing that is followed, (half swings).
    """

    reading: DataArray
    time: DataArray
    run: DataArray
    added: DataArray
    torque: DataArray
    swings: DataArray


class RingDownTerm(IndependentReadings):
    r"""Likelihood of a table of ring-downs: angles [rad], or torques :math:`K x + b_c \dot x` in the rope [N m].

    To each of them what is read at rest is added.
    """

    name = "ringdown"
    noise = NOISE
    depends_on_conditions = False  # see `Term`

    @property
    def unit(self) -> str:
        """Unit of the readings: of angles or of torques."""
        return "N m" if np.any(self.data.torque > 0) else "rad"

    @override
    def expected(self, values: Mapping[str, Array], data: RingDownData) -> Float[Array, " rows"]:
        run, n = data.run, len(data.added)
        amplitude, at_rest, release = (
            jnp.stack([values[run_parameter_name(name, i)] for i in range(n)]) for name in ("amplitude", "rest", "release")
        )
        stiffness, damping = values[STIFFNESS], values[DAMPING]
        angle, speed = ring_down(
            data.time - release[run], run, amplitude, values[INERTIA] + data.added, stiffness, damping,
            values[FRICTION], len(data.swings),
        )  # fmt: skip
        return at_rest[run] + jnp.where(data.torque[run] > 0, stiffness * angle + damping * speed, angle)


def make_ring_down_term(cable: CableContacts, table: RingDownTable) -> RingDownTerm:
    """Return the term of a table of ring-downs."""
    torque, swings = np.full(len(table.added), float(table.is_torque)), np.zeros(_sampling(table)[1])
    data = RingDownData(table.reading, table.time, table.run, table.added, torque, swings)
    labels = tuple(f"{1000 * time:.4g} ms" for time in table.time)
    return RingDownTerm(cable, data, labels)


def _sampling(table: RingDownTable) -> tuple[float, int]:
    """Return the interval between rows [s], and the number of half swings that are followed."""
    seen = max(table.measure_half_swings(run)[0] for run in range(len(table.added)))
    return float(np.median(np.diff(table.time[table.run == 0]))), _MORE_SWINGS * seen + 5


def _first_estimates(table: RingDownTable, run: int, product: float, stiffness: float) -> tuple[float, float]:
    """Estimate damping [N m s/rad] and friction [N m] from the turns of a run.

    Args:
        table: The table.
        run: Number of the run.
        product: K J [N m kg m^2/rad].
        stiffness: Torque per unit of the reading.
    """
    rho, held = estimate_decay(table, run)
    log_decay = -np.log(rho)
    damping = float(2 * np.sqrt(product) * log_decay / np.hypot(np.pi, log_decay))
    return max(damping, _LEAST), max(held * stiffness, _LEAST)


def _inertia_parameter(table: RingDownTable, size: float) -> Parameter:
    """Return the inertia of what swings, as stated or to be determined by adding a known one."""
    free = Parameter(
        INERTIA, "$J$", "inertia of the released joint", "elastic", LogNormal(size, 2 * _LOG_SD), "kg*m^2",
        scaled_by=f"the largest added inertia, {size:.3g} kg m^2",
    )  # fmt: skip
    if np.isnan(table.inertia):
        return free
    if np.isnan(table.inertia_sd):
        return replace(free, fixed=table.inertia, prior_words="fixed (stated)", scaled_by="")
    return replace(free, prior=TruncatedNormal(table.inertia, table.inertia_sd), scaled_by="")


def _release_parameters(run: int, amplitude: Normal, at_rest: Normal, unit: str, step: float) -> list[Parameter]:
    """Return the parameters of how one run was released and read.

    Args:
        run: Number of the run.
        amplitude: Prior of the first deflection [rad].
        at_rest: Prior of the reading at rest.
        unit: Unit of the readings.
        step: Interval between readings [s].
    """
    name, of_run = run_parameter_name, f"of ring-down {run + 1}"
    return [
        Parameter(
            name("amplitude", run), f"$x_{{{run + 1}}}$", f"deflection {of_run}", "sensor", amplitude, "rad",
        ),
        Parameter(
            name("rest", run), f"$q_{{{run + 1}}}$", f"reading without a load {of_run}", "sensor", at_rest, unit,
        ),
        Parameter(
            name("release", run), f"$t_{{{run + 1}}}$", f"time of release {of_run}", "sensor", Normal(0.0, step), "s",
        ),
    ]  # fmt: skip


def estimate_decay(table: RingDownTable, run: int) -> tuple[float, float]:
    r"""Return the decay rho of a half swing by damping, and the offset f at which friction can hold the bar, as a reading.

    From the way D from one turn to the next, which needs no place of rest:

    .. math:: D_{n + 1} = \rho D_n - 2 (1 + \rho) f

    Args:
        table: The table.
        run: Number of the run.
    """
    reading = table.reading[table.run == run]
    away = reading - np.median(reading[-max(len(reading) // 10, 3) :])
    turned = np.flatnonzero(np.diff(np.sign(away)) != 0) + 1
    swings = [part for part in np.split(away, turned) if len(part)]
    peaks = np.array([part[np.argmax(np.abs(part))] for part in swings])
    ways = np.abs(np.diff(peaks))
    last = np.argmax(ways < _LARGE * ways[0]) if np.any(ways < _LARGE * ways[0]) else len(ways)
    ways = ways[: max(last, 2)]
    if len(ways) < 3:  # damping and friction share alike
        ratio = float(np.clip(ways[-1] / ways[0], _LEAST_DECAY, _MOST_DECAY))
        rho = np.sqrt(ratio)
        return float(rho), float((rho - ratio) * ways[0] / (2 * (1 + rho)))
    slope, shift = np.polyfit(ways[:-1], ways[1:], 1)
    rho = float(np.clip(slope, _LEAST_DECAY, _MOST_DECAY))
    shift = float(np.mean(ways[1:] - rho * ways[:-1])) if rho != slope else shift
    return rho, max(float(-shift) / (2 * (1 + rho)), 0.0)


class RingDownTerms(TermKind[RingDownTable]):
    """Ring-downs in the likelihood."""

    name = "ringdown"

    @override
    def terms(self, cable: CableContacts, table: RingDownTable, angles: AngleTable | None) -> tuple[RingDownTerm]:
        return (make_ring_down_term(cable, table),)

    @override
    def parameters(self, table: RingDownTable, at: Circumstances) -> list[Parameter]:
        """Return inertia, stiffness, damping and friction, and how each run was released and read."""
        inertia = table.inertia if np.isfinite(table.inertia) else float(np.max(table.added))
        first = int(np.argmin(table.added))
        seen, half = table.measure_half_swings(first)
        omega = np.pi / half
        stiffness = (inertia + table.added[first]) * omega**2
        runs = [table.reading[table.run == run] for run in range(len(table.added))]
        away = [float(reading[0] - np.median(reading[-max(len(reading) // 10, 3) :])) for reading in runs]
        size = float(np.max(np.abs(away))) or 1.0
        angle = size / stiffness if table.is_torque else size
        step, unit = _sampling(table)[0], "N*m" if table.is_torque else "rad"
        decay = 2 * np.sqrt(stiffness * (inertia + table.added[first])) * np.log(10) / (np.pi * seen)  # to a tenth
        damping, friction = HalfNormal(_TIMES * decay), HalfNormal(_TIMES * 0.45 * stiffness * angle / seen)
        looks = _first_estimates(table, first, stiffness * (inertia + table.added[first]), stiffness * angle / size)
        by = f"the period, {2000 * np.pi / omega:.3g} ms, and an inertia of {inertia:.3g} kg m^2"
        parameters = [
            _inertia_parameter(table, inertia),
            Parameter(
                STIFFNESS, "$K$", "stiffness against which the released joint swings", "elastic",
                LogNormal(stiffness, 2 * _LOG_SD), "N*m/rad", scaled_by=by, starts=(), first_look=stiffness,
            ),
            Parameter(
                DAMPING, "$b_c$", "viscous damping of rope and joint", "elastic",
                damping, "N*m*s/rad", scaled_by=by, starts=_STARTS, first_look=looks[0],
            ),
            Parameter(
                FRICTION, "$F_r$", "dry friction of the released joint", "elastic",
                friction, "N*m",
                scaled_by=f"the first deflection, {size:.3g} {unit}, over {seen} half swings", starts=_STARTS,
                first_look=looks[1],
            ),
            Parameter(
                NOISE, r"$\sigma_r$", at.noise.meaning("standard deviation of a reading of the ring-down"), "noise",
                HalfCauchy(_NOISE_SHARE * size), unit, scaled_by=f"the first deflection, {size:.3g} {unit}",
            ),
        ]  # fmt: skip
        for run, deflection in enumerate(away):
            at_rest = float(np.median(runs[run][-max(len(runs[run]) // 10, 3) :]))
            start = deflection / stiffness if table.is_torque else deflection
            parameters += _release_parameters(run, Normal(start, angle), Normal(at_rest, _REST_SHARE * size), unit, step)
        return parameters

    @override
    def draw(self, table: RingDownTable, truth: Truth) -> dict[str, Array]:
        term = make_ring_down_term(truth.cable, table)
        return {"reading": truth.simulate(term, jax.random.fold_in(truth.key, 11))}

    @override
    def covariates(self, table: RingDownTable, term: Term) -> Mapping[str, np.ndarray]:
        return {"Time (s)": np.asarray(term.data.time)}
