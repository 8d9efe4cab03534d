"""How results display themselves: a console shows the first lines of what their verb prints, a notebook HTML, pandas rows."""

import inspect
import re
from collections.abc import Iterable, Mapping, Sequence
from functools import singledispatch
from html import escape
from typing import TYPE_CHECKING, Any, TypeAlias, TypeVar

from bowdenfit.csv_tables import csv_table
from bowdenfit.words import few, filled, table

if TYPE_CHECKING:
    from pandas import DataFrame

Rows: TypeAlias = tuple[Iterable[Mapping[str, Any]] | Mapping[str, Any], Mapping[str, str]]  # rows or columns, units
Item = TypeVar("Item")
_LINES, _WIDTH = 10, 90  # of what a console shows
_FEW = 3  # of what a tuple may hold to be shown as Python does
_LONGEST = 60  # characters of a cell
_SHOWN = 12  # rows of a table that is not laid out by its verb


class Display:
    """A result that displays itself; a class gives its `sentences`, the answer first, and the rows of its table with units.

    Texts that are laid out elsewhere are registered with `text_of`. Tuples and dictionaries in a dataclass display themselves.
    """

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not name.startswith("_"):
                vars(self)[name] = make_displayable(value)

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
        return text_of(self).strip()

    def __repr__(self) -> str:
        return shorten_lines(str(self))

    def _repr_html_(self) -> str:
        return as_html(str(self))


class Part(Display):
    """A part of a result, displayed by the first line of its docstring and a row for each field."""

    def sentences(self) -> Sequence[str]:
        """Return what it is."""
        return [inspect.cleandoc(self.__doc__ or "").partition("\n")[0]]

    def _table(self) -> Rows:
        return [{"field": name, "value": abbreviate(value)} for name, value in _public_fields(self).items()], {}


class Several(Display, tuple[Item, ...]):
    """A tuple of results of one kind, displayed with a row for each."""

    def sentences(self) -> Sequence[str]:
        """Return how many there are."""
        return [f"{len(self)} in all."]

    def _table(self) -> Rows:
        return _align_columns([_public_fields(item) for item in self]), {}


class Named(Display, dict[str, Item]):
    """A dictionary of results of one kind, displayed with a row for each."""

    def sentences(self) -> Sequence[str]:
        """Their names."""
        return [f"{len(self)} in all: {few(map(str, self))}."]

    def _table(self) -> Rows:
        rows = _align_columns([_public_fields(item) for item in self.values()])
        return [{"name": name} | row for name, row in zip(self, rows, strict=True)], {}


def make_displayable(value: Any) -> Any:
    """Return dictionaries and longer tuples as types that display themselves; anything else unchanged."""
    if type(value) is dict:
        return Named({name: make_displayable(item) for name, item in value.items()})
    if type(value) is tuple and (len(value) > _FEW or any(hasattr(item, "__dict__") for item in value)):
        return Several(map(make_displayable, value))
    return value


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


def _public_fields(value: Any) -> dict[str, Any]:
    """Return the public fields of a value by name, or the value itself under "value"."""
    if isinstance(value, Mapping):
        return {str(name): item for name, item in value.items()}
    if isinstance(value, Sequence) or not hasattr(value, "__dict__"):
        return {"value": value}
    return {name: item for name, item in vars(value).items() if not name.startswith("_")}


