"""How results show themselves: a console has the first lines of what their verb prints, a notebook a page, pandas a table."""

import re
from collections.abc import Iterable, Mapping, Sequence
from functools import singledispatch
from html import escape
from typing import TYPE_CHECKING, Any, TypeAlias, TypeVar

from bowdenfit.words import few, filled, table

if TYPE_CHECKING:
    from pandas import DataFrame

Rows: TypeAlias = tuple[Iterable[Mapping[str, Any]] | Mapping[str, Any], Mapping[str, str]]  # rows or columns, units
Item = TypeVar("Item")
_LINES, _WIDTH = 10, 90  # of what a console shows
_SHOWN = 12  # rows of a table that is not laid out by its verb
_TITLE, _RULER, _MORE = re.compile(r"=+"), re.compile(r"-{3,}"), re.compile(r"(\.\.\. )?and \d+ more\b")
_COLUMNS = re.compile(r" {2,}")


class Display:
    """A result that shows itself; a class says its `sentences`, the answer first, and the rows of its table with their units.

    Words that are laid out elsewhere are registered with `text_of`.
    """

    def sentences(self) -> Sequence[str]:
        """What it says, the answer first."""
        return ()

    def _table(self) -> Rows:
        """Rows (or columns) of its table, and units by column; where rows have units of their own, by their first cell."""
        return (), {}

    def to_frame(self) -> "DataFrame":
        """Its table for pandas; `attrs["units"]` has the units by column or, of parameters, by name ("1": none)."""
        from pandas import DataFrame

        rows, units = self._table()
        frame = DataFrame(rows if isinstance(rows, Mapping) else list(rows))
        frame.attrs["units"] = dict(units)
        return frame

    def to_csv(self) -> str:
        """Its table as CSV; units stand behind the names of the columns, of rows with units of their own in a column."""
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
        return shortened(str(self))

    def _repr_html_(self) -> str:
        return as_html(str(self))


class Several(Display, tuple[Item, ...]):
    """Several of a kind, a row each."""

    def sentences(self) -> Sequence[str]:
        """How many there are."""
        return [f"{len(self)} in all."]

    def _table(self) -> Rows:
        return [vars(each) for each in self], {}


class Named(Display, dict[str, Item]):
    """Several of a kind, by name."""

    def sentences(self) -> Sequence[str]:
        """Their names."""
        return [f"{len(self)} in all: {few(self)}."]

    def _table(self) -> Rows:
        shapes = {name: {"shape": each.shape} if hasattr(each, "shape") else vars(each) for name, each in self.items()}
        return [{"name": name} | row for name, row in shapes.items()], {}


def _with_unit(name: str, units: Mapping[str, str]) -> str:
    """Name of a column with its unit."""
    unit = units.get(name, "1")
    return name if unit == "1" else f"{name}_{unit}"


def csv_text(rows: Sequence[Mapping[str, Any]]) -> str:
    """Rows as CSV, with a heading; empty without rows."""
    lines = [",".join(_csv_cell(value) for value in row.values()) for row in rows]
    return "\n".join([",".join(next(iter(rows), {})), *lines]) + "\n"


def _csv_cell(value: object) -> str:
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, str):
        return '"{}"'.format(value.replace('"', '""'))
    return "" if value is None else str(value).lower()


@singledispatch
def text_of(result: Any) -> str:
    """All that a result says in words; its sentences and its table where nothing else is registered."""
    rows, units = result._table()
    said = "\n".join(filled(sentence) for sentence in result.sentences())
    if isinstance(rows, Mapping) or not (shown := list(rows)):
        return said
    heads = [f"{name} ({units[name]})" if units.get(name, "1") != "1" else name for name in shown[0]]
    cells = [[_cell(value) for value in row.values()] for row in shown[:_SHOWN]]
    more = f"\n... and {len(shown) - _SHOWN} more" if len(shown) > _SHOWN else ""
    return "\n\n".join(part for part in (said, table(heads, cells) + more) if part)


def _cell(value: object) -> str:
    return f"{value:.4g}" if isinstance(value, float) else "" if value is None else str(value)


def shortened(text: str) -> str:
    """The first lines of a text; the last one says how to see the rest."""
    lines = [line if len(line) <= _WIDTH else f"{line[: _WIDTH - 4]} ..." for line in text.splitlines()]
    if len(lines) <= _LINES:
        return "\n".join(lines)
    return "\n".join([*lines[: _LINES - 1], f"... and {len(lines) - _LINES + 1} more lines; print() shows them."])


def as_html(text: str) -> str:
    """A text that a verb prints as a notebook shows it: its first sentence in bold, ruled columns as tables."""
    title, _, body = text.strip().partition("\n")
    ruler, _, below = body.partition("\n")
    is_titled = bool(_TITLE.fullmatch(ruler))
    first, rest = _first_sentence(below if is_titled else text.strip())
    blocks = [_block(block.splitlines()) for block in rest.strip("\n").split("\n\n") if block]
    return f"{f'<h4>{escape(title)}</h4>' if is_titled else ''}<p><b>{escape(first)}</b></p>{''.join(blocks)}"


def _first_sentence(text: str) -> tuple[str, str]:
    """The lines up to the first that ends a sentence, and what follows."""
    lines = text.splitlines() or [""]
    for n, line in enumerate(lines, start=1):
        if not line or line.endswith("."):
            return " ".join(lines[:n]).strip(), "\n".join(lines[n:])
    return " ".join(lines), ""


def _block(lines: list[str]) -> str:
    """Lines without a blank one between them: prose, a list, or columns below what stands above them."""
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
    """Whether a line is a row of the table above it, and not what is said below."""
    columns = len(_cells(above[:1] + above[2:])[0])
    return not _MORE.match(line) and (len(above) == 2 or len(_cells([above[0], *above[2:], line])[0]) >= columns)


def _cells(lines: list[str]) -> list[list[str]]:
    """Cells of columns that two blanks or more divide in every line."""
    width = max(map(len, lines))
    covered = "".join(" " if all(line[i : i + 1].isspace() or i >= len(line) for line in lines) else "x" for i in range(width))
    starts = [0, *(found.end() for found in _COLUMNS.finditer(covered) if found.start() and found.end() < width)]
    return [[line[a:b].strip() for a, b in zip(starts, [*starts[1:], width], strict=True)] for line in lines]


def _html_table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table without styling of its own."""
    head = "".join(f"<th>{escape(cell)}</th>" for cell in heads)
    cells = ["".join(f'<td style="white-space:nowrap">{escape(cell)}</td>' for cell in row) for row in rows]
    body = "".join(f"<tr>{row}</tr>" for row in cells)
    return f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"
