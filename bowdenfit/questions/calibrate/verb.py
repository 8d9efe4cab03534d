"""Many replications of one data set, each kept as soon as it is done, and what they say together."""

import json
import secrets
import shutil
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Unpack

from cyclopts import Parameter

from bowdenfit.arguments import DATASET, HIDDEN, LARGEST_SEED, PATH, TEXTS, Output, Seed, read_first, whole_number
from bowdenfit.inference.resources import refuse_low_memory
from bowdenfit.reading import Reading, read
from bowdenfit.results.folder import REPLICATIONS
from bowdenfit.verb import Reply, Verb, Watch, show_progress_bar

if TYPE_CHECKING:
    from bowdenfit.dataset import Dataset
    from bowdenfit.questions.calibrate.answer import Calibration
    from bowdenfit.questions.calibrate.replication import Replication
    from bowdenfit.questions.calibrate.workbench import CalibrationPlan

NOT_CALIBRATED = 3
Report = Callable[[int, int], None]
_WORKERS = "four at most of the cores; 16 jobs of Slurm"


@read_first
def calibrate(
    dataset: Annotated["str | Path | Dataset", DATASET, PATH],
    *,
    replications: Annotated[int, Parameter(alias="-n", metavar="NUMBER"), whole_number(2)] = 200,
    engine: Annotated["str | Executor", Parameter(metavar="ENGINE")] = "local",
    workers: Annotated[
        int | None, Parameter(alias="-j", metavar="NUMBER", show_default=_WORKERS), whole_number(1)
    ] = None,
    output: Annotated[Output, Parameter(show_default="fits/calibration/NAME OF DATASET")] = None,
    assume: Annotated[Sequence[str], Parameter(metavar="KEY=VALUE"), TEXTS] = (),
    truth: Annotated[str | Path | None, Parameter(metavar="FILE"), PATH] = None,
    seed: Annotated[Seed, Parameter(show_default="random, and recorded")] = None,
    resume: bool = False,
    force: bool = False,
    progress: Annotated[Report | None, HIDDEN] = None,
    **reading: Unpack[Reading],
) -> "Calibration":
    """Simulation-based calibration: whether intervals of this description hold the truth as often as they claim.

    True values are drawn from the priors, tables of the same shape are simulated with them and fitted, and the truth is
    ranked among the draws. Priors that look at the data are those of the data set as measured. Every replication is kept.

    Truths that are stated instead (`truth`) show what calibration from the priors cannot see, a prior that is wrong for such a
    cable: intervals of coefficients and optimum must hold them as often as they claim; ranks need not be uniform.

    Args:
        dataset: See `bowdenfit.read`; its keywords are taken too.
        replications: How many.
        engine: local (this process), dask://HOST:PORT or slurm; or any `concurrent.futures.Executor`.
        workers: Cores that are used, or pieces of work at a time elsewhere.
        output: Results folder.
        assume: Fit with this setting changed, while simulating without: what a wrong assumption costs; may be repeated.
        truth: True values that do not come from the priors: a TOML file with a number or a range for each parameter, such as
            mu1 = 0.1 and tau = [0.002, 0.3]. Ranges of positive numbers are drawn log-uniformly, others uniformly.
        seed: Seed of everything random.
        resume: Go on with an interrupted calibration, or add replications.
        force: Replace an earlier calibration in the results folder.
        progress: Called after every replication with how many are done, and of how many; notebooks show a bar if omitted.
        reading: Keywords of `bowdenfit.read`.

    Raises:
        BowdenfitError: What is wrong, in a sentence; a data set that cannot be replicated is refused.
    """
    refuse_low_memory()
    folder = _folder(output, resume)
    plan = _plan(_stated_and_assumed(dataset, reading, assume), _seed(folder, seed, resume), truth)

    import bowdenfit.questions.calibrate.words  # noqa: F401  (what the answer says of itself)
    from bowdenfit.questions.calibrate.findings import summarize_replications
    from bowdenfit.questions.calibrate.store import open_replications
    from bowdenfit.results.folder import reserve_folder

    quantities = _list_quantities(plan)
    with reserve_folder(folder):
        done = {} if folder is None else open_replications(folder, _fingerprint(plan, assume), resume, force)
        with show_progress_bar(WATCH, progress) as show:
            _replicate(engine, workers, plan, done, replications, folder, show)
        calibration = summarize_replications(tuple(done.values()), quantities, assumed=tuple(assume), **_labels(plan))
        _write(calibration, folder)
    return calibration


def _list_quantities(plan: "CalibrationPlan") -> Any:
    import jax

    from bowdenfit.questions.calibrate.quantities import list_quantities

    with jax.enable_x64(True):
        return list_quantities(plan)


def _labels(plan: "CalibrationPlan") -> dict[str, Any]:
    """What the answer says of a plan."""
    truths = tuple(truth.text for truth in plan.truths)
    return {"name": plan.stated.description.name, "seed": plan.seed, "truths": truths}


def _folder(output: str | Path | None, resume: bool) -> Path | None:
    from bowdenfit.errors import UsageError

    if resume and output is None:
        raise UsageError("--resume needs the results folder of a calibration; name it with --output.")
    return Path(output) if output is not None else None


