"""Results folder of a fleet: every finished piece of work is saved at once, so that an interrupted fleet can be resumed."""

import hashlib
import json
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from bowdenfit.addons.fleet.folder import FLEET_DRAWS, FLEET_PAGE, FleetDraws, read_fleet_draws
from bowdenfit.addons.fleet.pieces import PieceFit
from bowdenfit.errors import StoreError
from bowdenfit.inference.engines import JOBS_FOLDER
from bowdenfit.inputs import damage_as
from bowdenfit.outputs import write_text
from bowdenfit.results.folder import (
    SUMMARY_TEXT,
    folder_to_write,
    holds_only_run_files,
    read_page,
    refuse_invalid_seed,
    remove_partial,
    remove_run_files,
)
from bowdenfit.results.serialization import read_arrays, write_arrays
from bowdenfit.words import few, shown

PIECES_FOLDER, START_FILE = "kept", "begun.json"  # folder of pieces, and what they were made for
_FILES, _FOLDERS = (FLEET_PAGE, FLEET_DRAWS, SUMMARY_TEXT), (PIECES_FOLDER, JOBS_FOLDER)  # all that is written
_FITS = "fits"
_WHAT = {"seed": "the seed", "versions": "a version of bowdenfit or of a library"}
SEPARATOR = "\n"  # between reasons in fleet.nc


@dataclass(frozen=True)
class FleetStore:
    """A results folder.

    Args:
        folder: The folder.
        start: Settings and inputs that must not change between an interrupted fleet and its continuation.
    """

    folder: Path
    start: Mapping[str, Any]

    def open(self, resume: bool, force: bool) -> dict[str, PieceFit]:
        """Prepare the folder, and return what was fitted before by the hash of its input.

        Args:
            resume: Whether to go on with what is there.
            force: Whether to replace it.

        Raises:
            StoreError: The folder holds something else, or what it holds was made otherwise.
        """
        finished, kept = self.folder / FLEET_PAGE, self.folder / PIECES_FOLDER
        if resume:
            self._refuse_changed()
            before = self._read_finished() if finished.exists() else {}
            return before | self._read_pieces()
        if (finished.exists() or kept.exists()) and not force:
            raise StoreError(f"{self.folder} holds a fleet already; go on with --resume, or start over with --force.")
        if not holds_only_run_files(self.folder, {*_FILES, *_FOLDERS}):
            raise StoreError(f"{self.folder} exists and holds no fleet; name another with --output.")
        if not (force or holds_only_run_files(self.folder, ())):
            raise StoreError(
                f"{self.folder} holds what is left of a fleet that was ended; add --force to replace it, or name another with "
                "--output."
            )
        with folder_to_write(self.folder):
            remove_run_files(self.folder, _FILES, _FOLDERS)
            self._write_start()
        return {}

    def _write_start(self) -> None:
        (self.folder / PIECES_FOLDER).mkdir(parents=True, exist_ok=True)
        write_text(self.folder / PIECES_FOLDER / START_FILE, json.dumps(dict(self.start), indent=1) + "\n")

    def _refuse_changed(self) -> None:
        before = read_start(self.folder)
        changed = [name for name in _WHAT if before.get(name) != json.loads(json.dumps(self.start[name]))]
        if changed:
            what = _describe_changes(before.get(changed[0]), self.start[changed[0]])
            raise StoreError(
                f"{self.folder} cannot be resumed because {_WHAT[changed[0]]} changed since{what}; undo the change, or start "
                "over with --force."
            )
        with folder_to_write(self.folder):
            for folder in (self.folder, self.folder / PIECES_FOLDER):
                remove_partial(folder)
            self._write_start()

    def _read_finished(self) -> dict[str, PieceFit]:
        """Return the fits of a finished fleet."""
        draws, path = read_fleet_draws(self.folder), self.folder / FLEET_DRAWS
        with damage_as(StoreError(f"{path} is damaged; restore the folder from a copy, or start over with --force.")):
            return self._split_by_input(draws)

    def _split_by_input(self, draws: FleetDraws) -> dict[str, PieceFit]:
        fits = dict[str, PieceFit]()
        quantities: dict[str, list[str]] = draws.about["quantities"]
        stats = {name: [_decode_text(value) for value in values] for name, values in draws.stats.items()}
        for i, name in enumerate(stats["input"]):
            own = quantities[stats["shape"][i]]
            values = [draws.values[value][i] for value in own]
            reasons = tuple(stats["reasons"][i].split(SEPARATOR)) if stats["reasons"][i] else ()
            k, n_effective = (float(draws.stats[value][i]) for value in ("pareto_k", "n_effective"))
            fits[name] = PieceFit(name, np.stack(values), stats["engine"][i], k, n_effective, reasons)
        return fits

    def _read_pieces(self) -> dict[str, PieceFit]:
        """Return the pieces that an interrupted fleet saved; a damaged one is removed and fitted again."""
        kept: dict[str, PieceFit] = {}
        for path in sorted((self.folder / PIECES_FOLDER).glob("*.npz")):
            damaged = StoreError(f"{path} is damaged")
            try:
                with damage_as(damaged):
                    fits: Sequence[PieceFit] = read_arrays(path, {_FITS: tuple[PieceFit, ...]})[_FITS]
                    if not all(_is_valid(fit) for fit in fits):
                        raise damaged
            except StoreError:
                path.unlink(missing_ok=True)
                continue
            kept |= {fit.name: fit for fit in fits}
        return kept

    def keep(self, fits: Sequence[PieceFit]) -> None:
        """Save the fits of a piece atomically.

        Args:
            fits: What came of it.
        """
        name = hashlib.sha256(" ".join(fit.name for fit in fits).encode()).hexdigest()[:16]
        with folder_to_write(self.folder / PIECES_FOLDER) as kept:
            write_arrays(kept / f"{name}.npz", {_FITS: tuple(fits)})

    def finish(self) -> None:
        """Remove the pieces, once fleet.nc holds them."""
        self._remove_pieces()

    def _remove_pieces(self) -> None:
        for name in (PIECES_FOLDER, JOBS_FOLDER):
            if (self.folder / name).is_dir():
                shutil.rmtree(self.folder / name, ignore_errors=True)


