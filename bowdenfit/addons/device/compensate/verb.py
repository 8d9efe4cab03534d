"""The verb `compensate`: how much of a cable's friction a controller may compensate."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Parameter

from bowdenfit.addons.device import compensate as _compensate
from bowdenfit.arguments import FIT, PATH, RESULTS, Bends, Output, Quantity, Seed, as_pair, number_with_unit, read_first
from bowdenfit.errors import UsageError
from bowdenfit.questions.writing import answer_figures, answer_files, write_answer
from bowdenfit.verb import Reply, Verb

if TYPE_CHECKING:
    from bowdenfit.addons.device.compensate.answer import Compensation
    from bowdenfit.results.record import Record

NAME, TRACES = "compensation", "compensation_traces"
Law = Literal["karnopp", "active"]


@read_first
def compensate(
    fit: Annotated["Record", RESULTS, FIT],
    device: Annotated[str | Path | None, Parameter(metavar="FILE"), PATH] = None,
    *,
    wrap_angle: Bends = None,
    law: Annotated[Law | None, Parameter(show_default="both")] = None,
    schedule: bool = False,
    simulate: bool = False,
    risk: Annotated[Quantity | None, Parameter(metavar="PERCENT", show_default="5%"), number_with_unit("5%")] = None,
    seed: Annotated[Seed, Parameter(show_default="that of the fit")] = None,
    output: Output = None,
) -> "Compensation":
    """How much of a loop's friction a controller may compensate before the device moves on its own, and what a hand feels.

    Args:
        fit: The fit.
        device: A device.toml that says what the fit does not: inertias, damping, the controller.
        wrap_angle: Range of wrap angles that must be safe.
        law: Feed forward by the motion's direction (karnopp), or feed back the measured torque (active).
        schedule: Simulate what is fed forward by bend, not one value for all bends.
        simulate: Simulate 400 devices through time: what is felt, and how many move by themselves.
        risk: Probability that is accepted.
        seed: Random seed.
        output: Folder for compensation.json, the text and the figures.

    Raises:
        UsageError: The fit is of no loop, has no posterior, or was not measured at these wrap angles.
        DescriptionError: Something that the answer needs is not said by the device, or has no sd.
        StoreError: `output` cannot be written.
    """
    if schedule and not (simulate and law != "active"):
        raise UsageError(
            "--schedule says what --simulate feeds forward; add --simulate, without --law active, or leave it out: what may be "
            "fed forward by bend is part of every answer."
        )
    path = None if device is None else Path(device)
    answer = _compensate.answer_compensation(fit.with_seed(seed), path, wrap_angle, law, as_pair(risk), schedule, simulate)
    if output is not None:
        _write(answer, Path(output), fit.name)
    return answer


def _write(answer: "Compensation", folder: Path, cable: str) -> None:
    figures = {NAME: _compensate.compensation_figure}
    if answer.simulated is not None:
        figures[TRACES] = _compensate.compensation_traces_figure
    write_answer(folder, NAME, answer, f"{answer}\n", figures, cable)


def _reply(answer: "Compensation", options: dict[str, Any]) -> Reply:
    files = answer_files(options["output"], NAME) if options["output"] else []
    if files and answer.simulated is not None:
        files += answer_figures(options["output"], TRACES)
    notes = tuple(f"Wrote {path}." for path in files)
    return Reply(f"{answer}\n", lambda: answer, notes, csv=answer.to_csv)


COMPENSATE = Verb(
    compensate,
    _reply,
    """Say how much friction a controller may compensate.

    With more than that, the device moves on its own. The answer covers the
    uncertainty of the fit and the scatter between mountings, and says how much
    friction a hand still feels.

      karnopp  a torque in the direction of motion, fed forward outside a dead zone
      active   the torque measured at the joint, fed back

    One torque for all bends must suit the bend with the least friction; by bend it
    may be more. What the fit does not determine is asked for by name in device.toml;
    datasets/haptic-teleoperation has one.
    """,
    json="Print as JSON.",
    csv="Print all bends as CSV.",
    warns=True,
    needs_coefficients=True,
)
