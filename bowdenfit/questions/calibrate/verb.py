"""Many replications of one data set over all cores, each kept as soon as it is done, and what they say together."""

import json
import os
import secrets
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Unpack

from bowdenfit.reading import Reading, read, refuse_unknown
from bowdenfit.results.folder import REPLICATIONS
from bowdenfit.verb import LARGEST_SEED, Argument, Option, Output, Reply, Verb, Watch

if TYPE_CHECKING:
    from bowdenfit.dataset import Dataset
    from bowdenfit.questions.calibrate.answer import Calibration
    from bowdenfit.questions.calibrate.replication import Plan, Replication

NOT_CALIBRATED = 3
Report = Callable[[int, int], None]


def calibrate(
    dataset: Annotated["str | Path | Dataset", Argument("DATASET")],
    *,
    replications: Annotated[int, Option(("-n",), least=2)] = 200,
    workers: Annotated[int | None, Option(("-j",), least=1, default="one a core")] = None,
    output: Annotated[Output, Option(("-o",), default="fits/calibration/NAME OF DATASET")] = None,
    assume: Annotated[Sequence[str], Option(metavar="KEY=VALUE")] = (),
    seed: Annotated[int | None, Option(least=0, most=LARGEST_SEED, default="drawn, and recorded")] = None,
    resume: Annotated[bool, Option()] = False,
    force: Annotated[bool, Option()] = False,
    progress: Report | None = None,
    **reading: Unpack[Reading],
) -> "Calibration":
    """Simulation-based calibration: whether intervals of this description hold the truth as often as they claim.

    True values are drawn from the priors, tables of the same shape are simulated with them and fitted, and the truth is
    ranked among the draws. Priors that look at the data (the level of a curve) are those of the data set as measured.
    Every replication is written as it ends, if `output` says where. With more than one worker, the calling program must
    guard its start with `if __name__ == "__main__"`.

    Args:
        dataset: See `bowdenfit.read`; its keywords are taken too.
        replications: How many.
        workers: Processes.
        output: Results folder.
        assume: Fit with this setting changed, while simulating without: what a wrong assumption costs; may be repeated.
        seed: Seed of everything random.
        resume: Go on with an interrupted calibration, or add replications.
        force: Replace an earlier calibration in the results folder.
        progress: Called after every replication with how many are done, and of how many.
        reading: Keywords of `bowdenfit.read`.

    Raises:
        BowdenfitError: What is wrong, in a sentence; a data set that cannot be replicated is refused.
    """
    from bowdenfit.errors import UsageError

    refuse_unknown(calibrate, reading)
    folder = Path(output) if output is not None else None
    if resume and folder is None:
        raise UsageError("--resume needs the results folder of a calibration; name it with --output.")
    stated, assumed = _stated_and_assumed(dataset, reading, assume)
    seed = _seed(folder, seed, resume)
    import jax

    from bowdenfit.questions.calibrate.answer import findings
    from bowdenfit.questions.calibrate.replication import Plan
    from bowdenfit.questions.calibrate.store import open_replications

    plan = Plan(stated, assumed, seed)
    with jax.enable_x64(True):
        symbols = symbols_of(plan)
    done = {} if folder is None else open_replications(folder, _fingerprint(plan, assume), resume, force)
    _replicate(plan, done, replications, workers, folder, progress)
    found = findings(tuple(done.values()), symbols, name=stated.description.name, assumed=tuple(assume), seed=seed)
    if folder is not None:
        _write(found, folder)
    return found


def _stated_and_assumed(
    dataset: "str | Path | Dataset", reading: Reading, assume: Sequence[str]
) -> "tuple[Dataset, Dataset]":
    """The data set as it is described, which is simulated, and as the fits take it to be."""
    from bowdenfit.dataset import Dataset
    from bowdenfit.errors import UsageError

    stated = read(dataset, **reading)
    if not assume:
        return stated, stated
    if isinstance(dataset, Dataset):
        raise UsageError("settings can be assumed of a data set in a folder only; name the folder.")
    changes: Reading = {**reading, "settings": [*reading.get("settings", ()), *assume]}
    return stated, read(dataset, **changes)


def _replicate(
    plan: "Plan",
    done: "dict[int, Replication]",
    replications: int,
    workers: int | None,
    folder: Path | None,
    progress: Report | None,
) -> None:
    """Do what is not done yet, and keep each as it ends."""
    from bowdenfit.questions.calibrate.processes import replicate
    from bowdenfit.questions.calibrate.store import keep

    missing = [number for number in range(replications) if number not in done]
    for each in replicate(plan, missing, workers or os.cpu_count() or 1):
        done[each.number] = each
        if folder is not None:
            keep(folder, each)
        if progress is not None:
            progress(len(done), max(replications, len(done)))


def _seed(folder: Path | None, seed: int | None, resume: bool) -> int:
    """The seed: as stated, else that of the calibration to go on with, else a new one."""
    if seed is not None:
        return seed
    if folder is None or not resume:
        return secrets.randbelow(LARGEST_SEED)
    from bowdenfit.questions.calibrate.store import seed_of

    return seed_of(folder)


def symbols_of(plan: "Plan") -> dict[str, str]:
    """Symbols of what will be ranked, once it is clear that the data set can be replicated.

    Raises:
        DescriptionError, DatasetError, UsageError: It cannot; says why.
    """
    from bowdenfit.errors import DescriptionError, UsageError
    from bowdenfit.kinds.terms import measured_kinds
    from bowdenfit.model import build_model
    from bowdenfit.results.record import OPTIMAL_EFFICIENCY, OPTIMAL_LENGTH

    stated, assumed = plan.stated.description, plan.assumed.description
    for kind, table in measured_kinds(plan.stated.measurements):
        kind.bench.check(stated, table)
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


def _kinds(dataset: "Dataset") -> list[str]:
    from bowdenfit.kinds import each_table

    return [kind.name for kind, _ in each_table(dataset.measurements)]


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
    from bowdenfit.results.plain import plain

    write_text(folder / SUMMARY_TEXT, calibration_text(found))
    if found.quantities:
        draw_calibration(found, folder / FIGURES)
    write_text(folder / CALIBRATION, json.dumps(plain(found), indent=1) + "\n")


def _reply(found: "Calibration", asked: dict[str, Any]) -> Reply:
    from bowdenfit.questions.calibrate.words import calibration_text

    exit_code = 0 if found.is_calibrated else NOT_CALIBRATED
    return Reply(calibration_text(found), lambda: found, (f"Wrote {asked['output']}.",), exit_code)


def _show(bar: Any, done: int, total: int) -> None:
    bar.total, bar.n = total, done
    bar.refresh()


VERB = Verb(
    calibrate,
    _reply,
    "Show that a description's intervals hold the truth as often as they say.",
    """Simulation-based calibration of DATASET: of this very description, for tables like these.

    Again and again, true values are drawn from the priors, tables like the measured ones (the same lengths, runs, loads and
    wrap angles) are simulated with them and fitted. Then intervals must hold the truth as often as they claim, for every
    parameter, the optimal length and the efficiency there. What was measured enters only by the design.

    Takes some seconds a replication and core. Exit code 3: not calibrated.
    """,
    json="Print calibration.json instead of the summary for people.",
    results="fits/calibration",
    watch=Watch(REPLICATIONS, "what is done is kept in", {"unit": "replication", "desc": "calibrating"}, _show),
)
