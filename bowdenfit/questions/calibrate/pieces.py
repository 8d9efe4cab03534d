"""Replications as pieces of work that any engine does: here, in other processes, or on a cluster."""

import hashlib
import pickle
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache

from bowdenfit.inference.engines import refuse_other_versions, versions
from bowdenfit.questions.calibrate.refit import RANKS, Laboratory
from bowdenfit.questions.calibrate.replication import Replication
from bowdenfit.questions.calibrate.workbench import TOGETHER, Plan, Workbench

_LEAST, _EACH = 16, 4  # replications of a piece, so that its programs pay; pieces of a worker, so that all end together


@dataclass(frozen=True)
class Asked:
    """A plan; two that say the same are the same.

    Args:
        plan: What is replicated.
        threads: In each process; 0 for one a core.
        key: Made from the plan.
    """

    plan: Plan = field(compare=False)
    threads: int = 0
    key: str = field(default="", init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "key", hashlib.sha256(pickle.dumps(self.plan)).hexdigest())


@dataclass(frozen=True)
class Numbered:
    """Replications of a plan.

    Args:
        asked: The plan.
        numbers: Which; each is the same whatever else is run.
        versions: Where the work comes from.
    """

    asked: Asked
    numbers: tuple[int, ...]
    versions: dict[str, str]


def pieces_of(asked: Asked, numbers: Sequence[int], workers: int) -> list[Numbered]:
    """The work, cut so that so many workers end at about the same time.

    Args:
        asked: The plan.
        numbers: Of the replications.
        workers: At a time; one gets as much at once as is fitted together.
    """
    size = TOGETHER if workers == 1 else min(max(-(-len(numbers) // (_EACH * workers)), _LEAST), TOGETHER)
    return [Numbered(asked, tuple(numbers[i : i + size]), versions()) for i in range(0, len(numbers), size)]


def replicated(piece: Numbered) -> list[Replication]:
    """What comes of each replication.

    Args:
        piece: The work.

    Raises:
        UsageError: The work comes from a program of other versions, or hardly any tables look like ones from a bench.
    """
    refuse_other_versions(piece.versions)
    return list(_bench(piece.asked).replications(piece.numbers))


@lru_cache(maxsize=1)
def _bench(asked: Asked) -> Workbench:
    """What serves all pieces of one plan, with what it has compiled."""
    return Workbench(asked.plan, Laboratory(replace(RANKS, threads=asked.threads)))
