"""Results of `bowdenfit compensate`: limits of feed-forward and feedback, what remains, and simulations of the device."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from bowdenfit.display import Display, Rows
from bowdenfit.inference.interval import Interval

NONE, KARNOPP, ACTIVE = "none", "karnopp", "active"
ROPE_DAMPING = "the damping of the rope"
"""The input that usually determines the largest gain, and that a ring-down measures."""


@dataclass(frozen=True)
class FeedForward:
    """Torque F_cst that is fed forward, constant or scheduled by bend.

    Args:
        share: c, of the median friction at each bend; for one value, of that where it is most.
        torque: F_cst where friction is most [N m].
        risk: Probability that the device moves by itself at some bend.
        left: Median torque that is left to feel where friction is most [N m].
        decided_at: Wrap angle that limits it most often [deg].
    """

    share: float
    torque: float
    risk: float
    left: float
    decided_at: float


@dataclass(frozen=True)
class BendCompensation:
    """Friction and compensation at one wrap angle.

    Args:
        wrap_angle: [deg].
        friction: Torque that moves the device, of motor and loop [N m].
        scheduled: F_cst of the schedule [N m].
        left_scheduled, left_fixed: Median of what is left to feel [N m]; negative where the device is pushed on.
    """

    wrap_angle: float
    friction: Interval
    scheduled: float
    left_scheduled: float
    left_fixed: float


@dataclass(frozen=True)
class FeedbackGain:
    """Gain K_f on the torque measured at the joint.

    Args:
        safe: Largest gain with which the loop oscillates with at most the risk, with a hand on it or without [1].
        stable: Largest gain that does not oscillate, by draw [1].
        passive: Largest gain with which no passive hand can make it oscillate, at that risk [1].
        with_hand: Whether a hand that is described counts, too.
        decided_by: Input that decides it most, in words.
        decided_share: Share of the scatter of the largest gain that goes with it.
        left: Torque that a hand still feels where friction is most, at the safe gain [N m].
        from_ring_down: Whether the damping of the rope comes from a ring-down; else it was stated.
        integral: K_i on the integral of that torque, as stated [1/s].
    """

    safe: float
    stable: Interval
    passive: float
    with_hand: bool
    decided_by: str
    decided_share: float
    left: Interval
    from_ring_down: bool = False
    integral: float = 0.0


@dataclass(frozen=True)
class PreloadOption:
    """Effect of another preload.

    Args:
        preload: At the reference angle [N].
        friction: Friction of the loop where it is most [N m].
        slack_from: Torque of the motor from which a side is slack, where that is least [N m].
    """

    preload: float
    friction: Interval
    slack_from: Interval

    JSON: ClassVar = ("preload", ("felt", "friction"), "slack_from")


@dataclass(frozen=True)
class TorqueTrace:
    """Torques of the device with median friction, while a hand moves it to and fro.

    Args:
        time: [s].
        motor, joint: What the rope takes from the motor and gives the joint [N m].
    """

    time: np.ndarray
    motor: np.ndarray
    joint: np.ndarray


@dataclass(frozen=True)
class SimulatedLaw:
    """One control law, in every simulated device.

    Args:
        name: "none", "karnopp" or "active".
        mean_torque: Mean torque at the joint against the motion [N m].
        peak_torque: The largest, where the motion turns round [N m].
        trace: Trace of one device.
    """

    name: str
    mean_torque: Interval
    peak_torque: Interval
    trace: TorqueTrace

    JSON: ClassVar = ("name", ("felt", "mean_torque"), ("peak", "peak_torque"), "trace")


@dataclass(frozen=True)
class DeviceSimulation:
    """Simulation of the compensated device.

    Args:
        draws: Devices that were simulated.
        wrap_angle: At which the hand moved them [deg].
        laws: Each law.
        runaway_share: Share of the devices that keep moving by themselves after a push without a hand, each at its critical
            bend; None without feed-forward.
        speed: Largest of the hand [rad/s].
    """

    draws: int
    wrap_angle: float
    laws: tuple[SimulatedLaw, ...]
    runaway_share: float | None
    speed: float

    JSON: ClassVar = ("draws", "wrap_angle", "laws", ("went_on", "runaway_share"), "speed")


@dataclass(frozen=True, repr=False)
class Compensation(Display):
    """Limits of friction compensation for a cable and device.

    Args:
        cable: Name of the cable.
        device: Name of the device; empty without one.
        law: The law that was asked for; None for both.
        bends: Lowest and highest wrap angle [deg].
        risk: Probability that is accepted.
        draws: How many.
        scatter: Median scatter of the friction exponent from mounting to mounting [1].
        scatter_from_fit: Whether the measurements tell it; else it was stated.
        dead_zone: Speed below which nothing is fed forward [rad/s]; 0 where none is stated.
        chatters_below: Dead zone below which the motor chatters, one count of the encoder in the time of the filter [rad/s].
        fixed: One value for all bends; None where another law was asked for.
        scheduled: A value by bend; None where another law was asked for.
        share_without_scatter: The scheduled share that would seem safe from the coefficients alone.
        by_bend: Every bend looked at.
        gain: Gain of the active law; None where it was not asked for, or cannot be told.
        missing: Keys of device.toml that a gain needs and that are not said.
        preloads: Answers at other preloads.
        slack: Probability that the loop is slack at rest at some of the bends.
        simulated: The device through time; None without simulation.
    """

    cable: str
    device: str
    law: str | None
    bends: tuple[float, float]
    risk: float
    draws: int
    scatter: float
    scatter_from_fit: bool
    dead_zone: float
    chatters_below: float | None
    fixed: FeedForward | None
    scheduled: FeedForward | None
    share_without_scatter: float
    by_bend: tuple[BendCompensation, ...]
    gain: FeedbackGain | None
    missing: tuple[str, ...]
    preloads: tuple[PreloadOption, ...]
    slack: float
    simulated: DeviceSimulation | None = None

    @property
    def most(self) -> BendCompensation:
        """The bend with the largest friction."""
        return max(self.by_bend, key=lambda bend: bend.friction.median)

    def _table(self) -> Rows:
        rows = [
            {"wrap_angle": bend.wrap_angle, "friction": bend.friction.median, "friction_q05": bend.friction.q05,
             "friction_q95": bend.friction.q95, "scheduled": bend.scheduled, "left_scheduled": bend.left_scheduled,
             "left_fixed": bend.left_fixed}
            for bend in self.by_bend
        ]  # fmt: skip
        return rows, {"wrap_angle": "deg"} | {name: "N*m" for name in (rows[0] if rows else {}) if name != "wrap_angle"}
