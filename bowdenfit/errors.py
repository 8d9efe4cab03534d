"""Errors that a user can cause or meet: each is complete sentences with a remedy."""

import difflib
import errno
from collections.abc import Callable, Hashable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeVar

from bowdenfit.words import printable

Value = TypeVar("Value")
Item = TypeVar("Item")

MEMORY_RAN_OUT = "memory ran out; close other programs, or run this where there is more of it."
_LONGEST = 200  # characters of a file's name in a message
_NO_MEMORY = ("RESOURCE_EXHAUSTED", "Cannot allocate memory", "failed to map segment")  # of XLA, the system, its loader
_FULL = {errno.ENOSPC, errno.EFBIG, errno.EIO, *({errno.EDQUOT} if hasattr(errno, "EDQUOT") else ())}


class BowdenfitError(Exception):
    """Base of all errors a user can cause or meet; its text is complete sentences with a remedy.

    `faults` are the errors that one error combines. Faults of a table with the same `fault_key` are reported once, with their
    rows. `key_path` holds the keys that lead to the faulty entry of a description, or to it from what is being read.
    """

    exit_code = 1
    faults: "tuple[BowdenfitError, ...]" = ()
    fault_key: Hashable = None
    row: int = 0

    def __init__(self, sentence: str = "", key_path: tuple[str | int, ...] = ()) -> None:
        super().__init__(sentence)
        self.key_path = key_path

    def put_below(self, *keys: str | int) -> None:
        """Put the keys below which something was read before those that this error, or the errors in it, have."""
        for fault in self.faults or (self,):
            fault.key_path = (*keys, *fault.key_path) if fault.key_path else ()

    def __str__(self) -> str:
        """The text with control characters written out: names of files in it may hold any."""
        return printable(super().__str__())


class DatasetError(BowdenfitError):
    """A table cannot be read as measurements: names the file, and row, column and value where they exist."""

    exit_code = 2


class DescriptionError(BowdenfitError):
    """The description of the cable (`cable.toml`, or an option that stands for it) is wrong or incomplete."""

    exit_code = 2


class MissingAngleError(DescriptionError):
    """A table or recording without a description does not say by which angle the cable was wrapped."""


class UsageError(BowdenfitError):
    """The request itself cannot be met: an option with an impossible value, or a question the fit cannot answer."""

    exit_code = 2


class StoreError(BowdenfitError):
    """A results folder exists already, is missing, is damaged, or belongs to other inputs."""

    exit_code = 2


class DiskError(StoreError):
    """There is no room for what is to be written, though the request was good."""

    exit_code = 1


class MemoryShortageError(BowdenfitError):
    """The system gives no more memory, though the request was good."""


class ConvergenceError(BowdenfitError):
    """A solver or sampler stopped without an answer that can be used at all."""

    exit_code = 3


_MOST_FAULTS, _MOST_ROWS = 20, 12  # that are named


@dataclass
class Faults:
    """Collects errors while reading goes on, and raises them together, so that users see all of them at once.

    Args:
        faults: The errors collected so far.
    """

    faults: list[BowdenfitError] = field(default_factory=list)

    @contextmanager
    def collect(self, key_path: tuple[str | int, ...] = ()) -> Iterator[None]:
        """Collect the error that is raised inside, for an entry of a description, and go on after it."""
        try:
            yield
        except (DatasetError, DescriptionError) as error:
            for fault in error.faults or (error,):
                fault.key_path = fault.key_path or key_path
                self.faults.append(fault)

    def read_all(self, read: Callable[[Item], Value], items: Iterable[Item], otherwise: Value) -> list[Value]:
        """Return all items as read one by one, with `otherwise` in place of those refused."""
        values = []
        for item in items:
            try:
                values.append(read(item))
            except (DatasetError, DescriptionError) as error:
                self.faults.append(error)
                values.append(otherwise)
        return values

    def refuse(self) -> None:
        """Raise everything collected, if there is anything.

        Raises:
            BowdenfitError: Of the type of the first fault.
        """
        if self.faults:
            raise combine_errors(self.faults)


def combine_errors(errors: Sequence[BowdenfitError]) -> BowdenfitError:
    """Return one error with all faults, a sentence each; a fault of several rows is reported once, with the rows."""
    faults = tuple(fault for error in errors for fault in error.faults or (error,))
    kinds: dict[Hashable, list[BowdenfitError]] = {}
    for fault in faults:
        kinds.setdefault(fault.fault_key or str(fault), []).append(fault)
    sentences = [_with_rows(faults) for faults in kinds.values()]
    if len(faults) == 1:
        return faults[0]
    more = [f"- and {len(sentences) - _MOST_FAULTS} more."] if len(sentences) > _MOST_FAULTS else []
    lines = [f"{len(sentences)} things are wrong:", *(f"- {sentence}" for sentence in sentences[:_MOST_FAULTS]), *more]
    error = type(faults[0])("\n".join(lines) if len(sentences) > 1 else sentences[0])
    error.faults = faults
    return error


def _with_rows(faults: Sequence[BowdenfitError]) -> str:
    """Return the text of the first of several equal faults, with the rows of the others."""
    remaining = sorted({fault.row for fault in faults} - {faults[0].row})
    if not remaining:
        return str(faults[0])
    named = [str(row) for row in remaining[:_MOST_ROWS]]
    if len(remaining) > _MOST_ROWS:
        named.append(f"{len(remaining) - _MOST_ROWS} more")
    rows = ", ".join(named[:-1]) + " and " + named[-1] if len(named) > 1 else named[0]
    return f"{faults[0]} The same in row{'s' if len(remaining) > 1 else ''} {rows}."


def disk_error(path: Path, error: OSError) -> StoreError:
    """Return the error for a file or folder that cannot be written, with a remedy.

    Args:
        path: The file or folder.
        error: Error of the system.
    """
    reason = error.strerror or type(error).__name__
    if error.errno in _FULL:
        return DiskError(f"{path} cannot be written ({reason}); make room on that disk, or name another folder.")
    return StoreError(f"{path} cannot be written ({reason}); name another folder with --output.")


def describe_unforeseen(error: Exception, remedy: str = "This is our fault: please report it.") -> str:
    """Describe an error that is a fault of ours, and what to do about it."""
    description = f"{type(error).__name__}: {error}".removesuffix(": ")
    return f"something went wrong inside bowdenfit ({description}). {remedy}"


def system_error(error: BaseException) -> BowdenfitError | None:
    """Return a system error (memory or a file) as a `BowdenfitError`; None for any other error.

    Args:
        error: Whatever came up.
    """
    if isinstance(error, MemoryError) or any(sign in str(error) for sign in _NO_MEMORY):
        return MemoryShortageError(MEMORY_RAN_OUT)
    if not isinstance(error, OSError) or error.errno is None:
        return None
    name = str(error.filename or "a file")
    name = name if len(name) <= _LONGEST else f"{name[: _LONGEST // 2]}...{name[-_LONGEST // 2 :]}"
    if error.errno in _FULL or not error.filename:
        return disk_error(Path(name), error)
    return StoreError(
        f"{name} cannot be opened ({error.strerror}); check its name, its kind and its permissions."
    )


def suggest_name(name: str, known: Sequence[str]) -> str:
    """Return the end of a sentence about an unknown name: the nearest known one as a question, or all known ones."""
    near = difflib.get_close_matches(name, list(known), n=1, cutoff=0.5)
    return f"; did you mean {near[0]!r}?" if near else f"; known here: {', '.join(known)}."
