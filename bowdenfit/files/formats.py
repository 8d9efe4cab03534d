"""Which format a file has, by its ending and its first bytes, and who reads it.

A format is a line in `FORMATS`: the ending, and a module of this room whose `read` makes a `ChannelFile` of such a file.
"""

import zipfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from importlib import import_module
from pathlib import Path
from weakref import WeakValueDictionary

from bowdenfit.errors import DatasetError
from bowdenfit.files.channels import ChannelFile
from bowdenfit.files.isolation import read_isolated
from bowdenfit.files.text_file import first_bytes
from bowdenfit.words import shown

_ROOM = "bowdenfit.files"
WORKBOOKS = (".xlsx", ".xlsm")
TEXT = tuple(f".{ending}" for ending in ("csv", "txt", "tsv", "dat", "asc", "log", "lvm"))

FORMATS: dict[str, str | Callable[[Path], ChannelFile]] = {
    **dict.fromkeys(TEXT, f"{_ROOM}.csv_recording"),
    **dict.fromkeys(WORKBOOKS, f"{_ROOM}.excel"),
    **dict.fromkeys((".parquet", ".pq"), f"{_ROOM}.parquet"),
    ".mat": f"{_ROOM}.matlab",
    **dict.fromkeys((".h5", ".hdf5"), f"{_ROOM}.hdf5"),
    **dict.fromkeys((".npz", ".npy"), f"{_ROOM}.numpy_arrays"),
    ".tdms": f"{_ROOM}.tdms",
    **dict.fromkeys((".mf4", ".mdf"), f"{_ROOM}.mdf"),
    ".cmbl": f"{_ROOM}.logger_pro",
    **dict.fromkeys((".bag", ".db3", ".mcap"), f"{_ROOM}.rosbag"),
}
"""Who reads files with an ending: a function, or a module whose `read` is imported with the first such file."""

_KEPT: WeakValueDictionary[tuple[Path, int, int, int, str], ChannelFile] = WeakValueDictionary()


@dataclass(frozen=True)
class Content:
    """A kind of file that its first bytes give away.

    Args:
        what: Name of the format, with an article.
        endings: The endings of such files, the usual one first; none for files that nobody reads.
        remedy: Fix for such a file that has another extension, as an order; to rename it if omitted.
    """

    what: str
    endings: tuple[str, ...] = ()
    remedy: str = ""

    @property
    def advice(self) -> str:
        """What to do with such a file that has another ending."""
        return self.remedy or f"rename it to {self.endings[0]}"

    def suits(self, ending: str) -> bool:
        """Return whether files with an extension may start so; True without a known signature."""
        return ending in self.endings or not any(ending in content.endings for content in _CONTENTS)


UNKNOWN = Content("a file of unknown kind", (*TEXT, ".mat"), "export the recording as CSV")  # MATLAB 4 has no mark
_EXPORT = "open it in the program that wrote it and export the recording as CSV"
_UNPACK = "unpack it and give the file inside"
_HDF, _BEHIND = b"\x89HDF\r\n\x1a\n", (512, 1024, 2048)  # it may stand behind bytes that are the user's own
_STARTS = {  # the longer start before the shorter one
    b"MATLAB 5": Content("a MATLAB file", (".mat",)),
    b"MATLAB 7": Content("a MATLAB 7.3 file", (".mat",)),
    _HDF: Content("an HDF5 file", (".h5", ".hdf5")),
    b"\x93NUMPY": Content("an array of NumPy", (".npy",)),
    b"TDSm": Content("a TDMS file of National Instruments", (".tdms",)),
    b"TDSh": Content("the index of a TDMS file", (), "give the .tdms file next to it"),
    b"MDF     ": Content("an MDF measurement file", (".mf4", ".mdf")),
    b"UnFinMF ": Content("an MDF measurement file", (".mf4", ".mdf")),
    b"#ROSBAG": Content("a ROS 1 bag", (".bag",)),
    b"\x89MCAP0\r\n": Content("an MCAP file", (".mcap",)),
    b"SQLite format 3\0": Content("an SQLite database", (".db3",), "rename it to .db3 if it is a ROS 2 bag"),
    b"PAR1": Content("a Parquet file", (".parquet", ".pq")),
    b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1": Content(
        "an old Excel workbook (.xls) or one with a password",
        (),
        "open it in Excel or LibreOffice and save it as .xlsx without a password",
    ),
    b"\x1f\x8b": Content("a gzip archive", (), _UNPACK),
    b"BZh": Content("a bzip2 archive", (), _UNPACK),
    b"\xfd7zXZ\0": Content("an xz archive", (), _UNPACK),
    b"7z\xbc\xaf\x27\x1c": Content("a 7-Zip archive", (), _UNPACK),
    b"Rar!\x1a\x07": Content("a RAR archive", (), _UNPACK),
    b"\x28\xb5\x2f\xfd": Content("a Zstandard archive", (), _UNPACK),
    b"%PDF-": Content("a PDF document", (), "give the recording itself"),
    b"version https://git-lfs": Content("a Git LFS pointer without the data", (), "run 'git lfs pull' first"),
}
PLAIN_TEXT = Content("text", TEXT)
_ZIP = Content("a ZIP archive", WORKBOOKS, _UNPACK)  # what is left of a workbook, perhaps
_ARRAYS = Content("an archive of NumPy", (".npz",))
_NO_WORKBOOK = Content("a ZIP archive", (), _UNPACK)
_WORKBOOK = Content("an Excel workbook", WORKBOOKS)
_OPEN_DOCUMENT = Content("an OpenDocument spreadsheet", (), "open it in LibreOffice and save it as .xlsx")
_PAGE = Content("a web page", (), "download the recording itself, or export it as CSV")
_XML = Content("an XML file, such as those of Logger Pro (.cmbl)", (".cmbl",), _EXPORT)
_CONTENTS = (UNKNOWN, *_STARTS.values(), _ZIP, _ARRAYS, _XML)


