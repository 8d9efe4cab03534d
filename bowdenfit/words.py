"""Plain text for people: quoted values, lists in words, significant digits, filled paragraphs, aligned columns."""

import math
import re
import textwrap
from collections.abc import Collection, Iterable, Sequence
from itertools import zip_longest

_LARGE = 1e7  # from which on powers of ten are easier to read than zeros
_LONGEST = 40  # characters of a quoted value
WIDTH = 78  # of a line; a terminal has 80 columns, and some count bytes
_KEPT = re.compile(r"(?<=\d) (?=(?:mm|N|deg|ms|points)\b|[%±])|(?<=±) (?=\d)")  # blanks at which no line ends
_PLAIN = str.maketrans({"±": "+-", "µ": "u", "μ": "mu", "Λ": "Lambda", "²": "^2", "–": "-", "−": "-", "…": "..."})


def shown(value: object) -> str:
    """Return a text in quotes, anything else as Python writes it; the middle of a long value is left out."""
    try:
        text = repr(" ".join(value.split()) if isinstance(value, str) else value)
    except ValueError:  # Python refuses to write out integers of more than 4300 digits
        return "a very large number"
    return text if len(text) <= _LONGEST else f"{text[: _LONGEST - 15]}...{text[-12:]}"


def begin_sentence(quantity: str) -> str:
    """Return a quantity as it begins a sentence or names an axis: in words with a capital, a coefficient under its name."""
    return capitalized(quantity) if " " in quantity else quantity


def capitalized(text: str) -> str:
    """Return text whose first letter is upper case; all others keep their case, so that "freie Hülle" becomes "Freie Hülle"."""
    return text[:1].upper() + text[1:]


def printable(text: str) -> str:
    """Return text with control characters written out, so that nothing in it steers a terminal."""
    return "".join(x if x in "\n\t" or x == " " or x.isprintable() or x == "\u00a0" else ascii(x)[1:-1] for x in text)


def quoted(names: tuple[str, ...], most: int = 12) -> str:
    """Return names in quotes with commas between them."""
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return ", ".join(shown(name) for name in names[:most]) + more


def few(names: Iterable[str], most: int = 3) -> str:
    """Return names with commas and a last "and"; of many the first few, and how many more there are.

    Between names that have commas themselves there are semicolons.
    """
    all_names = list(names)
    more = [f"{len(all_names) - most} more"] if len(all_names) > most else []
    parts = [*all_names[:most], *more]
    if len(parts) > 1 and any("," in name for name in parts):
        return "; ".join(parts[:-1]) + "; and " + parts[-1]
    return listed(parts)


def listed(parts: Sequence[str]) -> str:
    """Return parts with commas and a last "and"."""
    return ", ".join(parts[:-1]) + " and " + parts[-1] if len(parts) > 1 else "".join(parts)


def decimals(scale: float, value: float = math.nan) -> int:
    """Return the decimals that show a quantity to two significant digits of its uncertainty.

    Where there is no uncertainty, four, or those that the value has if it has fewer.
    """
    if not math.isfinite(scale) or scale <= 0:
        return len(f"{value:.4f}".rstrip("0").partition(".")[2]) if math.isfinite(value) else 4
    return min(max(1 - math.floor(math.log10(scale)), 0), 8)


def significant(value: float, digits: int = 3) -> str:
    """Return a number to some significant digits, without powers of ten where people would write zeros: '0.0123', '1040'."""
    text = f"{value:.{digits}g}"
    return f"{float(text):.0f}" if "e+" in text and abs(value) < _LARGE else text


def counted(n: int, noun: str, several: str = "") -> str:
    """Return a number with its noun: '1 run', '3 runs'."""
    return f"{n} {noun}" if n == 1 else f"{n} {several or noun + 's'}"


def percent(share: float, digits: int = 1, sign: str = "") -> str:
    """Return a share in percent, such as '67.5 %'."""
    return f"{100 * share:{sign}.{digits}f} %"


