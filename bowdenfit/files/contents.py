"""What a file really is, by its first bytes."""

import zipfile
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Content:
    """A kind of file that its first bytes give away.

    Args:
        key: Short name; empty for a file that is not recognized.
        what: What it is, for people, with an article.
        remedy: What to do with such a file, as an order.
    """

    key: str
    what: str
    remedy: str


_UNKNOWN = Content("", "a file of unknown kind", "export the recording as CSV")
_EXPORT = "open it in the program that wrote it and export the recording as CSV"
_UNPACK = "unpack it and give the file inside"
_STARTS = (  # the longer start before the shorter one
    (b"MATLAB 5", Content("matlab", "a MATLAB file", "rename it to .mat")),
    (b"MATLAB 7", Content("matlab", "a MATLAB 7.3 file", "rename it to .mat")),
    (b"\x89HDF\r\n\x1a\n", Content("hdf5", "an HDF5 file", "rename it to .h5")),
    (b"TDSm", Content("tdms", "a TDMS file of National Instruments", "rename it to .tdms")),
    (b"TDSh", Content("tdms_index", "the index of a TDMS file", "give the .tdms file that lies next to it")),
    (b"MDF     ", Content("mdf", "an MDF measurement file", "rename it to .mf4")),
    (b"UnFinMF ", Content("mdf", "an MDF measurement file", "rename it to .mf4")),
    (b"#ROSBAG", Content("rosbag1", "a ROS 1 bag", "rename it to .bag")),
    (b"\x89MCAP0\r\n", Content("mcap", "an MCAP file", "rename it to .mcap")),
    (b"SQLite format 3\0", Content("sqlite", "an SQLite database", "rename it to .db3 if it is a ROS 2 bag")),
    (b"PAR1", Content("parquet", "a Parquet file", "rename it to .parquet")),
    (
        b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1",
        Content(
            "xls",
            "an old Excel workbook (.xls) or one with a password",
            "open it in Excel or LibreOffice and save it as .xlsx without a password",
        ),
    ),
    (b"\x1f\x8b", Content("gzip", "a gzip archive", _UNPACK)),
    (b"BZh", Content("bzip2", "a bzip2 archive", _UNPACK)),
    (b"\xfd7zXZ\0", Content("xz", "an xz archive", _UNPACK)),
    (b"7z\xbc\xaf\x27\x1c", Content("7z", "a 7-Zip archive", _UNPACK)),
    (b"Rar!\x1a\x07", Content("rar", "a RAR archive", _UNPACK)),
    (b"\x28\xb5\x2f\xfd", Content("zstd", "a Zstandard archive", _UNPACK)),
    (b"%PDF-", Content("pdf", "a PDF document", "give the recording itself")),
    (b"version https://git-lfs", Content("lfs", "a Git LFS pointer without the data", "run 'git lfs pull' first")),
)
_ZIP = Content("zip", "a ZIP archive", _UNPACK)
_WORKBOOK = Content("zip", "an Excel workbook", "rename it to .xlsx")
_OPEN_DOCUMENT = Content("ods", "an OpenDocument spreadsheet", "open it in LibreOffice and save it as .xlsx")
_PAGE = Content("html", "a web page", "download the recording itself, or export it as CSV")
_XML = Content("xml", "an XML file, such as those of Logger Pro (.cmbl)", _EXPORT)


def recognized(path: Path, head: bytes) -> Content:
    """What the file is by its first bytes.

    Args:
        path: The file; looked into further only where it is an archive.
        head: Its first bytes, some hundred at least.
    """
    if head.startswith(b"PK\x03\x04"):
        return _archive(path)
    for start, content in _STARTS:
        if head.startswith(start):
            return content
    return _markup(head)


def _archive(path: Path) -> Content:
    """Workbooks are ZIP archives too; an archive that was cut off has lost its list of members."""
    try:
        with zipfile.ZipFile(path) as archive:
            names = archive.namelist()
            if "mimetype" in names and b"opendocument.spreadsheet" in archive.read("mimetype"):
                return _OPEN_DOCUMENT
    except (OSError, zipfile.BadZipFile):
        return _ZIP
    return _WORKBOOK if "xl/workbook.xml" in names else _ZIP


def _markup(head: bytes) -> Content:
    """XML and web pages, or a file that is not recognized."""
    text = head.removeprefix(b"\xef\xbb\xbf").lstrip().lower()
    if text.startswith((b"<!doctype html", b"<html")):
        return _PAGE
    return _XML if text.startswith((b"<?xml", b"<document")) else _UNKNOWN
