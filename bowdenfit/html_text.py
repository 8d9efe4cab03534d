"""A text that a verb prints as a notebook shows it."""

import re
from collections.abc import Sequence
from html import escape

_TITLE, _RULER, _MORE = re.compile(r"=+"), re.compile(r"-{3,}"), re.compile(r"(\.\.\. )?and \d+ more\b")
_COLUMNS = re.compile(r" {2,}")


def as_html(text: str) -> str:
    """A text that a verb prints as a notebook shows it: its first sentence in bold, ruled columns as tables."""
    title, _, body = text.strip().partition("\n")
    ruler, _, below = body.partition("\n")
    is_titled = bool(_TITLE.fullmatch(ruler))
    first, body_text = _first_sentence(below if is_titled else text.strip())
    blocks = [_block(block.splitlines()) for block in body_text.strip("\n").split("\n\n") if block]
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
    starts = [0, *(gap.end() for gap in _COLUMNS.finditer(covered) if gap.start() and gap.end() < width)]
    return [[line[a:b].strip() for a, b in zip(starts, [*starts[1:], width], strict=True)] for line in lines]


def _html_table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table without styling of its own."""
    head = "".join(f"<th>{escape(cell)}</th>" for cell in heads)
    cells = ["".join(f'<td style="white-space:nowrap">{escape(cell)}</td>' for cell in row) for row in rows]
    body = "".join(f"<tr>{row}</tr>" for row in cells)
    return f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"
