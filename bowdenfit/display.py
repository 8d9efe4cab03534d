"""How results display themselves: as blocks, from which text and HTML are made, and as rows for pandas and CSV."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import singledispatch
from html import escape
from itertools import groupby, zip_longest
from typing import TYPE_CHECKING, Any, TypeAlias

from bowdenfit.csv_tables import csv_table
from bowdenfit.words import filled, narrow_table, table

if TYPE_CHECKING:
    from pandas import DataFrame

Rows: TypeAlias = tuple[Iterable[Mapping[str, Any]] | Mapping[str, Any], Mapping[str, str]]  # rows or columns, units
_LINES, _WIDTH = 10, 90  # of what a console shows
_FEW = 3  # of what a tuple may hold to be shown as Python does
_LONGEST = 60  # characters of a cell
_SHOWN = 12  # rows of a table that is not laid out by its verb


@dataclass(frozen=True)
class Title:
    """Title of a page, underlined in text."""

    words: str

    def to_text(self) -> str:
        """Return two lines."""
        return f"{self.words}\n{'=' * len(self.words)}"

    def to_html(self) -> str:
        """Return a heading."""
        return f"<h4>{escape(self.words)}</h4>"


@dataclass(frozen=True)
class ResultTable:
    """Cells under headings.

    Args:
        heads: Headings of the columns.
        rows: Cells; a cell of several lines, the last of its row, stays in its column.
        left: Headings of columns that text aligns left, as it does the first.
        narrow: Whether columns without room in a line of text go below the others.
    """

    heads: Sequence[str]
    rows: Sequence[Sequence[str]]
    left: Sequence[str] = ("prior", "unit")
    narrow: bool = False

    def to_text(self) -> str:
        """Return aligned columns under a ruled heading."""
        lines = [line for row in self.rows for line in zip_longest(*(cell.split("\n") for cell in row), fillvalue="")]
        return (narrow_table if self.narrow else table)(self.heads, lines, self.left)

    def to_html(self) -> str:
        """Return a table without styling of its own."""
        head = "".join(f"<th>{escape(cell)}</th>" for cell in self.heads)
        cells = ["".join(f'<td style="white-space:nowrap">{escape(cell)}</td>' for cell in row) for row in self.rows]
        body = "".join(f"<tr>{row}</tr>" for row in cells).replace("\n", " ")
        return f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"


@dataclass(frozen=True)
class Legend:
    """Names with their meanings; those without one are left out."""

    meanings: Mapping[str, str]

    def __bool__(self) -> bool:
        return any(self.meanings.values())

    def to_text(self) -> str:
        """Return a line for each name."""
        return "\n".join(filled(f"{name}: {words}", hangs=True) for name, words in self.meanings.items() if words)

    def to_html(self) -> str:
        """Return a list."""
        items = (f"<li>{escape(name)}: {escape(words)}</li>" for name, words in self.meanings.items() if words)
        return f"<ul>{''.join(items)}</ul>"


@dataclass(frozen=True)
class Preformatted:
    """Text whose lines stay as they are."""

    text: str

    def __bool__(self) -> bool:
        return bool(self.text)

    def to_text(self) -> str:
        """Return the text."""
        return self.text

    def to_html(self) -> str:
        """Return the text in letters of one width."""
        return f"<pre>{escape(self.text)}</pre>"


# A text is a sentence, or "- " and an item of a list; an empty one is a gap.
Block: TypeAlias = str | Title | ResultTable | Legend | Preformatted


def separate(*groups: Iterable[Block]) -> list[Block]:
    """Return groups of blocks with gaps between them; what is empty is left out."""
    blocks = list[Block]()
    for group in groups:
        if filled_blocks := [block for block in group if block]:
            blocks += ["", *filled_blocks] if blocks else filled_blocks
    return blocks


def render_text(blocks: Iterable[Block]) -> str:
    """Return blocks as text: sentences in lines of at most 78 characters, a blank line for each gap, a line end at the end."""
    return "\n".join(filled(block) if isinstance(block, str) else block.to_text() for block in blocks) + "\n"


_MARKUP = {"sentence": ("<p>", " ", "</p>"), "item": ("<ul><li>", "</li><li>", "</li></ul>"), "other": ("", "", "")}


def render_html(blocks: Iterable[Block]) -> str:
    """Return blocks as HTML: the first sentence in bold, others in paragraphs and lists."""
    pages, is_first = list[str](), True
    for kind, group in groupby(blocks, _markup_kind):
        texts = [escape(block.removeprefix("- ")) if isinstance(block, str) else block.to_html() for block in group]
        if is_first and kind == "sentence":
            pages.append(f"<p><b>{texts.pop(0)}</b></p>")
            is_first = False
        start, between, end = _MARKUP[kind]
        pages += [f"{start}{between.join(texts)}{end}"] if texts else []
    return "".join(pages)


def _markup_kind(block: Block) -> str:
    """Return the key of a block in `_MARKUP`."""
    if not isinstance(block, str) or not block:
        return "other"
    return "item" if block.startswith("- ") else "sentence"


class Display:
    """A result that displays itself; a class gives its `sentences`, the answer first, and the rows of its table with units.

    What displays otherwise is registered with `blocks_of`.
    """

    def sentences(self) -> Sequence[str]:
        """Sentences of the result, the answer first."""
        return ()

    def _table(self) -> Rows:
        """Return the rows (or columns) of the table, and units by column; where rows have their own, by first cell."""
        return (), {}

    def to_frame(self) -> "DataFrame":
        """Return the table for pandas; `attrs["units"]` has the units by column or, of parameters, by name ("1": none)."""
        from pandas import (
            DataFrame,  # here, because pandas takes a fifth of a second, and results seldom become a frame
        )

        rows, units = self._table()
        frame = DataFrame(rows if isinstance(rows, Mapping) else list(rows))
        frame.attrs["units"] = dict(units)
        return frame

    def to_dataframe(self) -> "DataFrame":
        """Return the same as `to_frame`, by the name that it has elsewhere."""
        return self.to_frame()

    def to_csv(self) -> str:
        """Return the table as CSV; units stand behind the names of the columns, or in a column where rows have their own."""
        rows, units = self._table()
        assert not isinstance(rows, Mapping)  # a verb's answer has rows
        listed = [{_with_unit(name, units): value for name, value in row.items()} for row in rows]
        firsts = [next(iter(row.values()), "") for row in listed]
        if listed and any(isinstance(first, str) and first in units for first in firsts):
            listed = [{**row, "unit": units.get(str(first), "1")} for row, first in zip(listed, firsts, strict=True)]
        return csv_text(listed)

    def __str__(self) -> str:
        return render_text(blocks_of(self)).strip()

    def __repr__(self) -> str:
        return shorten_lines(str(self))

    def _repr_html_(self) -> str:
        return render_html(blocks_of(self))


def abbreviate(value: Any) -> str:
    """Return a value as a short text for a table cell."""
    if isinstance(value, float):
        return f"{value:.4g}"
    if hasattr(value, "shape") and not isinstance(value, str):  # a string of NumPy's has one
        return f"array of {' x '.join(map(str, value.shape)) or 'one number'}"
    if isinstance(value, Sequence | Mapping) and not isinstance(value, str):
        return f"{len(value)} in all" if len(value) > _FEW else ", ".join(map(abbreviate, value))
    text = type(value).__name__ if hasattr(value, "__dict__") else "" if value is None else str(value)
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]} ..."


def _with_unit(name: str, units: Mapping[str, str]) -> str:
    """Return the name of a column with its unit."""
    unit = units.get(name, "1")
    return name if unit == "1" else f"{name}_{unit}"


def csv_text(rows: Sequence[Mapping[str, Any]]) -> str:
    """Return rows as CSV with a heading."""
    return csv_table(next(iter(rows), {}), (row.values() for row in rows), quote_all_texts=True)


@singledispatch
def blocks_of(result: Any) -> Sequence[Block]:
    """Return the blocks of a result: its sentences and its table, unless its type has registered others."""
    rows, units = result._table()
    listed = [] if isinstance(rows, Mapping) else list(rows)
    if not listed:
        return list(result.sentences())
    heads = [f"{name} ({units[name]})" if units.get(name, "1") != "1" else name for name in listed[0]]
    cells = [[abbreviate(value) for value in row.values()] for row in listed[:_SHOWN]]
    more = [f"... and {len(listed) - _SHOWN} more"] if len(listed) > _SHOWN else []
    return separate(result.sentences(), [ResultTable(heads, cells), *more])


def shorten_lines(text: str) -> str:
    """Return the first lines of a text; the last one says how to see the others."""
    lines = [line if len(line) <= _WIDTH else f"{line[: _WIDTH - 4]} ..." for line in text.splitlines()]
    if len(lines) <= _LINES:
        return "\n".join(lines)
    return "\n".join([*lines[: _LINES - 1], f"... and {len(lines) - _LINES + 1} more lines; print() shows them."])
