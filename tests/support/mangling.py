"""Valid inputs made invalid, or at least odd, in the ways that editors, loggers and strangers do."""

import random
import re
from collections.abc import Callable

ODD_CELLS = (
    "", " ", "nan", "inf", "-inf", "1e309", "-1e-320", "0", "-1", "1e300", "1,5", "1.234,5", "12 N", "abc", "'7", '"', '""""',
    "=1+1", "#REF!", "\ufeff5", "٣", "½", "1_000", "0x10", "true", "None", "<5", "<", "> 3", "(82.1)", "5±1", "\x1b[31m",
    "\u202e7",
    "9" * 400, "x" * 3000, "2021-01-01", "1:30", "--5", "+5", "5-", "1e", ".", "-", "\t", ";", "N/A", "-999", "1e5\u00a0", "５",
)  # fmt: skip
ODD_VALUES = (
    "nan", "inf", "-1", "0", "1e400", "''", "'x'", "[]", "{}", "true", "[[1]]", "99999999999999999999999", "'\\u0000'",
    "1979-05-27",    "{ value = 1 }", '{ value = 1, unit = "furlong" }', '{ value = -1, unit = "deg" }', '{ name = "" }',
    "[1, 2, 3]",
    "'../../x'", "'/dev/null'",
)  # fmt: skip
Mangle = Callable[[random.Random, str], str]


def cell(chance: random.Random, text: str) -> str:
    """Another value in one cell."""
    lines = text.splitlines(keepends=True)
    at = chance.randrange(len(lines))
    cells = lines[at].rstrip("\r\n").split(",")
    cells[chance.randrange(len(cells))] = chance.choice(ODD_CELLS)
    lines[at] = ",".join(cells) + "\n"
    return "".join(lines)


def line(chance: random.Random, text: str) -> str:
    """A line more, less, twice, cut, empty, or in another place."""
    lines = text.splitlines(keepends=True)
    at, to = chance.randrange(len(lines)), chance.randrange(len(lines))
    odd = ("\n", ",,,\n", "# remark\n", "mean,1,2\n", lines[at], "\x00\n", '"open\n', lines[at][: len(lines[at]) // 2])
    how = chance.randrange(4)
    if how == 0:
        del lines[at]
    elif how == 1:
        lines[at], lines[to] = lines[to], lines[at]
    elif how == 2:
        lines[at] = chance.choice(odd)
    else:
        lines.insert(at, chance.choice(odd))
    return "".join(lines)


def letters(chance: random.Random, text: str) -> str:
    """A few letters changed, taken out or put in."""
    for _ in range(chance.randint(1, 4)):
        at = chance.randrange(len(text) + 1)
        text = (
            text[:at]
            + chance.choice(["", "\0", ",", ";", '"', "\n", "é", "\u2028", "-", "9", "e", "[", "{", "="])
            + text[at + 1 :]
        )
    return text


def column(chance: random.Random, text: str) -> str:
    """A column less, twice, under another heading, or of one odd value."""
    rows = [row.split(",") for row in text.splitlines()]
    at = chance.randrange(max(len(row) for row in rows))
    how, odd = chance.randrange(4), chance.choice(ODD_CELLS)
    for number, row in enumerate(rows):
        if at < len(row):
            if how == 0:
                del row[at]
            elif how == 1:
                row.append(row[at])
            elif (how == 2 and number == 0) or (how == 3 and number):
                row[at] = odd
    return "\n".join(",".join(row) for row in rows) + "\n"


def cut(chance: random.Random, text: str) -> str:
    """The end, or the beginning, is missing."""
    at = chance.randrange(len(text))
    return text[:at] if chance.random() < 0.7 else text[at:]


def setting(chance: random.Random, text: str) -> str:
    """Another value, key or place of a setting in a description."""
    found = list(re.finditer(r"^([\w.]+) *= *(.+)$", text, re.M))
    if not found:
        return text + "x = 1\n"
    one = chance.choice(found)
    key, value = one.group(1), one.group(2)
    new = chance.choice(
        [
            f"{key} = {chance.choice(ODD_VALUES)}",
            f"{key}x = {value}",
            f"{key}.a = {value}",
            "",
            f"{key} = {value}\n{key} = {value}",
        ]
    )
    return text[: one.start()] + new + text[one.end() :]


TABLES: tuple[Mangle, ...] = (cell, cell, cell, line, letters, column, cut)
DESCRIPTIONS: tuple[Mangle, ...] = (setting, setting, setting, line, letters, cut)
