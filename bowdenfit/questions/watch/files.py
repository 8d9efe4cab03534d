"""Files of a bench that still measures: which of them are whole, and a copy of these that can be read in peace.

A file is settled once its size and time have not changed for half a second. A logger writes its buffer now and then, and seems
to rest between: a long file is settled after two seconds, or three times its longest pause, and one that breaks off in a row
after a minute. Of a text the last row counts once its line has ended. What is not settled is left out, and where it was read
before, or is needed, nothing is read until it is.
"""

import os
import shutil
import stat
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from bowdenfit.dataset import DESCRIPTION_FILE
from bowdenfit.files.formats import TEXT

QUIET = 0.5  # s without a change after which a file is settled
_LONG = 100_000  # bytes from which a file that grows is taken for a log; a judgement: tables have some kB
_PAUSES, _SHORTEST, _LONGEST = 3.0, 2.0, 60.0  # patience with a log in its own longest pauses, and its limits [s]; judgements
_COPIED = 10_000_000  # bytes up to which a file is copied, beyond which the copy is a link to it
_TAIL = 1 << 16  # bytes that are looked at at a time for the end of a line
_MOST_FILES = 10_000  # that are looked at; a judgement
_WIDE = {b"\xff\xfe": b"\n\x00", b"\xfe\xff": b"\x00\n"}  # end of a line in texts of two bytes a letter, by their marks

Mark = tuple[int, int, int]  # size, time and number of a file: the same as long as nobody writes or replaces it


@dataclass
class FileState:
    """What is known of one file.

    Args:
        mark: Its size, time and number; None since it is gone.
        since: When that was first seen [s].
        pause: Longest time between two changes that were seen [s].
        has_grown: Whether a change was seen at all.
    """

    mark: Mark | None
    since: float
    pause: float = 0.0
    has_grown: bool = False

    def see(self, mark: Mark | None, now: float) -> None:
        """Note what is there now."""
        if mark != self.mark:
            if self.has_grown:
                self.pause = max(self.pause, now - self.since)
            self.mark, self.since, self.has_grown = mark, now, True

    def is_settled(self, path: Path, now: float) -> bool:
        """Return whether nobody seems to write it."""
        quiet = now - self.since
        if self.mark is None or self.mark[0] <= _LONG or quiet >= _LONGEST:
            return quiet >= QUIET
        return quiet >= max(_SHORTEST, _PAUSES * self.pause) and _ends_whole(path, self.mark[0])


@dataclass
class BenchFiles:
    """The files of a data set on disk, and a copy of those that are settled.

    Args:
        path: Folder of the data set, or one file.
        copies: An empty folder for the copy.
        join: File of a second logger; None without one.
    """

    path: Path
    copies: Path
    join: Path | None = None
    states: dict[Path, FileState] = field(default_factory=dict)
    read_marks: dict[Path, Mark] = field(default_factory=dict)
    _copied: dict[Path, Mark] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.path.is_dir():
            link_neighbors(self.path, self.copy)

    @property
    def copy(self) -> Path:
        """Where the data set is copied to."""
        return self.copies / "bench" / self.path.resolve().name

    @property
    def joined_copy(self) -> Path | None:
        """Where the file of a second logger is copied to."""
        return None if self.join is None else self.copies / "joined" / self.join.name

    def look(self, now: float) -> bool:
        """Look at every file; return whether what is settled is not what was read last.

        Args:
            now: Seconds of a clock that never goes back.
        """
        marks = {path: mark for path in self._paths() if (mark := _mark(path)) is not None}
        for path in {*marks, *self.states}:
            if path in self.states:
                self.states[path].see(marks.get(path), now)
            else:
                self.states[path] = FileState(marks[path], now)
        for path in [path for path, state in self.states.items() if state.mark is None and state.is_settled(path, now)]:
            del self.states[path]
        if any(path in self.read_marks for path in self.unsettled(now)):
            return False
        return self._settled(now) != self.read_marks

    def unsettled(self, now: float) -> list[Path]:
        """Return files that somebody seems to write, or to replace."""
        return [path for path, state in self.states.items() if not state.is_settled(path, now)]

    def copy_settled(self, now: float) -> Path | None:
        """Copy what is settled and return where it is; None where a file changed meanwhile."""
        settled = self._settled(now)
        for path in [path for path in self._copied if path not in settled]:
            self._copy_path(path).unlink(missing_ok=True)
            del self._copied[path]
        for path, mark in settled.items():
            if self._copied.get(path) != mark:
                if not _copy_whole_lines(path, self._copy_path(path), mark):
                    return None
                self._copied[path] = mark
        self.read_marks = settled
        return self.copy

    def is_unchanged(self) -> bool:
        """Return whether what was read is still there: a long file is not copied but read where it lies."""
        return all(_mark(path) == mark for path, mark in self.read_marks.items() if mark[0] > _COPIED)

    def forget(self) -> None:
        """Read again at the next look, whatever was read."""
        self.read_marks = {}

    def _settled(self, now: float) -> dict[Path, Mark]:
        return {path: s.mark for path, s in self.states.items() if s.mark is not None and s.is_settled(path, now)}

    def _copy_path(self, path: Path) -> Path:
        if self.joined_copy is not None and path == self.join:
            return self.joined_copy
        return self.copy / path.relative_to(self.path) if path != self.path else self.copy

    def _paths(self) -> Iterator[Path]:
        """Yield the files of the data set; hidden ones are those of editors and office programs."""
        if self.join is not None:
            yield self.join
        if self.path.is_file() or not self.path.exists():
            yield self.path
            return
        count = 0
        for folder, folders, names in os.walk(self.path):
            folders[:] = sorted(name for name in folders if not name.startswith("."))
            for name in sorted(names):
                if not name.startswith((".", "~$")) and count < _MOST_FILES:
                    count += 1
                    yield Path(folder, name)


