"""Every way bowdenfit can refuse: sentences with a remedy, never a bare traceback."""

import difflib
import errno
from collections.abc import Sequence
from pathlib import Path

_FULL = {errno.ENOSPC, errno.EFBIG, errno.EIO, *({errno.EDQUOT} if hasattr(errno, "EDQUOT") else ())}


class BowdenfitError(Exception):
    """Base of all errors a user can cause or meet; its text is complete sentences with a remedy."""

    exit_code = 1


class DatasetError(BowdenfitError):
    """A table cannot be read as measurements: names the file, and row, column and value where they exist."""

    exit_code = 2


class DescriptionError(BowdenfitError):
    """The description of the cable (`cable.toml`, or an option that stands for it) is wrong or incomplete."""

    exit_code = 2


class UsageError(BowdenfitError):
    """The request itself cannot be met: an option with an impossible value, or a question the fit cannot answer."""

    exit_code = 2


class StoreError(BowdenfitError):
    """A results folder exists already, is missing, is damaged, or belongs to other inputs."""

    exit_code = 2


class DiskError(StoreError):
    """There is no room for what is to be written, though the request was good."""

    exit_code = 1


class ConvergenceError(BowdenfitError):
    """A solver or sampler stopped without an answer that can be used at all."""

    exit_code = 3


def disk_error(path: Path, error: OSError) -> StoreError:
    """Why a file or folder cannot be written, with a remedy: there is no room, or it may not be written at all.

    Args:
        path: The file or folder.
        error: What the system says.
    """
    why = error.strerror or type(error).__name__
    if error.errno in _FULL:
        return DiskError(f"{path} cannot be written ({why}); make room on that disk, or name another folder.")
    return StoreError(f"{path} cannot be written ({why}); name another folder with --output.")


def nearest(name: str, known: Sequence[str]) -> str:
    """End of a sentence about an unknown name: the nearest known one as a question, or what there is."""
    near = difflib.get_close_matches(name, list(known), n=1, cutoff=0.5)
    return f"; did you mean {near[0]!r}?" if near else f"; known here: {', '.join(known)}."
