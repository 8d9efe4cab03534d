"""Recordings in the files that acquisition programs write: one entry that finds the reader by ending and by content."""

from collections.abc import Callable
from importlib import import_module
from pathlib import Path

from bowdenfit.errors import DatasetError
from bowdenfit.files.channels import ChannelFile
from bowdenfit.files.contents import TEXT, UNKNOWN, Content, recognized
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


def read_channels(path: Path) -> ChannelFile:
    """Read all numeric channels of a recording, whatever program wrote it.

    The ending chooses the reader; the first bytes are looked at first, so that a file with the wrong ending is refused
    with what it really is. Libraries are imported only for the kind of file at hand.

    Args:
        path: A file, or the folder of a ROS 2 bag.

    Raises:
        DatasetError: The file is missing, empty, unreadable, damaged, too large, not what its ending says, or of no
            kind that can be read; or its library is not installed.
    """
    reader = FORMATS[".bag" if _is_ros2_folder(path) else _checked_ending(path)]
    result: ChannelFile = import_module(reader).read(path) if isinstance(reader, str) else reader(path)
    return result


def _is_ros2_folder(path: Path) -> bool:
    """Whether this is the folder that ROS 2 calls a bag."""
    return path.is_dir() and (path / "metadata.yaml").is_file()


def _checked_ending(path: Path) -> str:
    """The ending of a file that is what it says."""
    content = recognized(path, first_bytes(path, 1024))
    ending = path.suffix.lower()
    if ending not in FORMATS:
        raise _unknown_ending(path, content)
    if not content.suits(ending):
        raise _wrong_ending(path, content)
    return ending


def _unknown_ending(path: Path, content: Content) -> DatasetError:
    """What to do with an ending that nobody reads."""
    if content is not UNKNOWN:
        return DatasetError(f"{path.name} is {content.what}; {content.advice}.")
    ending = f"the ending {path.suffix}" if path.suffix else "no ending"
    return DatasetError(
        f"{path.name} has {ending}, which says nothing about its content; export the recording as CSV, or rename it to "
        f"what it is: {', '.join(FORMATS)}."
    )


def _wrong_ending(path: Path, content: Content) -> DatasetError:
    """What the file really is."""
    if content is not UNKNOWN:
        return DatasetError(f"{path.name} is not a {path.suffix} file but {content.what}; {content.advice}.")
    return DatasetError(
        f"{path.name} does not start as a {path.suffix} file does: it is damaged or of another kind; copy it again from "
        "the acquisition computer, or export the recording as CSV."
    )
