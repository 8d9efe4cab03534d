"""Logger Pro's .cmbl files: XML with one element a column, its numbers as lines of text."""

from pathlib import Path
from xml.etree.ElementTree import Element, XMLParser

import numpy as np

from bowdenfit.errors import DatasetError
from bowdenfit.files.channels import Channel, ChannelFile, UnreadNames, make_channel_file, refuse_damage, refuse_larger
from bowdenfit.files.clocks import assign_clocks
from bowdenfit.types import Vector

LARGEST_BYTES = 512 * 1024**2  # judged: XML takes several times its size in memory


def read(path: Path) -> ChannelFile:
    """Read a Logger Pro file.

    Every column of every run (Logger Pro calls it a data set) is a channel, named "Latest/Force" where there are several
    runs and "Force" where there is one; crossed-out and empty cells are missing samples.

    Args:
        path: The file.

    Raises:
        DatasetError: It is too large, damaged, or holds no numbers.
    """
    refuse_larger(path, LARGEST_BYTES, "export the run as CSV from Logger Pro")
    with refuse_damage(path):
        root = _parse(path)
    columns = [(name, column) for name, run in _runs(root) for column in run.iter("DataColumn")]
    several = len({name for name, _ in columns}) > 1
    cells = [_cells(column) for _, column in columns]
    channels = [
        Channel(
            f"{run}/{_text(c, 'DataObjectName')}" if several else _text(c, "DataObjectName"), _text(c, "ColumnUnits"), v
        )
        for (run, c), v in zip(columns, cells, strict=True)
        if np.isfinite(v).any()
    ]
    return make_channel_file(path, "Logger Pro", assign_clocks(channels), UnreadNames())


def _parse(path: Path) -> Element:
    """Return the document; declarations of entities, which no such file needs, are refused."""
    data = path.read_bytes()
    if b"<!ENTITY" in data or b"<!DOCTYPE" in data:
        raise DatasetError(
            f"{path.name} declares XML entities, which Logger Pro does not write; export the run as CSV."
        )
    parser = XMLParser()  # noqa: S314  (without entities there is nothing to expand)
    parser.feed(data)
    return parser.close()


def _runs(root: Element) -> list[tuple[str, Element]]:
    return [(_text(run, "DataSetName") or f"run {i}", run) for i, run in enumerate(root.iter("DataSet"), start=1)]


def _text(element: Element, tag: str) -> str:
    return " ".join((element.findtext(tag) or "").split())


def _cells(column: Element) -> Vector:
    lines = (column.findtext("ColumnCells") or "").split()
    return np.array([_number(line) for line in lines], dtype=float)


def _number(text: str) -> float:
    """Return a number; anything else, such as the mark of a crossed-out cell, is a missing sample."""
    try:
        return float(text)
    except ValueError:
        return float("nan")