def give_or_take(value: float, sd: float) -> str:
    """Return a value with its standard deviation, such as '0.112 ± 0.013'."""
    digits = decimals(sd)
    return f"{value:z.{digits}f} ± {sd:z.{digits}f}"


def in_ascii(text: str) -> str:
    """Return a text in ASCII."""
    return text.translate(_PLAIN).encode("ascii", "replace").decode("ascii")


def unbroken(text: str) -> str:
    """Return a text with no-break spaces between numbers and their units."""
    return _KEPT.sub("\N{NO-BREAK SPACE}", text)


def filled(text: str, indent: str = "", hangs: bool = False) -> str:
    """Return a paragraph in lines of at most `WIDTH` characters; no number loses its unit to the next line.

    Args:
        text: The paragraph.
        indent: Text before each line.
        hangs: Whether all lines but the first stand further in, as those of a list do.
    """
    hanging = indent + ("  " if hangs or text.startswith("- ") else "")
    lines = textwrap.wrap(unbroken(text), WIDTH, initial_indent=indent, subsequent_indent=hanging, break_on_hyphens=False)
    return "\n".join(lines).replace("\N{NO-BREAK SPACE}", " ")


def kept_narrow(line: str, indent: str = "") -> str:
    """Return a line unchanged if it fits into a terminal, else filled; so that a row of a table stays one line."""
    return (indent + line).rstrip() if len(line) <= WIDTH else filled(line, indent, hangs=True)


def table(heads: Sequence[str], rows: Sequence[Sequence[str]], left: Collection[str] = ("prior", "unit")) -> str:
    """Return columns under a ruled heading, the first and those named in `left` aligned left, the others right."""
    widths = [max(len(str(row[i])) for row in [heads, *rows]) for i in range(len(heads))]
    at_left = {i for i, head in enumerate(heads) if i == 0 or head in left}
    lines = [
        "  ".join(
            f"{cell:<{w}}" if i in at_left else f"{cell:>{w}}"
            for i, (cell, w) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in [heads, *rows]
    ]
    return "\n".join([lines[0], "-" * len(lines[0]), *lines[1:]])


def _break_cells(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> tuple[Sequence[str], list[Sequence[str]]]:
    """Return headings and rows with cells broken into several rows where they are too wide."""
    first, *others = (max(len(row[i]) for row in [heads, *rows]) for i in range(len(heads)))
    if first + 2 + max(others, default=0) <= WIDTH:
        return heads, list(rows)
    left = min(first, max(WIDTH - sum(2 + w for w in others), WIDTH // 2))
    rooms = [left, *(max(1, WIDTH - 2 - left) for _ in others)]
    parts = [[textwrap.wrap(c, room) or [""] for c, room in zip(row, rooms, strict=True)] for row in [heads, *rows]]
    lines = [[tuple(column) for column in zip_longest(*row, fillvalue="")] for row in parts]
    if len(lines[0]) > 1:  # a heading is one line
        return heads, list(rows)
    return lines[0][0], [line for row in lines[1:] for line in row]


def narrow_table(heads: Sequence[str], rows: Sequence[Sequence[str]], left: Collection[str] = ("prior", "unit")) -> str:
    """Return a table of at most `WIDTH` characters: columns without room stand below, beside the first again.

    Cells that are too wide even so are broken into lines.
    """
    heads, rows = _break_cells(heads, rows)
    widths = [max(len(row[i]) for row in [heads, *rows]) for i in range(len(heads))]
    blocks, remaining = list[str](), list(range(1, len(heads)))
    while remaining or not blocks:
        columns, width = [0], widths[0]
        while remaining and (len(columns) == 1 or width + 2 + widths[remaining[0]] <= WIDTH):
            width += 2 + widths[remaining[0]]
            columns.append(remaining.pop(0))
        blocks.append(table([heads[i] for i in columns], [[row[i] for i in columns] for row in rows], left))
    return "\n\n".join(blocks)