def read_channels(path: Path, sheet: str = "") -> ChannelFile:
    """Read all numeric channels of a recording, whatever program wrote it.

    The ending chooses the reader; the first bytes are looked at first, so that a file with the wrong ending is refused
    with what it really is. A file whose channels somebody still holds is not read again. Libraries are imported only for the
    kind of file at hand, and those that read binary files in a process of their own, with limits of memory and time.

    Args:
        path: A file, or the folder of a ROS 2 bag.
        sheet: Title of the only sheet of a workbook that is read; all if empty.

    Raises:
        DatasetError: The file is missing, empty, unreadable, damaged, too large, not what its ending says, or of no
            kind that can be read; or its library is not installed.
    """
    status = path.stat() if path.is_file() else None
    key = (path.resolve(), status.st_mtime_ns, status.st_size, status.st_ino, sheet) if status else None
    result = _KEPT.get(key) if key else None
    if result is None:
        result = _read_uncached(path, sheet)
        if key:
            _KEPT[key] = result
    return replace(result, path=path) if result.path != path else result


def refuse_sheet(path: Path, sheet: str) -> None:
    """Refuse the title of a sheet for a file that has none.

    Raises:
        DatasetError: There is a title.
    """
    if sheet:
        sentence = f"{path.name} is not a workbook and has no sheet {shown(sheet)}; leave the sheet out."
        raise DatasetError(sentence, key_path=("sheet",))


def _read_uncached(path: Path, sheet: str) -> ChannelFile:
    """Return the channels of a file that is not in memory."""
    ending = ".bag" if is_ros2_folder(path) else check_ending(path)
    if str(FORMATS[ending]).startswith(f"{_ROOM}.") and ending not in TEXT:
        return read_isolated(path, sheet)
    return read_here(path, sheet)


def read_here(path: Path, sheet: str = "") -> ChannelFile:
    """Return all numeric channels of a recording, read in this process; see `read_channels`."""
    ending = ".bag" if is_ros2_folder(path) else check_ending(path)
    reader, sheets = FORMATS[ending], (sheet,) if sheet else ()
    if ending not in WORKBOOKS:
        refuse_sheet(path, sheet)
    result: ChannelFile = import_module(reader).read(path, *sheets) if isinstance(reader, str) else reader(path, *sheets)
    return result


def is_ros2_folder(path: Path) -> bool:
    """Return whether this is the folder that ROS 2 calls a bag."""
    return path.is_dir() and (path / "metadata.yaml").is_file()


def check_ending(path: Path) -> str:
    """Return the ending of a file that is what it says.

    Raises:
        DatasetError: Its first bytes say something else.
    """
    content = recognize(path, first_bytes(path, 4096))
    ending = path.suffix.lower()
    if ending not in FORMATS or not content.suits(ending):
        raise _ending_error(path, content)
    return ending


def _ending_error(path: Path, content: Content) -> DatasetError:
    """Return what a file really is, where its ending says something else or nothing."""
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


def recognize(path: Path, head: bytes) -> Content:
    """Return what the file is by its first bytes.

    Args:
        path: The file; looked into further only where it is an archive.
        head: Its first bytes, the first 4096.
    """
    if head.startswith(b"PK\x03\x04"):
        return _recognize_archive(path)
    content = next((content for start, content in _STARTS.items() if head.startswith(start)), None)
    if content is None and any(head.startswith(_HDF, at) for at in _BEHIND):
        return _STARTS[_HDF]
    return content or _recognize_text(head)


def _recognize_archive(path: Path) -> Content:
    """Workbooks are ZIP archives too; an archive that was cut off has lost its list of members."""
    try:
        with zipfile.ZipFile(path) as archive:
            names = archive.namelist()
            if "mimetype" in names and b"opendocument.spreadsheet" in archive.open("mimetype").read(200):
                return _OPEN_DOCUMENT
    # Encrypted, packed in an unheard-of way, damaged, another name inside than in the list: zipfile raises anything.
    except Exception:
        return _ZIP
    if "xl/workbook.xml" in names:
        return _WORKBOOK
    if names and all(name.endswith(".npy") for name in names):
        return _ARRAYS
    return _ZIP if "[Content_Types].xml" in names else _NO_WORKBOOK


def _recognize_text(head: bytes) -> Content:
    """XML and web pages, or a file that is not recognized."""
    text = head.removeprefix(b"\xef\xbb\xbf").lstrip().lower()
    if text.startswith((b"<!doctype html", b"<html")):
        return _PAGE
    if text.startswith((b"<?xml", b"<document")):
        return _XML
    return PLAIN_TEXT if head and not any(byte < 9 for byte in head) and _is_utf8(head) else UNKNOWN


def _is_utf8(head: bytes) -> bool:
    """Return whether bytes are text; a letter may be cut in two at their end."""
    try:
        head.decode()
    except UnicodeDecodeError as error:
        return error.start > len(head) - 4
    return True
