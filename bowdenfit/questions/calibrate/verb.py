"""The verb `calibrate`: whether the intervals of a description contain the truth as often as they claim."""

import secrets
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Unpack

from cyclopts import Parameter

from bowdenfit.arguments import DATASET, HIDDEN, LARGEST_SEED, PATH, TEXTS, Output, Seed, read_first, whole_number
from bowdenfit.errors import UsageError
from bowdenfit.inference.resources import refuse_low_memory
from bowdenfit.questions import calibrate as room
from bowdenfit.reading import Reading, read
from bowdenfit.results.folder import REPLICATIONS
from bowdenfit.stage_bar import Watch, show_progress_bar
from bowdenfit.verb import Reply, Verb

if TYPE_CHECKING:
    from bowdenfit.dataset import Dataset
    from bowdenfit.frames import Frame
    from bowdenfit.questions.calibrate.answer import Calibration

NOT_CALIBRATED = 3
Report = Callable[[int, int], None]
_WORKERS = "four at most of the cores; 16 jobs of Slurm"


@read_first
def calibrate(
    dataset: Annotated["str | Path | Dataset | Frame", DATASET, PATH],
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
    """Simulation-based calibration: whether intervals of this description contain the truth as often as they claim.

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
        seed: Random seed.
        resume: Go on with an interrupted calibration, or add replications.
        force: Replace an earlier calibration in the results folder.
        progress: Called after every replication with how many are done, and of how many; notebooks show a bar if omitted.
        reading: Keywords of `bowdenfit.read`.

    Raises:
        BowdenfitError: What is wrong, in a sentence; a data set that cannot be replicated is refused.
    """
    refuse_low_memory()
    if resume and output is None:
        raise UsageError("--resume needs the results folder of a calibration; name it with --output.")
    folder = Path(output) if output is not None else None
    stated, assumed = _read_stated_and_assumed(dataset, reading, assume)
    if seed is None:
        seed = room.read_seed(folder) if folder is not None and resume else secrets.randbelow(LARGEST_SEED)
    plan = room.make_plan(stated, assumed, seed, truth)
    quantities = room.list_quantities(plan)
    with room.open_calibration(folder, plan, assume, resume, force) as done:
        with show_progress_bar(WATCH, progress) as show:
            room.replicate_missing(plan, done, replications, engine, workers, folder, show)
        calibration = room.summarize_calibration(plan, done.values(), quantities, assume)
        if folder is not None:
            room.write_calibration(calibration, folder)
    return calibration


def _read_stated_and_assumed(
    dataset: "str | Path | Dataset | Frame", reading: Reading, assume: Sequence[str]
) -> "tuple[Dataset, Dataset]":
    """Read the data set as it is described, which is simulated, and as the fits take it to be."""
    stated = read(dataset, **reading)
    if not assume:
        return stated, stated
    if not isinstance(dataset, str | Path):
        raise UsageError("settings can be assumed of a data set in a folder only; name the folder.")
    changes: Reading = {**reading, "settings": [*reading.get("settings", ()), *assume]}
    return stated, read(dataset, **changes)


def _reply(calibration: "Calibration", options: dict[str, Any]) -> Reply:
    exit_code = 0 if calibration.is_calibrated else NOT_CALIBRATED
    return Reply(
        f"{calibration}\n",
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
    """Test whether intervals contain the truth as often as they claim.

    This is simulation-based calibration of the description in DATASET. Again and
    again, true values are drawn from the priors, and tables like the measured ones
    (the same lengths, runs, loads and wrap angles) are simulated with them and
    fitted. Then intervals must contain the truth as often as they claim, for every
    parameter, the optimal length and the efficiency there. The measured values
    themselves are not used, only where they were taken.

    With --truth FILE the true values are taken from a file instead of the priors,
    to test whether a default prior suits such cables.

    A replication takes a fraction of a second, with recordings some seconds.
    Exit code 3: not calibrated.
    """,
    json="Print calibration.json instead of the text summary.",
    csv="Print the quantities as CSV, one a row.",
    results="fits/calibration",
    watch=WATCH,
)
