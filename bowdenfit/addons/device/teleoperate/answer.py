"""Results and text of `bowdenfit teleoperate`: torque in free motion, stiffness in contact, and which walls are stable."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from bowdenfit.addons.device.teleoperate.measured import MeasuredContact, MeasuredValue
from bowdenfit.display import Block, Display, ResultTable, Rows, blocks_of, separate
from bowdenfit.inference.interval import Interval
from bowdenfit.words import counted, listed, percent, significant


@dataclass(frozen=True)
class CouplingScheme:
    """One coupling of master and slave.

    Args:
        name: In words.
        free_torque: Torque in slow free motion, where the cable's friction is most [N m].
        stiffness: Stiffness of the stated wall as the hand feels it [N m/rad]; None without a position sent back.
        free_motion_stable: Probability that it is stable in free motion.
        stable: Probability that contact is stable, by wall stiffness.
        hardest: Hardest wall up to which every softer one is stable with the probability asked for [N m/rad]; 0 where free
            motion is not, None where no wall looked at is too hard.
        radius: Median of the largest spectral radius in free motion; above 1 oscillations grow.
        bounces: Whether the slave still bounces at each wall in a simulation with median parameters and dry friction.
    """

    name: str
    free_torque: Interval
    stiffness: Interval | None
    free_motion_stable: float
    stable: np.ndarray
    hardest: float | None
    radius: float
    bounces: np.ndarray

    JSON: ClassVar = (
        "name",
        ("free", "free_torque"),
        "stiffness",
        ("in_the_open", "free_motion_stable"),
        "stable",
        "hardest",
        "radius",
        ("bounces_in_simulation", "bounces"),
    )


@dataclass(frozen=True)
class SimulatedContact:
    """One simulated device: in free motion for 2 s, then against the wall, as in figures 12 to 14 of the haptic paper.

    Args:
        time: [s].
        master, slave: Angles of the master's joint and of the slave [rad].
        hand_torque, wall_torque: Torques of the hand and on the wall [N m].
        wall_stiffness: Stiffness of the wall [N m/rad].
        bounces: Whether the slave leaves the wall again 1.2 s after it came; None where it never came.
    """

    time: np.ndarray
    master: np.ndarray
    slave: np.ndarray
    hand_torque: np.ndarray
    wall_torque: np.ndarray
    wall_stiffness: float
    bounces: bool | None


@dataclass(frozen=True, repr=False)
class Teleoperation(Display):
    """Answer on teleoperation: what a hand feels of a remote wall through a cable, and which walls are stable.

    Args:
        cable, device: Their names.
        bends: Lowest and highest wrap angle [deg].
        probability: With which contact must be stable.
        draws: Devices looked at, each at a bend of its own.
        walls: Stiffnesses of walls looked at [N m/rad].
        wall: The stated one [N m/rad].
        at_wall: Probability that contact with that one is stable, with the coupling as stated.
        schemes: The coupling as stated, with two channels, and with local feedback.
        contact: One device through time.
        measured: A wall touch that was measured; None without one.
    """

    cable: str
    device: str
    bends: tuple[float, float]
    probability: float
    draws: int
    walls: np.ndarray
    wall: float
    at_wall: float
    schemes: tuple[CouplingScheme, ...]
    contact: SimulatedContact
    measured: MeasuredContact | None = None

    JSON: ClassVar = (
        "cable", "device", "bends", "probability", "draws", "walls", "wall", "at_wall", "schemes", "contact", "measured?"
    )  # fmt: skip

    @property
    def stated(self) -> CouplingScheme:
        """The coupling as stated."""
        return self.schemes[0]

    @property
    def contradicted(self) -> bool:
        """Whether linear loop and simulation differ about the stated wall with the coupling as stated."""
        return (self.at_wall >= self.probability) == bool(self.contact.bounces)

    def _table(self) -> Rows:
        rows = [
            {
                "coupling": scheme.name,
                "wall_stiffness": float(wall),
                "stable": float(scheme.stable[i]),
                "bounces_in_simulation": bool(scheme.bounces[i]),
            }
            for scheme in self.schemes
            for i, wall in enumerate(self.walls)
        ]
        return rows, {"wall_stiffness": "N*m/rad"}


@blocks_of.register
def _(answer: Teleoperation) -> list[Block]:
    """Return the answer for people, the answer first, in at most 25 lines."""
    return separate(sentences(answer), [_scheme_table(answer)])


def sentences(answer: Teleoperation) -> list[str]:
    """Say what is felt, whether the wall is stable, and what other couplings would do."""
    return [
        sentence
        for sentence in (
            *_wall_sentences(answer),
            *_transmission_sentences(answer),
            *_instability_sentences(answer),
            *_simulation_sentences(answer),
            *_contrast_sentences(answer),
            *_measured_sentences(answer),
        )
        if sentence
    ]


def _describe_bends(answer: Teleoperation) -> str:
    low, high = (f"{angle:.4g}" for angle in answer.bends)
    return f"bent to {low} deg" if low == high else f"bent from {low} to {high} deg"


def _wall_sentences(answer: Teleoperation) -> Iterator[str]:
    hardest, sure = answer.stated.hardest, percent(answer.probability, 0)
    at = f"the stated wall, {answer.wall:.4g} N*m/rad, with {percent(answer.at_wall, 0)}"
    if hardest is None:
        yield (
            f"Through this cable a hand feels walls of up to {answer.walls[-1]:.0f} N*m/rad, the hardest looked at, without "
            f"bouncing with at least {sure} probability, {_describe_bends(answer)}; {at}."
        )
    elif hardest <= 0:
        bends = _describe_bends(answer)
        yield f"Through this cable a hand feels no wall without bouncing with {sure} probability, {bends}; {at}."
    else:
        yield (
            f"Through this cable a hand feels walls of up to {significant(hardest, 2)} N*m/rad without bouncing with at least "
            f"{sure} probability, {_describe_bends(answer)}; {at}."
        )


def _transmission_sentences(answer: Teleoperation) -> Iterator[str]:
    stated = answer.stated
    torque = stated.free_torque
    free = f"{torque.median:.3f} N*m in slow free motion (90 % interval {torque.q05:.3f} to {torque.q95:.3f})"
    if stated.stiffness is None:
        yield f"The hand feels {free}."
        return
    stiffness = stated.stiffness
    yield (
        f"The hand feels {free}, and of the wall {significant(stiffness.median)} N*m/rad "
        f"({significant(stiffness.q05)} to {significant(stiffness.q95)}) while both sides of the loop are taut. "
        "These probabilities are those of the linear loop, without dry friction."
    )


def _instability_sentences(answer: Teleoperation) -> Iterator[str]:
    """Yield warnings of couplings that oscillate in free motion."""
    for scheme in answer.schemes:
        if scheme.free_motion_stable < answer.probability:
            yield (
                f"Caution, {scheme.name}: it already oscillates in free motion, with "
                f"{percent(1 - scheme.free_motion_stable, 0)} probability; the spectral radius, the factor by which "
                f"oscillations grow from sample to sample, is {scheme.radius:.4g} (median), and at most 1 is stable. "
                "Lower the stiffnesses of the coupling, or sample faster."
            )


def _simulation_sentences(answer: Teleoperation) -> Iterator[str]:
    contact = answer.contact
    if contact.bounces is None:
        yield "In a simulation with median parameters, the slave never reaches the wall: friction holds it."
    else:
        does = "still bounces" if contact.bounces else "does not bounce"
        wall = f"{contact.wall_stiffness:.4g} N*m/rad"
        yield f"In a simulation with median parameters, the slave {does} 1.2 s after it touched a wall of {wall}."


def _contrast_sentences(answer: Teleoperation) -> Iterator[str]:
    """Say where the simulation with dry friction bounces, beside what the linear loop calls unstable."""
    probable = [scheme for scheme in answer.schemes if np.any(scheme.stable < answer.probability)]
    quiet = [scheme.name for scheme in probable if not scheme.bounces.any()]
    if quiet:
        yield (
            f"The linear loop calls some walls unstable {_describe_quiet(answer, quiet)}; in simulations the slave comes to "
            "rest at all of them: dry friction ends small oscillations. After a harder impact it may not."
        )
    if answer.contradicted:
        yield (
            "They differ about the stated wall (exit code 3): rely on neither before it was tried on the device."
        )


def _measured_sentences(answer: Teleoperation) -> Iterator[str]:
    """Say what was measured at a wall, and whether the intervals of the coupling as stated agree."""
    contact, scheme = answer.measured, answer.stated
    if contact is None:
        return
    parts = []
    if contact.free_torque is not None:
        parts.append(_compare(contact.free_torque, scheme.free_torque, "N*m in free motion"))
    if scheme.stiffness is not None:
        parts.append(_compare(contact.stiffness, scheme.stiffness, "N*m/rad in contact"))
    else:
        parts.append(f"{significant(contact.stiffness.value)} N*m/rad in contact, where the fit gives none")
    yield (
        f"Measured, {contact.file}: {'; '.join(parts)}. The slave met a wall of {significant(contact.wall.value)} N*m/rad; "
        f"{answer.wall:.4g} N*m/rad are stated."
    )
    if scheme.stiffness is not None and contact.stiffness.compare(scheme.stiffness) == "below":
        yield (
            "Where one side of the loop goes slack, its stiffness is half; if the measured one is too low for that reason, "
            "record a touch with less torque."
        )
    if contact.left_wall:
        yield f"The slave left the wall {counted(contact.left_wall, 'time')}: it was released, or bounced."


def _compare(measured: MeasuredValue, interval: Interval, what: str) -> str:
    """Return a measured value next to the interval of the fit, in words."""
    verdict = measured.compare(interval)
    words = "which agrees with" if verdict == "agrees" else verdict
    return (
        f"{significant(measured.value)} {what} (standard error {significant(measured.error, 2)}), {words} the 90 % interval "
        f"{significant(interval.q05)} to {significant(interval.q95)}"
    )


def _describe_quiet(answer: Teleoperation, quiet: Sequence[str]) -> str:
    return "with every coupling" if len(quiet) == len(answer.schemes) else f"with {listed(quiet)}"


def _scheme_table(answer: Teleoperation) -> ResultTable:
    rows = [
        [
            scheme.name,
            f"{scheme.free_torque.median:.3f}",
            _format_stiffness(scheme),
            _format_hardest(answer, scheme),
            _format_simulated(answer, scheme),
        ]
        for scheme in answer.schemes
    ]
    heads = ["coupling", "free (N*m)", "wall felt (N*m/rad)", "hardest: linear", "simulated"]
    return ResultTable(heads, rows)


def _format_simulated(answer: Teleoperation, scheme: CouplingScheme) -> str:
    """Return the hardest wall below the first that bounces in the simulation."""
    if not scheme.bounces.any():
        return f"over {answer.walls[-1]:.0f}"
    first = int(np.argmax(scheme.bounces))
    return significant(float(answer.walls[first - 1])) if first else "none"


def _format_stiffness(scheme: CouplingScheme) -> str:
    return "-" if scheme.stiffness is None else significant(scheme.stiffness.median)


def _format_hardest(answer: Teleoperation, scheme: CouplingScheme) -> str:
    return (
        f"over {answer.walls[-1]:.0f}"
        if scheme.hardest is None
        else "none"
        if scheme.hardest <= 0
        else significant(scheme.hardest, 2)
    )