def _plan(sets: "tuple[Dataset, Dataset]", seed: int, truth: str | Path | None) -> "CalibrationPlan":
    """What is replicated, with the truths of a file."""
    import jax

    from bowdenfit.model import build_model
    from bowdenfit.questions.calibrate.truths import parse_truths, read_truths
    from bowdenfit.questions.calibrate.workbench import CalibrationPlan

    if truth is None:
        return CalibrationPlan(*sets, seed)
    page = read_truths(Path(truth))
    with jax.enable_x64(True):
        return CalibrationPlan(*sets, seed, parse_truths(page, build_model(sets[0]).space, str(truth)))


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
    engine: "str | Executor",
    workers: int | None,
    plan: "CalibrationPlan",
    done: "dict[int, Replication]",
    replications: int,
    folder: Path | None,
    progress: Report | None,
) -> None:
    """Do what is not done yet, and keep each as it ends."""
    from bowdenfit.inference.engines import JOBS_FOLDER, open_engine
    from bowdenfit.questions.calibrate.pieces import CalibrationJob, run_piece, split_into_pieces
    from bowdenfit.questions.calibrate.store import append_replication

    job = CalibrationJob(plan, (workers or 0) if engine == "local" else 0)
    missing = [number for number in range(replications) if number not in done]
    with open_engine(engine, workers, folder and folder / JOBS_FOLDER) as opened:
        for piece in opened.results(run_piece, split_into_pieces(job, missing, opened.workers)):
            for replication in piece:
                done[replication.number] = replication
                if folder is not None:
                    append_replication(folder, replication)
                if progress is not None:
                    progress(len(done), max(replications, len(done)))
    if folder is not None:
        shutil.rmtree(folder / JOBS_FOLDER, ignore_errors=True)


def _seed(folder: Path | None, seed: int | None, resume: bool) -> int:
    """The seed: as stated, else that of the calibration to go on with, else a new one."""
    if seed is not None:
        return seed
    if folder is None or not resume:
        return secrets.randbelow(LARGEST_SEED)
    from bowdenfit.questions.calibrate.store import read_seed

    return read_seed(folder)


def _fingerprint(plan: "CalibrationPlan", assumptions: Sequence[str]) -> dict[str, Any]:
    """What must not change between an interrupted calibration and its continuation."""
    page = {
        "description": plan.stated.description.to_json(),
        "sha256": plan.stated.sha256,
        "seed": plan.seed,
        "assumed": list(assumptions),
        "truths": {truth.parameter.name: [truth.low, truth.high] for truth in plan.truths},
    }
    return dict(json.loads(json.dumps(page)))


def _write(calibration: "Calibration", folder: Path | None) -> None:
    """Summary, details, figures, report, and calibration.json last; nothing without a folder."""
    if folder is None:
        return
    from bowdenfit.questions.calibrate.figures import draw_calibration
    from bowdenfit.questions.calibrate.sections import calibration_page
    from bowdenfit.questions.calibrate.store import CALIBRATION
    from bowdenfit.questions.calibrate.words import calibration_text, details_text
    from bowdenfit.questions.writing import write_page
    from bowdenfit.results.folder import DETAILS_TEXT, FIGURES, REPORT, SUMMARY_TEXT, folder_to_write, write_text
    from bowdenfit.results.serialization import plain_data

    with folder_to_write(folder):
        (folder / CALIBRATION).unlink(missing_ok=True)  # of fewer replications
        write_text(folder / SUMMARY_TEXT, calibration_text(calibration))
        write_text(folder / DETAILS_TEXT, details_text(calibration))
        draw_calibration(calibration, folder / FIGURES)
        write_page(calibration_page(calibration), folder / FIGURES, folder / REPORT)
        write_text(folder / CALIBRATION, json.dumps(plain_data(calibration), indent=1, allow_nan=False) + "\n")


def _reply(calibration: "Calibration", options: dict[str, Any]) -> Reply:
    from bowdenfit.questions.calibrate.words import calibration_text

    exit_code = 0 if calibration.is_calibrated else NOT_CALIBRATED
    return Reply(
        calibration_text(calibration),
        lambda: calibration,
        (f"Wrote {options['output']}.",),
        exit_code,
        calibration.to_csv,
    )


def _show(bar: Any, done: int, total: int) -> None:
    bar.total, bar.n = total, done
    bar.refresh()


WATCH = Watch(REPLICATIONS, "what is done is kept in", {"unit": "replication", "desc": "calibrating"}, _show)
VERB = Verb(
    calibrate,
    _reply,
    """Test whether intervals hold the truth as often as they say.

    This is simulation-based calibration of DATASET, of this very description and
    for tables like these. Again and again, true values are drawn from the priors,
    tables like the measured ones (the same lengths, runs, loads and wrap angles)
    are simulated with them and fitted. Then intervals must hold the truth as often
    as they claim, for every parameter, the optimal length and the efficiency there.
    What was measured enters only by the design.

    With --truth FILE the true values are those of a file, not of the priors:
    whether a default prior suits cables like that.

    It takes a fraction of a second a replication; recordings take some seconds.
    Exit code 3: not calibrated.
    """,
    json="Print calibration.json instead of the summary for people.",
    csv="Print the quantities as CSV, one a row.",
    results="fits/calibration",
    watch=WATCH,
)
