"""What a file really is, by its first bytes."""

import zipfile
from dataclasses import dataclass
from pathlib import Path

TEXT = tuple(f".{ending}" for ending in ("csv", "txt", "tsv", "dat", "asc", "log", "lvm"))


@dataclass(frozen=True)
class Content:
    """A kind of file that its first bytes give away.

    Args:
        what: What it is, for people, with an article.
        endings: The endings of such files, the usual one first; none for files that nobody reads.
        remedy: What to do with such a file that has another ending, as an order; to rename it if omitted.
    """

    what: str
    endings: tuple[str, ...] = ()
    remedy: str = ""

    @property
    def advice(self) -> str:
        """What to do with such a file that has another ending."""
        return self.remedy or f"rename it to {self.endings[0]}"

    def suits(self, ending: str) -> bool:
        """Whether files with an ending may start so; those of which nobody knows how they start may start in any way."""
        return ending in self.endings or not any(ending in content.endings for content in _CONTENTS)


UNKNOWN = Content("a file of unknown kind", (*TEXT, ".mat"), "export the recording as CSV")  # MATLAB 4 has no mark
_EXPORT = "open it in the program that wrote it and export the recording as CSV"
_UNPACK = "unpack it and give the file inside"
_HDF, _BEHIND = b"\x89HDF\r\n\x1a\n", (512, 1024, 2048)  # it may stand behind bytes that are the user's own
_STARTS = {  # the longer start before the shorter one
    b"MATLAB 5": Content("a MATLAB file", (".mat",)),
    b"MATLAB 7": Content("a MATLAB 7.3 file", (".mat",)),
    _HDF: Content("an HDF5 file", (".h5", ".hdf5")),
    b"TDSm": Content("a TDMS file of National Instruments", (".tdms",)),
    b"TDSh": Content("the index of a TDMS file", (), "give the .tdms file that lies next to it"),
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
_ZIP = Content("a ZIP archive", (".xlsx", ".xlsm"), _UNPACK)  # what is left of a workbook, perhaps
_NO_WORKBOOK = Content("a ZIP archive", (), _UNPACK)
_WORKBOOK = Content("an Excel workbook", (".xlsx", ".xlsm"))
_OPEN_DOCUMENT = Content("an OpenDocument spreadsheet", (), "open it in LibreOffice and save it as .xlsx")
_PAGE = Content("a web page", (), "download the recording itself, or export it as CSV")
_XML = Content("an XML file, such as those of Logger Pro (.cmbl)", (".cmbl",), _EXPORT)
_CONTENTS = (UNKNOWN, *_STARTS.values(), _ZIP, _XML)


def recognize(path: Path, head: bytes) -> Content:
    """What the file is by its first bytes.

    Args:
        path: The file; looked into further only where it is an archive.
        head: Its first bytes, the first 4096.
    """
    if head.startswith(b"PK\x03\x04"):
        return _archive(path)
    content = next((content for start, content in _STARTS.items() if head.startswith(start)), None)
    if content is None and any(head.startswith(_HDF, at) for at in _BEHIND):
        return _STARTS[_HDF]
    return content or _markup(head)


def _archive(path: Path) -> Content:
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
    return _ZIP if "[Content_Types].xml" in names else _NO_WORKBOOK


def _markup(head: bytes) -> Content:
    """XML and web pages, or a file that is not recognized."""
    text = head.removeprefix(b"\xef\xbb\xbf").lstrip().lower()
    if text.startswith((b"<!doctype html", b"<html")):
        return _PAGE
    if text.startswith((b"<?xml", b"<document")):
        return _XML
    return PLAIN_TEXT if head and not any(byte < 9 for byte in head) and _is_utf8(head) else UNKNOWN


def _is_utf8(head: bytes) -> bool:
    """Whether bytes are text; a letter may be cut in two at their end."""
    try:
        head.decode()
    except UnicodeDecodeError as error:
        return error.start > len(head) - 4
    return True
