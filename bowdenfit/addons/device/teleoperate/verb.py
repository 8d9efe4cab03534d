"""The verb `teleoperate`: what a hand feels of a remote wall through a cable."""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from bowdenfit.addons.device import teleoperate as _teleoperate
from bowdenfit.arguments import FIT, PATH, RESULTS, Bends, Output, Seed, read_first
from bowdenfit.questions.writing import answer_files, write_answer
from bowdenfit.verb import NOT_TRUSTED, Reply, Verb

if TYPE_CHECKING:
    from bowdenfit.addons.device.teleoperate.answer import Teleoperation
    from bowdenfit.results.record import Record

NAME = "teleoperation"
PROBABILITY = 0.95  # with which contact must be stable
MEASURED = Parameter(
    metavar="FILE", help="A wall touch that was measured, such as touch.csv: angle and torque of master and slave."
)
DEVICE = Parameter("DEVICE", help="Such as device.toml, which describes master, slave, hand and wall.")


@read_first
def teleoperate(
    fit: Annotated["Record", RESULTS, FIT],
    device: Annotated[str | Path, DEVICE, PATH],
    *,
    wrap_angle: Bends = None,
    measured: Annotated[str | Path | None, MEASURED, PATH] = None,
    seed: Annotated[Seed, Parameter(show_default="that of the fit")] = None,
    output: Output = None,
) -> "Teleoperation":
    """What a hand feels through a loop of a slave and its wall, and which walls are touched without bouncing.

    Args:
        fit: The fit.
        device: A device.toml that describes master, slave, hand, wall, and what is sent between them.
        wrap_angle: Range of wrap angles that the cable is bent to.
        measured: Table of a wall touch that was measured: angle and torque of master and slave.
        seed: Random seed.
        output: Folder for teleoperation.json, the text and the figure.

    Raises:
        UsageError: The fit is of no loop, has no posterior, or was not measured at these wrap angles.
        DescriptionError: Something that the answer needs is not said by the device, or has no sd.
        DatasetError: The table cannot be used.
        StoreError: `output` cannot be written.
    """
    touch = None if measured is None else _teleoperate.read_measured_contact(Path(measured))
    answer = _teleoperate.assess_teleoperation(fit.with_seed(seed), Path(device), wrap_angle, PROBABILITY)
    answer = replace(answer, measured=touch)
    if output is not None:
        text = f"{answer}\n"
        write_answer(output, NAME, answer, text, {NAME: _teleoperate.teleoperation_figure}, fit.name)
    return answer


def _reply(answer: "Teleoperation", options: dict[str, Any]) -> Reply:

    notes = tuple(f"Wrote {path}." for path in answer_files(options["output"], NAME)) if options["output"] else ()
    exit_code = NOT_TRUSTED if answer.contradicted else 0
    return Reply(f"{answer}\n", lambda: answer, notes, exit_code, csv=answer.to_csv)


TELEOPERATE = Verb(
    teleoperate,
    _reply,
    """Say what a hand feels of a remote wall through a cable.

    For a loop that drives a slave against a wall, over the uncertainty of the fit:
    torque in free motion, stiffness in contact, and which walls are touched without
    bouncing, by the linear loop and in simulations with dry friction (exit code 3
    where these differ about the stated wall), with four channels between master and
    slave, with two, and with feedback of the master's own torque.

    DEVICE is a device.toml; datasets/haptic-teleoperation has one, whose README
    says which numbers are published and which are assumed.
    """,
    json="Print as JSON.",
    csv="Print probabilities by wall as CSV.",
    warns=True,
    needs_coefficients=True,
    reads="device.toml",
)
