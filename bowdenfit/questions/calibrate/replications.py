"""Replications and their file: one line a replication, written as it ends, so that nothing is lost."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from bowdenfit.errors import StoreError
from bowdenfit.inference.engines import JOBS_FOLDER
from bowdenfit.inputs import damage_as
from bowdenfit.outputs import open_in_place, write_text
from bowdenfit.results.folder import (
    DETAILS_TEXT,
    FIGURES,
    REPLICATIONS,
    REPORT,
    SUMMARY_TEXT,
    folder_to_write,
    holds_only_run_files,
    read_text,
    refuse_invalid_seed,
    remove_partial,
    remove_run_files,
)
from bowdenfit.results.serialization import deserialize, serialize

CALIBRATION = "calibration.json"
# Everything that a calibration writes.
_FILES, _FOLDERS = (CALIBRATION, SUMMARY_TEXT, DETAILS_TEXT, REPORT, REPLICATIONS), (FIGURES, JOBS_FOLDER)
_FINGERPRINT_WORDS = {
    "description": "the description",
    "sha256": "an input file",
    "seed": "the seed",
    "assumed": "what is assumed",
    "truths": "what is stated of the truth",
}


@dataclass(frozen=True)
class RankedTruth:
    """Truth and posterior of one quantity; of a parameter in z, where its prior is a standard normal.

    Args:
        truth: True values of the simulated readings.
        mean: Posterior mean.
        sd: Posterior standard deviation.
        rank: Share of the posterior below the truth; uniform between 0 and 1 if all is right.
    """

    truth: float
    mean: float
    sd: float
    rank: float


@dataclass(frozen=True)
class Replication:
    """Result of one replication.

    Args:
        number: Its number.
        redrawn: Why tables were drawn again, with how many were.
        reasons: Why its draws should not be trusted; empty if they may.
        ranked: By quantity; empty where the fit failed.
        seconds: Time of the fit, averaged over those that were fitted together.
        steps: Steps of each walker.
        engine: Engine that fitted it: weighted draws ("laplace"), "ensembles" or "nuts".
    """

    number: int
    redrawn: dict[str, int]
    reasons: tuple[str, ...]
    ranked: dict[str, RankedTruth]
    seconds: float
    steps: int = 0
    engine: str = ""


def rank_truth(truth: float, draws: np.ndarray, tie: float = 0.0) -> RankedTruth:
    """Rank the truth among the draws; of draws equal to it the share `tie` counts as below."""
    rank = float(np.mean(draws < truth) + tie * np.mean(draws == truth))
    return RankedTruth(truth, float(np.mean(draws)), float(np.std(draws)), rank)


def open_replications(
    folder: Path, fingerprint: Mapping[str, Any], resume: bool, force: bool
) -> dict[int, Replication]:
    """Read the replications that a folder holds already, and make it ready for more.

    Args:
        folder: The results folder.
        fingerprint: Plan and seed that identify the calibration.
        resume: Whether to go on with what is there.
        force: Whether to replace it.

    Raises:
        StoreError: The folder holds something else, or what it holds was made of something else.
    """
    path = folder / REPLICATIONS
    if resume:
        return _read_replications(path, fingerprint)
    unused = _is_unused(folder)
    if path.exists() and not (force or unused):
        raise StoreError(f"{folder} holds a calibration already; go on with --resume, or start over with --force.")
    if not holds_only_run_files(folder, {*_FILES, *_FOLDERS}):
        raise StoreError(f"{folder} exists and holds no calibration; name another with --output.")
    if not (force or unused or holds_only_run_files(folder, ())):
        raise StoreError(
            f"{folder} holds what is left of a calibration that was ended; add --force to replace it, or name another with "
            "--output."
        )
    with folder_to_write(folder):
        remove_run_files(folder, _FILES, _FOLDERS)
        write_text(path, json.dumps(dict(fingerprint)) + "\n")
    return {}


def _is_unused(folder: Path) -> bool:
    """Whether a calibration was begun in a folder that failed before its first replication, so that nobody loses anything."""
    path = folder / REPLICATIONS
    return (
        holds_only_run_files(folder, (REPLICATIONS, JOBS_FOLDER))
        and path.is_file()
        and path.read_bytes().count(b"\n") == 1
    )


def read_seed(folder: Path) -> int:
    """Read the seed of the calibration in a folder.

    Raises:
        StoreError: There is none.
    """
    try:
        seed = _read_lines(folder / REPLICATIONS)[0]["seed"]
        refuse_invalid_seed(seed)
        return int(seed)
    except (KeyError, TypeError, ValueError):
        raise _damaged_error(folder / REPLICATIONS) from None


def append_replication(folder: Path, replication: Replication) -> None:
    """Add a finished replication to the file of a folder."""
    with folder_to_write(folder), open_in_place(folder / REPLICATIONS, "a", encoding="utf-8") as file:
        file.write(json.dumps(serialize(replication)) + "\n")


def _read_replications(path: Path, fingerprint: Mapping[str, Any]) -> dict[int, Replication]:
    earlier, *pages = _read_lines(path)
    changed = [name for name in _FINGERPRINT_WORDS if earlier.get(name, {}) != fingerprint.get(name, {})]
    if changed:
        raise StoreError(
            f"{path.parent} cannot be resumed because {_FINGERPRINT_WORDS[changed[0]]} changed since; undo the change, "
            "or start over with "
            "--force."
        )
    # A line that was being written when the program was stopped is made again.
    with folder_to_write(path.parent):
        remove_partial(path.parent)
        write_text(path, "".join(json.dumps(line) + "\n" for line in (earlier, *pages)))
    with damage_as(_damaged_error(path)):
        replications = [deserialize(Replication, page) for page in pages]
        if not (
            all(map(_is_valid, replications))
            and len({frozenset(replication.ranked) for replication in replications if replication.ranked}) <= 1
        ):
            raise ValueError("something else was kept")
        return {replication.number: replication for replication in replications}


def _is_valid(replication: Replication) -> bool:
    """Whether a replication that was read is one that was kept."""
    counts = (replication.number, replication.steps, *replication.redrawn.values())
    texts = (replication.engine, *replication.reasons)
    good = all(type(count) is int and count >= 0 for count in counts) and all(isinstance(text, str) for text in texts)
    return (
        good
        and bool(replication.ranked or replication.reasons)
        and all(0 <= ranked_truth.rank <= 1 for ranked_truth in replication.ranked.values())
    )


def _read_lines(path: Path) -> list[dict[str, Any]]:
    """Return the whole lines of a file of replications, the fingerprint first."""
    if not path.exists():
        raise StoreError(f"{path.parent} holds no calibration to resume; leave --resume out.")
    text = read_text(path)
    complete = text[: text.rfind("\n") + 1].splitlines()
    try:
        lines = [json.loads(line) for line in complete]
        return [dict(lines[0]), *({"engine": "", **page, "redrawn": page["redrawn"]} for page in lines[1:])]
    except (ValueError, IndexError, KeyError, TypeError, RecursionError):
        raise _damaged_error(path) from None


def _damaged_error(path: Path) -> StoreError:
    return StoreError(f"{path} is damaged and cannot be resumed; start over with --force.")
