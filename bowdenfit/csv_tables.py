"""Tables as CSV: every one is written here, so that no name in it becomes a formula of a spreadsheet."""

import re
from collections.abc import Callable, Iterable, Sequence

_SEPARATORS = ",;|\t"  # between cells, in one country or another
_NUMBER = r"[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?"
# How a formula begins (OWASP, "CSV Injection"), also in the wide letters of East Asian keyboards; a number is none.
_FORMULA = re.compile(rf"(?!\s*{_NUMBER}\s*\Z)\s*[=+@\-\uff1d\uff0b\uff20\uff0d]", re.IGNORECASE)


def csv_table(
    heads: Iterable[str],
    rows: Iterable[Iterable[object]],
    *,
    number: Callable[[float], str] = "{:.6g}".format,
    quote_all_texts: bool = False,
) -> str:
    """Return a table as CSV.

    Args:
        heads: Names of its columns.
        rows: Cells: texts, numbers, booleans, or None for an empty one.
        number: How a number with a decimal point is written.
        quote_all_texts: Whether cells that are texts are in quotes even where they need none.
    """
    def cell_text(value: object) -> str:
        if isinstance(value, float):
            return number(value)
        if isinstance(value, str):
            return _quote(value) if quote_all_texts else _quote_if_needed(value)
        return "" if value is None else _quote_if_needed(str(value).lower())  # True is true

    lines = [map(_quote_if_needed, heads), *(map(cell_text, row) for row in rows)]
    return "".join(",".join(line) + "\n" for line in lines)


def csv_comment(lines: Sequence[str]) -> str:
    """Return lines as comments above a table, in which a spreadsheet, which splits them into cells, finds no formula either."""
    return "".join(f"# {''.join(map(_guard, re.split(f'([{_SEPARATORS}])', _without_quotes(line))))}\n" for line in lines)


def _without_quotes(text: str) -> str:
    return text.replace('"', "'")


def _quote_if_needed(text: str) -> str:
    is_plain = not set(text) & {*_SEPARATORS, *'"\r\n'} and text == text.strip() and text[:1] not in ("#", "'")
    return text if is_plain and not _FORMULA.match(text) else _quote(text)


def _quote(text: str) -> str:
    return '"{}"'.format(_guard(text).replace('"', '""'))


def _guard(text: str) -> str:
    """Return a text behind an apostrophe if a spreadsheet would take it for a formula."""
    return f"'{text}" if _FORMULA.match(text) else text
