"""Replications as pieces of work that any engine does: here, in other processes, or on a cluster."""

import hashlib
import pickle
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache

from bowdenfit.inference.engines import refuse_other_versions, versions
from bowdenfit.questions.calibrate.refit import RANK_SETTINGS, BatchFitter
from bowdenfit.questions.calibrate.replication import Replication
from bowdenfit.questions.calibrate.workbench import BATCH_SIZE, CalibrationPlan, Replicator

_MIN_PIECE, _PIECES_PER_WORKER = (
    16,
    4,
)  # replications of a piece, so that its programs pay; pieces of a worker, so that all end together


@dataclass(frozen=True)
class CalibrationJob:
    """A plan; two that say the same are the same.

    Args:
        plan: What is replicated.
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
    """The work, cut so that so many workers end at about the same time.

    Args:
        job: The plan.
        numbers: Of the replications.
        workers: At a time; one gets as much at once as is fitted together.
    """
    size = (
        BATCH_SIZE
        if workers == 1
        else min(max(-(-len(numbers) // (_PIECES_PER_WORKER * workers)), _MIN_PIECE), BATCH_SIZE)
    )
    return [ReplicationPiece(job, tuple(numbers[i : i + size]), versions()) for i in range(0, len(numbers), size)]


def run_piece(piece: ReplicationPiece) -> list[Replication]:
    """What comes of each replication.

    Args:
        piece: The work.

    Raises:
        UsageError: The work comes from a program of other versions, or hardly any tables look like ones from a bench.
    """
    refuse_other_versions(piece.versions)
    return list(_replicator(piece.job).replicate(piece.numbers))


@lru_cache(maxsize=1)
def _replicator(job: CalibrationJob) -> Replicator:
    """What serves all pieces of one plan, with what it has compiled."""
    return Replicator(job.plan, BatchFitter(replace(RANK_SETTINGS, threads=job.threads)))
