"""XML from strangers: no document types, entities or other files, and no more of it than a certificate has."""

import errno
from pathlib import Path
from xml.etree.ElementTree import Element, TreeBuilder
from xml.parsers.expat import ExpatError, ParserCreate, errors

from bowdenfit.errors import DatasetError
from bowdenfit.inputs import refuse_special

DCC, SI = "https://ptb.de/dcc", "https://ptb.de/si"
ROOT = f"{{{DCC}}}digitalCalibrationCertificate"
_LARGEST = 16_000_000  # bytes; a certificate has some 100 kB, with a PDF inside some MB
_MOST_ELEMENTS, _DEEPEST = 200_000, 100  # a certificate has some thousand elements, at most 30 deep


def parse_certificate(path: Path) -> Element:
    """Return the root element of a Digital Calibration Certificate.

    Args:
        path: The file.

    Raises:
        DatasetError: It is missing, too large, no XML or no such certificate.
    """
    refuse_special(path)
    try:
        size = path.stat().st_size
        data = path.read_bytes() if size <= _LARGEST else b""
    except OSError as failure:
        reason = "does not exist" if failure.errno == errno.ENOENT else f"cannot be read ({failure.strerror})"
        raise DatasetError(f"{path} {reason}; check the spelling and the folder.") from None
    if size > _LARGEST:
        raise DatasetError(
            f"{path.name} has {size / 1e6:.0f} MB, and a digital certificate of at most {_LARGEST // 1_000_000} MB is "
            "read; the usual cause is a file attached inside: ask the laboratory for the certificate without it."
        )
    root = _parse(data, path.name)
    if root.tag != ROOT:
        raise DatasetError(
            f"{path.name}: the first element is {root.tag[:80]!r}, not dcc:digitalCalibrationCertificate of {DCC}; the "
            "usual cause is another kind of XML file, or a certificate of a version before 2: name the PTB Digital "
            "Calibration Certificate."
        )
    return root


def _parse(data: bytes, name: str) -> Element:
    """Return the root element of XML, with {namespace}name as tags as `xml.etree` has them."""
    parser, builder = ParserCreate(namespace_separator="}"), TreeBuilder()
    depth = count = 0

    def begin(tag: str, attributes: dict[str, str]) -> None:
        nonlocal depth, count
        depth, count = depth + 1, count + 1
        if depth > _DEEPEST or count > _MOST_ELEMENTS:
            limit = f"{_DEEPEST} levels" if depth > _DEEPEST else f"{_MOST_ELEMENTS:,} elements"
            element = tag.rpartition("}")[2][:80]
            raise DatasetError(
                f"{name}, element {element!r}: the file has more than {limit}, which no certificate has; the usual cause is a "
                "damaged file, or one that was made to do harm: ask the laboratory for it again."
            )
        builder.start(_as_etree(tag), {_as_etree(key): value for key, value in attributes.items()})

    def end(tag: str) -> None:
        nonlocal depth
        depth -= 1
        builder.end(_as_etree(tag))

    def refuse_document_type(root: str, *_: object) -> None:
        raise DatasetError(
            f"{name}, <!DOCTYPE {root[:80]}>: a certificate has no document type, and entities defined there could read other "
            "files or fill the memory; the usual cause is a file that a program converted: remove the DOCTYPE, or ask the "
            "laboratory for the original."
        )

    parser.StartElementHandler, parser.EndElementHandler, parser.CharacterDataHandler = begin, end, builder.data
    parser.StartDoctypeDeclHandler = refuse_document_type
    try:
        parser.Parse(data, True)
        return builder.close()
    except (ExpatError, LookupError, ValueError) as failure:
        reason = errors.messages.get(getattr(failure, "code", 0), "its encoding is not known")
        raise DatasetError(
            f"{name}, line {parser.CurrentLineNumber}: not well-formed XML ({reason}); the usual cause is a download "
            "that was cut off, or a PDF under this name: ask the laboratory for the XML file again."
        ) from None


def _as_etree(tag: str) -> str:
    """Return a name as `xml.etree` writes it."""
    return f"{{{tag}" if "}" in tag else tag
