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
    index = chance.randrange(len(lines))
    cells = lines[index].rstrip("\r\n").split(",")
    cells[chance.randrange(len(cells))] = chance.choice(ODD_CELLS)
    lines[index] = ",".join(cells) + "\n"
    return "".join(lines)


def line(chance: random.Random, text: str) -> str:
    """A line more, less, twice, cut, empty, or in another place."""
    lines = text.splitlines(keepends=True)
    index, to = chance.randrange(len(lines)), chance.randrange(len(lines))
    odd = ("\n", ",,,\n", "# remark\n", "mean,1,2\n", lines[index], "\x00\n", '"open\n', lines[index][: len(lines[index]) // 2])
    how = chance.randrange(4)
    if how == 0:
        del lines[index]
    elif how == 1:
        lines[index], lines[to] = lines[to], lines[index]
    elif how == 2:
        lines[index] = chance.choice(odd)
    else:
        lines.insert(index, chance.choice(odd))
    return "".join(lines)


def letters(chance: random.Random, text: str) -> str:
    """A few letters changed, taken out or put in."""
    for _ in range(chance.randint(1, 4)):
        index = chance.randrange(len(text) + 1)
        text = (
            text[:index]
            + chance.choice(["", "\0", ",", ";", '"', "\n", "é", "\u2028", "-", "9", "e", "[", "{", "="])
            + text[index + 1 :]
        )
    return text


def column(chance: random.Random, text: str) -> str:
    """A column less, twice, under another heading, or of one odd value."""
    rows = [row.split(",") for row in text.splitlines()]
    index = chance.randrange(max(len(row) for row in rows))
    how, odd = chance.randrange(4), chance.choice(ODD_CELLS)
    for number, row in enumerate(rows):
        if index < len(row):
            if how == 0:
                del row[index]
            elif how == 1:
                row.append(row[index])
            elif (how == 2 and number == 0) or (how == 3 and number):
                row[index] = odd
    return "\n".join(",".join(row) for row in rows) + "\n"


def cut(chance: random.Random, text: str) -> str:
    """The end, or the beginning, is missing."""
    index = chance.randrange(len(text))
    return text[:index] if chance.random() < 0.7 else text[index:]


def setting(chance: random.Random, text: str) -> str:
    """Another value, key or place of a setting in a description."""
    matches = list(re.finditer(r"^([\w.]+) *= *(.+)$", text, re.M))
    if not matches:
        return text + "x = 1\n"
    picked = chance.choice(matches)
    key, value = picked.group(1), picked.group(2)
    new = chance.choice(
        [
            f"{key} = {chance.choice(ODD_VALUES)}",
            f"{key}x = {value}",
            f"{key}.a = {value}",
            "",
            f"{key} = {value}\n{key} = {value}",
        ]
    )
    return text[: picked.start()] + new + text[picked.end() :]


TABLES: tuple[Mangle, ...] = (cell, cell, cell, line, letters, column, cut)
DESCRIPTIONS: tuple[Mangle, ...] = (setting, setting, setting, line, letters, cut)
