"""The results folder as files: their names, writing them whole, and not overwriting what is there.

`fit.json` is written last, so a folder that has it is complete. A folder with `chain.h5` alone is an interrupted fit.
"""

import json
import os
import shutil
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from bowdenfit.errors import StoreError

FIT, SUMMARY, SUMMARY_TEXT = "fit.json", "summary.json", "summary.txt"
POSTERIOR, CHAIN, FIGURES = "posterior.nc", "chain.h5", "figures"
ANSWERS, FIGURE_DATA = "answers.json", "figures.npz"
REPLICATIONS = "replications.jsonl"  # of a calibration


@contextmanager
def replace_when_whole(path: Path) -> Iterator[Path]:
    """A temporary name beside `path` to write to; it becomes `path` only if nothing went wrong."""
    temporary = path.with_name(f".{path.name}.partial")
    try:
        yield temporary
        os.replace(temporary, path)  # noqa: PTH105  (Path.replace says the same; this is the usual word for it)
    finally:
        temporary.unlink(missing_ok=True)


@contextmanager
def folder_to_write(folder: Path) -> Iterator[Path]:
    """A folder to write into, made if missing.

    Args:
        folder: The folder.

    Raises:
        StoreError: It cannot be made, or something inside cannot be written.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        yield folder
    except OSError as error:
        why = error.strerror or type(error).__name__
        raise StoreError(f"{folder} cannot be written ({why}); name another with --output.") from None


def write_text(path: Path, text: str) -> None:
    """Write a text file whole."""
    with replace_when_whole(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def refuse_to_overwrite(folder: Path, force: bool) -> None:
    """Stop before anything is computed if the results would have no place; notes (*.md) may lie there.

    Args:
        folder: The results folder.
        force: Whether an earlier fit there may be replaced.

    Raises:
        StoreError: The folder holds something already.
    """
    if (folder / FIT).exists():
        if force:
            return
        raise StoreError(
            f"{folder} holds a finished fit already; add --force to replace it, or name another with --output."
        )
    if (folder / CHAIN).exists():
        if force:
            return
        raise StoreError(f"{folder} holds an interrupted fit; go on with --resume, or start over with --force.")
    if folder.exists() and (not folder.is_dir() or any(path.suffix != ".md" for path in folder.iterdir())):
        raise StoreError(f"{folder} exists and is no results folder; name another with --output.")


def clear(folder: Path) -> None:
    """Remove what an earlier fit wrote, and nothing else; the mark of a finished fit goes first."""
    for name in (FIT, ANSWERS, SUMMARY, SUMMARY_TEXT, FIGURE_DATA, POSTERIOR, CHAIN):
        (folder / name).unlink(missing_ok=True)
    if (folder / FIGURES).is_dir():
        shutil.rmtree(folder / FIGURES)


def start_checkpoint(path: Path, fingerprint: Mapping[str, Any]) -> None:
    """Make the sampler's checkpoint, which carries what it was started for.

    Raises:
        StoreError: The folder cannot be written.
    """
    import h5py

    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with h5py.File(path, "w") as file:
            file.attrs["fingerprint"] = json.dumps(fingerprint)
    except OSError as error:
        raise StoreError(f"{path.parent} cannot be written ({error}); name another folder with --output.") from None


def read_checkpoint(folder: Path) -> dict[str, Any]:
    """What the checkpoint in a folder was started for.

    Raises:
        StoreError: There is no checkpoint, or it is damaged.
    """
    import h5py

    path = folder / CHAIN
    if not path.exists():
        raise StoreError(f"{folder} holds no checkpoint (chain.h5) to resume from; fit without --resume.")
    try:
        with h5py.File(path, "r") as file:
            return dict(json.loads(str(file.attrs["fingerprint"])))
    except (OSError, KeyError, json.JSONDecodeError):
        raise StoreError(f"{path} is damaged and cannot be resumed; start over with --force.") from None