def _describe_changes(before: Any, current: Any) -> str:
    """Describe a change in words; empty if its former value is unknown."""
    if not (isinstance(before, Mapping) and isinstance(current, Mapping)):
        return f" from {shown(before)} to {shown(current)}" if isinstance(before, int) else ""
    names = [name for name in (*current, *before) if before.get(name) != current.get(name)]
    changes = [
        f"{name} from {_format_version(before.get(name))} to {_format_version(current.get(name))}"
        for name in dict.fromkeys(names)
    ]
    return f" ({few(changes)})"


def _format_version(version: Any) -> str:
    return "none" if version is None else shown(version)


def read_start(folder: Path) -> dict[str, Any]:
    """Read the seed and versions that the fleet in a folder was started with.

    Raises:
        StoreError: There is none, or it is damaged.
    """
    for path in (folder / PIECES_FOLDER / START_FILE, folder / FLEET_PAGE):
        if path.exists():
            page = read_page(path)
            with damage_as(StoreError(f"{path} is damaged; start over with --force.")):
                refuse_invalid_seed(page["seed"])
                return dict(page)
    raise StoreError(f"{folder} holds no fleet to resume; leave --resume out.")


def _is_valid(fit: PieceFit) -> bool:
    """Return whether a fit that was read has the types of one that was saved."""
    texts = (
        isinstance(fit.name, str)
        and isinstance(fit.engine, str)
        and all(isinstance(reason, str) for reason in fit.reasons)
    )
    return texts and isinstance(fit.values, np.ndarray) and fit.values.ndim == 2 and fit.values.dtype == np.float64


def _decode_text(value: Any) -> str:
    return value.decode() if isinstance(value, bytes) else str(value)
