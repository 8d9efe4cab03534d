"""More ways in which strangers make a data set odd: as spreadsheets save it, scripts write it, or attackers pack it."""

import os
import random
import re
import shutil
from pathlib import Path

from mangled_inputs import ODD_CELLS, ODD_VALUES, Mangle

BYTES = "surrogateescape"  # how bytes that are no text stand in a text
LETTERS = "αβγδ日本語é\u202e\u200b\ufeff"
UNITS = ("N", "lbf", "kg", "mm", "deg", "rad", "%", "", "?", "N/m", "V", "m/s^2", "kN·m", "[", "x" * 300)
HEADINGS = ("input_force_N", "output_force_N", "wrap_angle_deg", "time (s)", "run", "stroke", "", "=1+1", "efficiency", "date")
LONGEST = 3_000_000  # characters of what repeats itself


def _rows(text: str) -> list[list[str]]:
    return [row.split(",") for row in text.splitlines()]


def _joined(rows: list[list[str]]) -> str:
    return "\n".join(",".join(row) for row in rows) + "\n"


def encoding(chance: random.Random, text: str) -> str:
    """Saved in another encoding, all or from some place on."""
    name = chance.choice(("utf-16", "utf-16-be", "utf-32", "utf-8-sig", "latin-1", "cp1252", "cp437", "utf-7", "shift-jis"))
    index = 0 if chance.random() < 0.7 else chance.randrange(len(text))
    coded = (chance.choice(LETTERS) + text[index:]).encode(name, errors="replace")
    return text[:index] + coded.decode("utf-8", errors=BYTES)


def separators(chance: random.Random, text: str) -> str:
    """Separated otherwise, with decimal commas or not."""
    mark = chance.choice((";", "\t", "|", " ", ":", "  ", ",,", "\x1f"))
    separated = text.replace(",", mark)
    return separated.replace(".", ",") if chance.random() < 0.5 else separated


def ends_of_lines(chance: random.Random, text: str) -> str:
    """Lines that end otherwise, all or some."""
    ends = ("\r", "\r\n", "\n\r", "\u2028", "\x85", "\x0b", "\n\n\n", "", ",\n", " \n", "\x00\n")
    end, share = chance.choice(ends), chance.choice((1.0, 1.0, 0.1))
    return "".join(line + (end if chance.random() < share else "\n") for line in text.splitlines())


def quotes(chance: random.Random, text: str) -> str:
    """Cells in quotes, some of them open."""
    mark = chance.choice(('"', "'", "\u201c", '""'))
    close = mark if chance.random() < 0.8 else ""
    return _joined([[f"{mark}{cell}{close}" if chance.random() < 0.7 else cell for cell in row] for row in _rows(text)])


def transposed(chance: random.Random, text: str) -> str:
    """Columns as rows."""
    rows = _rows(text)
    longest = max(map(len, rows))
    return _joined([list(cells) for cells in zip(*(row + [""] * (longest - len(row)) for row in rows), strict=True)])