def link_neighbors(folder: Path, copy: Path) -> None:
    """Link what lies beside a data set to beside a copy of it, where its description may name it as ../angles.csv.

    Args:
        folder: The data set.
        copy: The folder of the copy, which is made if it is not there, in a folder of its own.
    """
    description = folder / DESCRIPTION_FILE
    copy.mkdir(parents=True, exist_ok=True)
    if description.is_file() and ".." in description.read_text(encoding="utf-8", errors="replace"):
        for neighbor in folder.resolve().parent.iterdir():
            if neighbor.name != copy.name:
                (copy.parent / neighbor.name).symlink_to(neighbor)


def _mark(path: Path) -> Mark | None:
    """Return size, time and number of a regular file; None where there is none."""
    try:
        status = path.stat()
    except OSError:
        return None
    return (status.st_size, status.st_mtime_ns, status.st_ino) if stat.S_ISREG(status.st_mode) else None


def _copy_whole_lines(path: Path, copy: Path, mark: Mark) -> bool:
    """Copy a file, of a text no more than its whole lines; return whether it stayed as it was meanwhile."""
    copy.parent.mkdir(parents=True, exist_ok=True)
    copy.unlink(missing_ok=True)
    try:
        end = _end_of_lines(path, mark[0]) if _is_text(path) else mark[0]
        if mark[0] > _COPIED and end == mark[0]:
            copy.symlink_to(path.resolve())
        else:
            shutil.copyfile(path, copy)
            os.truncate(copy, min(end, copy.stat().st_size))
    except FileNotFoundError:
        return False
    return _mark(path) == mark


def _is_text(path: Path) -> bool:
    return path.suffix.lower() in TEXT


def _ends_whole(path: Path, size: int) -> bool:
    """Return whether a file does not break off in a row."""
    try:
        return not _is_text(path) or _end_of_lines(path, size) == size
    except OSError:
        return False


def _end_of_lines(path: Path, size: int) -> int:
    """Return where the last whole line of a text ends [bytes]."""
    with path.open("rb") as file:
        start = file.read(2)
        line_end = _WIDE.get(start, b"\n")
        width, stop = len(line_end), size - size % len(line_end)
        while stop > 0:
            begin = max(0, stop - _TAIL)
            file.seek(begin)
            block = file.read(stop - begin)
            at = block.rfind(line_end)
            while at > 0 and at % width:  # two bytes that belong to two letters
                at = block.rfind(line_end, 0, at + width - 1)
            if at >= 0:
                return begin + at + width
            stop = begin
    return 0
