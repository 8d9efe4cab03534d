"""Recordings in the files that acquisition programs write: one entry that finds the reader by ending and by content."""

from collections.abc import Callable
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from weakref import WeakValueDictionary

from bowdenfit.errors import DatasetError
from bowdenfit.files.channels import ChannelFile
from bowdenfit.files.contents import PLAIN_TEXT, TEXT, UNKNOWN, Content, recognize
from bowdenfit.files.text_file import first_bytes

FORMATS: dict[str, str | Callable[[Path], ChannelFile]] = {
    **dict.fromkeys(TEXT, f"{__name__}.columns_csv"),
    **dict.fromkeys((".xlsx", ".xlsm"), f"{__name__}.excel"),
    **dict.fromkeys((".parquet", ".pq"), f"{__name__}.parquet"),
    ".mat": f"{__name__}.matlab",
    **dict.fromkeys((".h5", ".hdf5"), f"{__name__}.hdf5"),
    ".tdms": f"{__name__}.tdms",
    **dict.fromkeys((".mf4", ".mdf"), f"{__name__}.mdf"),
    ".cmbl": f"{__name__}.logger_pro",
    **dict.fromkeys((".bag", ".db3", ".mcap"), f"{__name__}.rosbag"),
}
"""Who reads files with an ending: a function, or a module whose `read` is imported with the first such file."""

_KEPT: WeakValueDictionary[tuple[Path, int, int, int], ChannelFile] = WeakValueDictionary()


def read_channels(path: Path) -> ChannelFile:
    """Read all numeric channels of a recording, whatever program wrote it.

    The ending chooses the reader; the first bytes are looked at first, so that a file with the wrong ending is refused
    with what it really is. A file whose channels somebody still holds is not read again. Libraries are imported only for the
    kind of file at hand, and those that read binary files in a process of their own, with limits of memory and time.

    Args:
        path: A file, or the folder of a ROS 2 bag.

    Raises:
        DatasetError: The file is missing, empty, unreadable, damaged, too large, not what its ending says, or of no
            kind that can be read; or its library is not installed.
    """
    status = path.stat() if path.is_file() else None
    key = (path.resolve(), status.st_mtime_ns, status.st_size, status.st_ino) if status else None
    result = _KEPT.get(key) if key else None
    if result is None:
        result = _read_uncached(path)
        if key:
            _KEPT[key] = result
    return replace(result, path=path) if result.path != path else result


def _read_uncached(path: Path) -> ChannelFile:
    """The channels of a file that is not in memory."""
    ending = ".bag" if is_ros2_folder(path) else checked_ending(path)
    if str(FORMATS[ending]).startswith(f"{__name__}.") and ending not in TEXT:
        from bowdenfit.files.apart import read_apart

        return read_apart(path)
    return read_here(path)


def read_here(path: Path) -> ChannelFile:
    """The same, in this process."""
    reader = FORMATS[".bag" if is_ros2_folder(path) else checked_ending(path)]
    result: ChannelFile = import_module(reader).read(path) if isinstance(reader, str) else reader(path)
    return result


def is_ros2_folder(path: Path) -> bool:
    """Whether this is the folder that ROS 2 calls a bag."""
    return path.is_dir() and (path / "metadata.yaml").is_file()


def checked_ending(path: Path) -> str:
    """The ending of a file that is what it says.

    Raises:
        DatasetError: Its first bytes say something else.
    """
    content = recognize(path, first_bytes(path, 4096))
    ending = path.suffix.lower()
    if ending not in FORMATS or not content.suits(ending):
        raise _refusal(path, content)
    return ending


def _refusal(path: Path, content: Content) -> DatasetError:
    """What a file really is, where its ending says something else or nothing."""
    ending, known = path.suffix, path.suffix.lower() in FORMATS
    if content is not UNKNOWN and (known or content is not PLAIN_TEXT):
        what = f"not a {ending} file but {content.what}" if known else content.what
        return DatasetError(f"{path.name} is {what}; {content.advice}.")
    if known:
        return DatasetError(
            f"{path.name} does not start as a {ending} file does: it is damaged or of another kind; copy it again from "
            "the acquisition computer, or export the recording as CSV."
        )
    return DatasetError(
        f"{path.name} has {f'the ending {ending}' if ending else 'no ending'}, which says nothing about its content; export "
        f"the recording as CSV, or rename it to what it is: {', '.join(FORMATS)}."
    )
