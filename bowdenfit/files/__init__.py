"""Recordings in the files that acquisition programs write: one entry that finds the reader by ending and by content."""

import os
from importlib import import_module
from pathlib import Path

from bowdenfit.errors import DatasetError
from bowdenfit.files.channels import ChannelFile
from bowdenfit.files.contents import Content, recognized

_TEXT = ("csv", "txt", "tsv", "dat", "asc", "log", "lvm")
_READERS = {  # ending: module that reads it, what the content must be recognized as
    **{f".{ending}": ("columns_csv", ()) for ending in _TEXT},
    ".xlsx": ("excel", ("zip",)),
    ".xlsm": ("excel", ("zip",)),
    ".parquet": ("parquet", ("parquet",)),
    ".pq": ("parquet", ("parquet",)),
    ".mat": ("matlab", ("matlab", "")),  # MATLAB 4 files start without any mark
    ".h5": ("hdf5", ("hdf5",)),
    ".hdf5": ("hdf5", ("hdf5",)),
    ".tdms": ("tdms", ("tdms",)),
    ".mf4": ("mdf", ("mdf",)),
    ".mdf": ("mdf", ("mdf",)),
    ".cmbl": ("logger_pro", ("xml",)),
    ".bag": ("rosbag", ("rosbag1",)),
    ".db3": ("rosbag", ("sqlite",)),
    ".mcap": ("rosbag", ("mcap",)),
}


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
    module = "rosbag" if _is_ros2_folder(path) else _module_for(path)
    reader = import_module(f"{__name__}.{module}")
    result: ChannelFile = reader.read(path)
    return result


def _is_ros2_folder(path: Path) -> bool:
    """Whether this is the folder that ROS 2 calls a bag."""
    return path.is_dir() and (path / "metadata.yaml").is_file()


def _module_for(path: Path) -> str:
    """Name of the module that reads this file."""
    content = recognized(path, _head(path))
    ending = path.suffix.lower()
    if ending not in _READERS:
        raise _unknown_ending(path, content)
    module, contents = _READERS[ending]
    if content.key not in contents and (contents or content.key):
        raise _wrong_ending(path, content)
    return module


def _head(path: Path) -> bytes:
    """The first bytes of the file."""
    if path.is_dir():
        raise DatasetError(
            f"{path.name} is a folder, not a recording; give one of the files in it "
            "(only a ROS 2 bag is a folder, and it holds a metadata.yaml)."
        )
    try:
        with path.open("rb") as file:
            head = file.read(1024)
    except FileNotFoundError as error:
        raise DatasetError(f"{path} does not exist; check the spelling and the folder.") from error
    except OSError as error:
        raise DatasetError(
            f"{path.name} cannot be read ({error.strerror or os.strerror(error.errno or 0)}); check its permissions, and "
            "that no other program holds it open."
        ) from error
    if not head:
        raise DatasetError(f"{path.name} is empty (0 bytes); copy it again from the acquisition computer.")
    return head


def _unknown_ending(path: Path, content: Content) -> DatasetError:
    """What to do with an ending that nobody reads."""
    if content.key:
        return DatasetError(f"{path.name} is {content.what}; {content.remedy}.")
    ending = f"the ending {path.suffix}" if path.suffix else "no ending"
    return DatasetError(
        f"{path.name} has {ending}, which says nothing about its content; export the recording as CSV, or rename it to "
        f"what it is: {', '.join(_READERS)}."
    )


def _wrong_ending(path: Path, content: Content) -> DatasetError:
    """What the file really is."""
    if content.key:
        return DatasetError(f"{path.name} is not a {path.suffix} file but {content.what}; {content.remedy}.")
    return DatasetError(
        f"{path.name} does not start as a {path.suffix} file does: it is damaged or of another kind; copy it again from "
        "the acquisition computer, or export the recording as CSV."
    )