def long_table(chance: random.Random, text: str) -> str:
    """The whole table, or its rows, many times."""
    head, _, tail = text.partition("\n")
    body = tail if chance.random() < 0.8 else text
    return f"{head}\n" + body * min(chance.choice((2, 30, 1000)), LONGEST // (len(body) + 1) + 1)


def wide_table(chance: random.Random, text: str) -> str:
    """Many more columns."""
    more = chance.choice((50, 500, 1990, 3000))
    rows = _rows(text)[: max(LONGEST // (3 * more), 2)]
    cell = chance.choice(("1", "", "x", chance.choice(ODD_CELLS)[:20]))
    headings = [f"c{i}" for i in range(more)]
    return _joined([rows[0] + headings, *(row + [cell] * more for row in rows[1:])])


def heading(chance: random.Random, text: str) -> str:
    """Another unit or name in the heading of a column, or of two exchanged."""
    rows = _rows(text)
    index, to = (chance.randrange(len(rows[0])) for _ in range(2))
    how = chance.randrange(4)
    if how == 0:
        rows[0][index], rows[0][to] = rows[0][to], rows[0][index]
    elif how == 1:
        rows[0][index] = re.sub(r"_[^_]*$", f"_{chance.choice(UNITS)}", rows[0][index])
    elif how == 2:
        rows[0][index] = chance.choice((*HEADINGS, *ODD_CELLS))
    else:
        rows.insert(1, [chance.choice(UNITS) for _ in rows[0]])
    return _joined(rows)


def numbers(chance: random.Random, text: str) -> str:
    """A column of numbers multiplied, rounded, made one, negative, or written otherwise."""
    rows = _rows(text)
    index, factor = chance.randrange(len(rows[0])), 10.0 ** chance.choice((-300, -15, -3, -1, 1, 3, 14, 15, 300))
    picked, how = chance.choice(ODD_CELLS), chance.randrange(6)
    changes = (
        lambda value: repr(value * factor), lambda value: f"{value:.0f}", lambda value: picked, lambda value: repr(-value),
        lambda value: f"{value:g} N", lambda value: f"{value:.3e}".translate(str.maketrans("0123456789", "٠١٢٣٤٥٦٧٨٩")),
    )  # fmt: skip
    for row in rows[1:]:
        try:
            row[index] = changes[how](float(row[index]))
        except (ValueError, IndexError, OverflowError):
            continue
    return _joined(rows)


def order(chance: random.Random, text: str) -> str:
    """Rows, or columns, in another order."""
    rows = _rows(text)
    if chance.random() < 0.5:
        return _joined([rows[0], *chance.sample(rows[1:], len(rows) - 1)])
    columns = chance.sample(range(len(rows[0])), len(rows[0]))
    return _joined([[row[k] for k in columns if k < len(row)] for row in rows])


def remarks(chance: random.Random, text: str) -> str:
    """A preamble, statistics at the end, or remarks between rows."""
    odd = ("Bench,3", "#", "# a,b,c", "Mean,1,2", "2021-01-01 12:00", ";;;;", "Sheet 2", "\x1b[2J", "=HYPERLINK(1)", "[units]")
    lines = text.splitlines()
    for _ in range(chance.choice((1, 3, 40))):
        lines.insert(chance.choice((0, len(lines), chance.randrange(len(lines) + 1))), chance.choice(odd))
    return "\n".join(lines) + "\n"


def many(chance: random.Random, text: str) -> str:
    """A part of a description many times, with other names or without."""
    parts = re.split(r"(?m)^(?=\[)", text)
    part, times = chance.choice(parts), chance.choice((2, 9, 101, 2000))
    same = chance.random() < 0.3
    copies = (part if same else re.sub(r'(?m)^name = ".*?"', f'name = "n{i}"', part) for i in range(times))
    return (text + "\n" + "".join(copies))[: LONGEST * 2]


def list_of_many(chance: random.Random, text: str) -> str:
    """A list of thousands, or one in one in one, as a value."""
    value = chance.choice(
        ("[" + "430, " * chance.choice((900, 1100, 20_000)) + "]", "[" * 40 + "]" * 40, "{ a = " * 13 + "1" + " }" * 13,
         '["a.csv", "a.csv"]', f'"{"x" * chance.choice((250, 10_001, 100_000))}"', '"*"', '"**/*"', '"."', '"cable.toml"')
    )  # fmt: skip
    lines = text.splitlines()
    index = chance.choice([k for k, line in enumerate(lines) if "=" in line] or [0])
    lines[index] = f"{lines[index].partition('=')[0]}= {value}"
    return "\n".join(lines) + "\n"


def names(chance: random.Random, text: str) -> str:
    """Another name of everything that has one, wherever it stands."""
    stated_value = sorted(set(re.findall(r'"([^"\n]{1,60})"', text))) or ["x"]
    odd = (
        "x" * 52, "x" * 300, "a/b", "$x_$", "=1+1", "\\u001b[2J", "\\u202e", "drag", "tau", "noise", "optimal_length", " ",
        "a.b", "_", "é",
    )  # fmt: skip
    return text.replace(f'"{chance.choice(stated_value)}"', f'"{chance.choice((*odd, *stated_value))}"')


def magnitude(chance: random.Random, text: str) -> str:
    """A number of a description a power of ten off."""
    places = list(re.finditer(r"(?<![\w.])\d+\.?\d*(?![\w.])", text))
    if not places:
        return text
    picked = chance.choice(places)
    return (
        text[: picked.start()] + chance.choice(("-", "", "0.", "1e5", "1e-9", "1e30")) + picked.group() + text[picked.end() :]
    )


def moved(chance: random.Random, text: str) -> str:
    """A setting in another part of the description, or a part in another place."""
    if chance.random() < 0.5:
        parts = re.split(r"(?m)^(?=\[)", text)
        return "".join(chance.sample(parts, len(parts)))
    lines = text.splitlines(keepends=True)
    line = lines.pop(chance.randrange(len(lines)))
    lines.insert(chance.randrange(len(lines) + 1), line)
    return "".join(lines)


def added(chance: random.Random, text: str) -> str:
    """A setting more, which is known elsewhere or nowhere."""
    keys = (
        "friction_model", "geometry", "noise", "prior.tau", "sampler.max_steps", "sampler.n_walkers", "sensors.input_ratio",
        "errors.angle", "route.choices", "tables.recordings", "tables.forces.files", "run", "reference_force",
        "sensors.input_force_noise", "friction.mu1.prior", "schema", "units", "recording", "contact",
    )  # fmt: skip
    values = ('"drag"', '"load-dependent"', '"student"', '{ value = 1, unit = "N" }', "[[1, 2]]", *ODD_VALUES)
    return f"{chance.choice(keys)} = {chance.choice(values)}\n{text}"


MORE_TABLES: tuple[Mangle, ...] = (
    encoding, separators, ends_of_lines, quotes, transposed, long_table, wide_table, heading, heading, numbers, numbers, order,
    remarks,
)  # fmt: skip
MORE_DESCRIPTIONS: tuple[Mangle, ...] = (
    encoding, ends_of_lines, many, list_of_many, names, names, magnitude, magnitude, moved, added, added,
)  # fmt: skip


def replace_file(chance: random.Random, path: Path) -> str:
    """Put something else in the place of a file of a data set, and return what."""
    other_files = sorted(other for other in path.parent.iterdir() if other.is_file() and other != path)
    way = chance.choice(("gone", "pipe", "folder", "loop", "nowhere", "endless", "system", "empty", "exchanged", "linked"))
    if way == "exchanged" and other_files:
        other = chance.choice(other_files)
        content = path.read_bytes()
        path.write_bytes(other.read_bytes())
        other.write_bytes(content)
        return way
    target = {"endless": "/dev/zero", "system": "/proc/self/environ", "nowhere": "nowhere", "loop": path.name}.get(way)
    if way == "linked":
        shutil.copy(path, path.with_name("other.bin"))
        target = "other.bin"
    path.unlink()
    if target:
        path.symlink_to(target)
    elif way == "pipe":
        os.mkfifo(path)
    elif way == "folder":
        path.mkdir()
    elif way == "empty":
        path.touch()
    return way
