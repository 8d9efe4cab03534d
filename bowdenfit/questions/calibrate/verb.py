"""Many replications of one data set over all cores, each kept as soon as it is done, and what they say together."""

import json
import os
import secrets
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bowdenfit.dataset import Dataset
from bowdenfit.errors import DescriptionError, UsageError
from bowdenfit.questions.calibrate.processes import replicated

if TYPE_CHECKING:
    from bowdenfit.questions.calibrate.answer import Calibration
    from bowdenfit.questions.calibrate.replication import Plan

Report = Callable[[int, int], None]


def calibrate(
    dataset: str | Path | Dataset,
    *,
    replications: int = 200,
    workers: int | None = None,
    output: str | Path | None = None,
    assume: Sequence[str] = (),
    seed: int | None = None,
    resume: bool = False,
    force: bool = False,
    progress: Report | None = None,
    **reading: Any,
) -> "Calibration":
    """Simulation-based calibration: whether intervals of this description hold the truth as often as they claim.

    True values are drawn from the priors, tables of the same shape are simulated with them and fitted, and the truth is
    ranked among the draws. Priors that look at the data (the level of a curve) are those of the data set as measured.

    Args:
        dataset: See `bowdenfit.read`; its keywords are taken too.
        replications: How many.
        workers: How many processes; one a core if omitted. With more than one, the calling program must guard its start
            with `if __name__ == "__main__"`.
        output: Results folder; every replication is written as it ends. Nothing is written if omitted.
        assume: Settings of the description that the fits change, such as "prior.tau.fixed=0.001", while tables are simulated
            without: what a wrong assumption costs.
        seed: Seed of everything random; drawn and recorded if omitted.
        resume: Go on with an interrupted calibration in `output`, or add replications.
        force: Replace a calibration in `output`.
        progress: Called after every replication with how many are done, and of how many.
        reading: Keywords of `bowdenfit.read`.

    Raises:
        BowdenfitError: What is wrong, in a sentence; a data set that cannot be replicated is refused.
    """
    from bowdenfit.verbs import read

    folder = Path(output) if output is not None else None
    if resume and folder is None:
        raise UsageError("--resume needs the results folder of a calibration; name it with --output.")
    stated = read(dataset, **reading)
    settings = {**reading, "settings": [*reading.get("settings", ()), *assume]}
    if assume and isinstance(dataset, Dataset):
        raise UsageError("settings can be assumed of a data set in a folder only; name the folder.")
    assumed = read(dataset, **settings) if assume else stated
    seed = _seed(folder, seed, resume)
    import jax

    from bowdenfit.questions.calibrate.answer import findings
    from bowdenfit.questions.calibrate.replication import Plan
    from bowdenfit.questions.calibrate.store import begun, keep

    plan = Plan(stated, assumed, seed)
    with jax.enable_x64(True):
        symbols = checked(plan)
    done = {} if folder is None else begun(folder, _fingerprint(plan, assume), resume, force)
    missing = [number for number in range(replications) if number not in done]
    for each in replicated(plan, missing, workers or os.cpu_count() or 1):
        done[each.number] = each
        if folder is not None:
            keep(folder, each)
        if progress is not None:
            progress(len(done), max(replications, len(done)))
    found = findings(tuple(done.values()), symbols, name=stated.description.name, assumed=tuple(assume), seed=seed)
    if folder is not None:
        _write(found, folder)
    return found


def _seed(folder: Path | None, seed: int | None, resume: bool) -> int:
    """The seed: as stated, else that of the calibration to go on with, else a new one."""
    from bowdenfit.run.storing import LARGEST_SEED

    if seed is not None:
        return seed
    if folder is None or not resume:
        return secrets.randbelow(LARGEST_SEED)
    from bowdenfit.questions.calibrate.store import seed_of

    return seed_of(folder)


def checked(plan: "Plan") -> dict[str, str]:
    """Symbols of what will be ranked, once it is clear that the data set can be replicated.

    Raises:
        DescriptionError, DatasetError, UsageError: It cannot; says why.
    """
    from bowdenfit.kinds.drawn_readings import detection_limit
    from bowdenfit.kinds.recordings.simulation import refuse_saturated
    from bowdenfit.model import build_model
    from bowdenfit.results.record import OPTIMAL_EFFICIENCY, OPTIMAL_LENGTH

    stated, assumed = plan.stated.description, plan.assumed.description
    if plan.stated.measurements.angles is not None:
        detection_limit(stated, plan.stated.measurements.angles)
    if plan.stated.measurements.recordings is not None:
        refuse_saturated(plan.stated.measurements.recordings)
    if stated.angle_columns != assumed.angle_columns or _kinds(plan.stated) != _kinds(plan.assumed):
        raise DescriptionError(
            "--assume changes which tables or columns the data set has; the fits must read what is simulated, so change "
            "only how it is modeled."
        )
    space = build_model(plan.assumed).space
    if not space.size:
        raise UsageError(
            "every parameter of the description is fixed, so there is nothing to calibrate; leave one free."
        )
    symbols = {p.name: p.symbol for p in space.free}
    return symbols | {OPTIMAL_LENGTH: r"$l^*$", OPTIMAL_EFFICIENCY: r"$\eta^*$"}


def _kinds(dataset: Dataset) -> list[str]:
    tables = dataset.measurements
    return [name for name, table in vars(tables).items() if name != "remarks" and table is not None]


def _fingerprint(plan: "Plan", assumptions: Sequence[str]) -> dict[str, Any]:
    """What must not change between an interrupted calibration and its continuation."""
    page = {
        "description": plan.stated.description.to_json(),
        "sha256": plan.stated.sha256,
        "seed": plan.seed,
        "assumed": list(assumptions),
    }
    return dict(json.loads(json.dumps(page)))


def _write(found: "Calibration", folder: Path) -> None:
    """Summary, figures, and calibration.json last."""
    from bowdenfit.questions.calibrate.figure import draw_calibration
    from bowdenfit.questions.calibrate.store import CALIBRATION
    from bowdenfit.questions.calibrate.words import calibration_text
    from bowdenfit.results.folder import FIGURES, SUMMARY_TEXT, write_text

    write_text(folder / SUMMARY_TEXT, calibration_text(found))
    if found.quantities:
        draw_calibration(found, folder / FIGURES)
    write_text(folder / CALIBRATION, json.dumps(found.page(), indent=1) + "\n")