def _align_columns(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return rows that share their columns unchanged; others as one abbreviated column."""
    return rows if len({tuple(row) for row in rows}) <= 1 else [{"value": abbreviate(row)} for row in rows]


def _with_unit(name: str, units: Mapping[str, str]) -> str:
    """Return the name of a column with its unit."""
    unit = units.get(name, "1")
    return name if unit == "1" else f"{name}_{unit}"


def csv_text(rows: Sequence[Mapping[str, Any]]) -> str:
    """Return rows as CSV with a heading."""
    return csv_table(next(iter(rows), {}), (row.values() for row in rows), quote_all_texts=True)


@singledispatch
def text_of(result: Any) -> str:
    """Return the full text of a result: its sentences and its table, unless its type has registered another text."""
    rows, units = result._table()
    sentences = "\n".join(filled(sentence) for sentence in result.sentences())
    if isinstance(rows, Mapping) or not (listed := list(rows)):
        return sentences
    heads = [f"{name} ({units[name]})" if units.get(name, "1") != "1" else name for name in listed[0]]
    cells = [[abbreviate(value) for value in row.values()] for row in listed[:_SHOWN]]
    more = f"\n... and {len(listed) - _SHOWN} more" if len(listed) > _SHOWN else ""
    return "\n\n".join(part for part in (sentences, table(heads, cells) + more) if part)


def shorten_lines(text: str) -> str:
    """Return the first lines of a text; the last one says how to see the others."""
    lines = [line if len(line) <= _WIDTH else f"{line[: _WIDTH - 4]} ..." for line in text.splitlines()]
    if len(lines) <= _LINES:
        return "\n".join(lines)
    return "\n".join([*lines[: _LINES - 1], f"... and {len(lines) - _LINES + 1} more lines; print() shows them."])


_TITLE, _RULER, _MORE = re.compile(r"=+"), re.compile(r"-{3,}"), re.compile(r"(\.\.\. )?and \d+ more\b")
_COLUMNS = re.compile(r" {2,}")


def as_html(text: str) -> str:
    """Return a verb's text as HTML: its first sentence in bold, ruled columns as tables."""
    title, _, body = text.strip().partition("\n")
    ruler, _, below = body.partition("\n")
    is_titled = bool(_TITLE.fullmatch(ruler))
    first, body_text = _first_sentence(below if is_titled else text.strip())
    blocks = [_block(block.splitlines()) for block in body_text.strip("\n").split("\n\n") if block]
    return f"{f'<h4>{escape(title)}</h4>' if is_titled else ''}<p><b>{escape(first)}</b></p>{''.join(blocks)}"


def _first_sentence(text: str) -> tuple[str, str]:
    """Return the lines up to the first that ends a sentence, and the lines after it."""
    lines = text.splitlines() or [""]
    for n, line in enumerate(lines, start=1):
        if not line or line.endswith("."):
            return " ".join(lines[:n]).strip(), "\n".join(lines[n:])
    return " ".join(lines), ""


def _block(lines: list[str]) -> str:
    """Return a block of lines as HTML: a paragraph, a list, or a table with the text above and below it."""
    ruled = next((i for i, line in enumerate(lines) if _RULER.fullmatch(line)), None)
    if ruled:
        end = next((i for i in range(ruled + 1, len(lines)) if not _continues(lines[ruled - 1 : i], lines[i])), len(lines))
        head, *rows = _cells([lines[ruled - 1], *lines[ruled + 1 : end]])
        above, below = (_block(part) if part else "" for part in (lines[: ruled - 1], lines[end:]))
        return above + _html_table(head, rows) + below
    if any(line.startswith((" ", "- ")) for line in lines):
        return f"<pre>{escape(chr(10).join(lines))}</pre>"
    return f"<p>{escape(' '.join(lines))}</p>"


def _continues(above: list[str], line: str) -> bool:
    """Return whether a line is a row of the table above it."""
    columns = len(_cells(above[:1] + above[2:])[0])
    return not _MORE.match(line) and (len(above) == 2 or len(_cells([above[0], *above[2:], line])[0]) >= columns)


def _cells(lines: list[str]) -> list[list[str]]:
    """Split lines into cells at columns where all lines have two blanks or more."""
    width = max(map(len, lines))
    covered = "".join(" " if all(line[i : i + 1].isspace() or i >= len(line) for line in lines) else "x" for i in range(width))
    starts = [0, *(gap.end() for gap in _COLUMNS.finditer(covered) if gap.start() and gap.end() < width)]
    return [[line[a:b].strip() for a, b in zip(starts, [*starts[1:], width], strict=True)] for line in lines]


def _html_table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return an HTML table without styling of its own."""
    head = "".join(f"<th>{escape(cell)}</th>" for cell in heads)
    cells = ["".join(f'<td style="white-space:nowrap">{escape(cell)}</td>' for cell in row) for row in rows]
    body = "".join(f"<tr>{row}</tr>" for row in cells)
    return f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"
