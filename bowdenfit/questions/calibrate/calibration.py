"""Running a calibration: its replications as pieces of work for any engine, each kept as it ends, and the results folder."""

import hashlib
import json
import pickle
import shutil
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

from bowdenfit.inference.engines import JOBS_FOLDER, installed_versions, open_engine, refuse_other_versions
from bowdenfit.outputs import write_text
from bowdenfit.questions.calibrate.answer import Calibration, QuantityLabel
from bowdenfit.questions.calibrate.plan import CalibrationPlan
from bowdenfit.questions.calibrate.rank_tests import summarize_replications
from bowdenfit.questions.calibrate.replications import CALIBRATION, Replication, append_replication, open_replications
from bowdenfit.questions.calibrate.replicator import BATCH_SIZE, RANK_SETTINGS, BatchFitter, Replicator
from bowdenfit.questions.calibrate.words import calibration_page, details_text, draw_calibration
from bowdenfit.questions.writing import write_page
from bowdenfit.results.folder import DETAILS_TEXT, FIGURES, REPORT, SUMMARY_TEXT, folder_to_write, reserve_folder
from bowdenfit.results.serialization import plain_data
from bowdenfit.stages import announce_stage

Report = Callable[[int, int], None]
# Judgements: a piece of so few replications does not repay the seconds in which its programs are compiled, and so many
# pieces a worker end at about the same time.
_MIN_PIECE, _PIECES_PER_WORKER = 16, 4


@contextmanager
def open_calibration(
    folder: Path | None, plan: CalibrationPlan, assumptions: Sequence[str], resume: bool, force: bool
) -> Iterator[dict[int, Replication]]:
    """Reserve a results folder, and yield the replications by number that it holds already.

    Args:
        folder: The results folder; None if nothing is kept.
        plan: Plan of the replications.
        assumptions: Settings that the fits assume.
        resume: Whether to go on with what is there.
        force: Whether to replace it.

    Raises:
        StoreError: The folder holds something else, or what it holds was made of something else.
    """
    with reserve_folder(folder):
        yield {} if folder is None else open_replications(folder, _make_fingerprint(plan, assumptions), resume, force)


def _make_fingerprint(plan: CalibrationPlan, assumptions: Sequence[str]) -> dict[str, Any]:
    """Return what must not change between an interrupted calibration and its continuation."""
    page = {
        "description": plan.stated.description.to_json(),
        "sha256": plan.stated.sha256,
        "seed": plan.seed,
        "assumed": list(assumptions),
        "truths": {truth.parameter.name: [truth.low, truth.high] for truth in plan.truths},
    }
    return dict(json.loads(json.dumps(page)))


def replicate_missing(
    plan: CalibrationPlan,
    done: dict[int, Replication],
    replications: int,
    engine: str | Executor,
    workers: int | None,
    folder: Path | None,
    progress: Report | None,
) -> None:
    """Run the replications that are not done yet, and keep each as it ends.

    Args:
        plan: Plan of the replications.
        done: Replications by number, to which the others are added.
        replications: How many there are to be.
        engine: Where they run, see `open_engine`.
        workers: Cores that are used, or pieces at a time elsewhere.
        folder: The results folder; None if nothing is kept.
        progress: Called after every replication with how many are done, and of how many.
    """
    job = CalibrationJob(plan, (workers or 0) if engine == "local" else 0)
    missing = [number for number in range(replications) if number not in done]
    announce_stage("compiling, and fitting the first replications")
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


def summarize_calibration(
    plan: CalibrationPlan,
    replications: Collection[Replication],
    quantities: Mapping[str, QuantityLabel],
    assumptions: Sequence[str],
) -> Calibration:
    """Return what the replications of a plan say together.

    Args:
        plan: Plan of the replications.
        replications: Replications with their ranks.
        quantities: Label of each quantity, see `list_quantities`.
        assumptions: Settings that the fits assumed.
    """
    return summarize_replications(
        tuple(replications),
        quantities,
        name=plan.stated.description.name,
        assumed=tuple(assumptions),
        truths=tuple(truth.text for truth in plan.truths),
        seed=plan.seed,
    )


def write_calibration(calibration: Calibration, folder: Path) -> None:
    """Write summary, details, figures, report, and calibration.json last.

    Args:
        calibration: The calibration.
        folder: The results folder.
    """
    with folder_to_write(folder):
        (folder / CALIBRATION).unlink(missing_ok=True)  # of fewer replications
        write_text(folder / SUMMARY_TEXT, f"{calibration}\n")
        write_text(folder / DETAILS_TEXT, details_text(calibration))
        draw_calibration(calibration, folder / FIGURES)
        write_page(calibration_page(calibration), folder / FIGURES, folder / REPORT)
        write_text(folder / CALIBRATION, json.dumps(plain_data(calibration), indent=1, allow_nan=False) + "\n")


@dataclass(frozen=True)
class CalibrationJob:
    """A plan as work for other processes; two with the same plan are equal.

    Args:
        plan: Plan of the replications.
        threads: In each process; 0 for one a core.
        key: Made from the plan.
    """

    plan: CalibrationPlan = field(compare=False)
    threads: int = 0
    key: str = field(default="", init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "key", hashlib.sha256(pickle.dumps(self.plan)).hexdigest())


@dataclass(frozen=True)
class ReplicationPiece:
    """Replications of a plan.

    Args:
        job: The plan.
        numbers: Which; each is the same whatever else is run.
        versions: Where the work comes from.
    """

    job: CalibrationJob
    numbers: tuple[int, ...]
    versions: dict[str, str]


def split_into_pieces(job: CalibrationJob, numbers: Sequence[int], workers: int) -> list[ReplicationPiece]:
    """Cut the work so that so many workers end at about the same time.

    Args:
        job: The plan.
        numbers: Numbers of the replications.
        workers: At a time; one gets as much at once as is fitted together.
    """
    size = (
        BATCH_SIZE
        if workers == 1
        else min(max(-(-len(numbers) // (_PIECES_PER_WORKER * workers)), _MIN_PIECE), BATCH_SIZE)
    )
    return [ReplicationPiece(job, tuple(numbers[i : i + size]), installed_versions()) for i in range(0, len(numbers), size)]


def run_piece(piece: ReplicationPiece) -> list[Replication]:
    """Run the replications of a piece.

    Args:
        piece: The work.

    Raises:
        UsageError: The work comes from a program of other versions, or hardly any tables look like ones from a bench.
    """
    refuse_other_versions(piece.versions)
    return list(_make_replicator(piece.job).replicate(piece.numbers))


@lru_cache(maxsize=1)
def _make_replicator(job: CalibrationJob) -> Replicator:
    """Return what serves all pieces of one plan, with what it has compiled."""
    return Replicator(job.plan, BatchFitter(replace(RANK_SETTINGS, threads=job.threads)))
