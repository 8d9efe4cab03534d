"""What the heading of a column says: its name, its unit, and the quantities that it can be; and how users name columns.

`heading_of` divides a heading into name and unit; `find_candidates` finds the columns that can be each quantity; options
such as `--column input_force='Force input (N)'` are written by `option_naming` and read by `parse_sources`.
"""

import re
import shlex
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from functools import lru_cache

from bowdenfit.errors import DatasetError, suggest_name
from bowdenfit.files.channels import strip_index
from bowdenfit.files.clocks import names_time, unit_of_time
from bowdenfit.files.spellings import names_force, parse_heading
from bowdenfit.units import ColumnSource, differing_units, is_unit, measures, weight_of
from bowdenfit.words import shown

_BRACKETED = re.compile(r"^(?P<name>.*?)[\s_]*[\[(](?P<unit>[^\])]*)[\])]\s*$")
_NUMBER = re.compile(r"[+-]?\d+(?:[.,]\d+)?")
# `F_in` is no force in inches, nor `cell_A` one in ampere: behind a name only what cannot be a word counts as unit.
_SUFFIXES = (
    "N kN mN lbf kgf gf ozf newton Nm Nmm mNm N*m N*mm V mV uV mV/V V/V mA Pa kPa MPa bar psi kg mm cm m um inch mm/s m/s "
    "cm/s rad deg degree degrees rad/s deg/s rpm s ms us ns min h sec seconds Hz"
)
_PER_SECOND = {"mm_s", "cm_s", "m_s", "rad_s", "deg_s"}  # nobody measures the products
_REPEATED = re.compile(r"(?P<first>.+)\.\d{1,2}")
_FORCES = {"N", "kN", "mN", "lbf", "kgf"}
_LONGEST_HEADING = 200  # characters; judged: a longer text is a sentence, and patterns would take long over it


@dataclass(frozen=True)
class Heading:
    """Name and unit of a column; both empty where the file says nothing."""

    name: str
    unit: str = ""


@dataclass(frozen=True)
class Quantity:
    """A column that a table may have.

    Args:
        name: Canonical name.
        dimension: Kind of quantity (`units.INTERNAL_UNITS`), "route" for the route variable, "speed" for the velocity of
            the rope or of the motor, "text" for labels.
        to: Unit to convert to; the internal one if omitted.
        optional: Whether cells of the column may be blank.
    """

    name: str
    dimension: str
    to: str | None = None
    optional: bool = False


@dataclass(frozen=True)
class MatchedColumn:
    """A column that can be a quantity.

    Args:
        position: Which of the columns.
        unit: Unit written in its heading; None without one.
        pair: What its meaning rests on (see `Spelling`); empty where it says it alone.
    """

    position: int
    unit: str | None
    pair: str = ""


def heading_of(text: str, unit: str = "") -> Heading:
    """Return the name and unit in one heading: "Force (N)" is "Force" in N; `force_N` keeps its name and is in N as well.

    Args:
        text: Heading as written.
        unit: Unit from a line of its own under the heading; empty if there is none.
    """
    plain = " ".join(text.split())
    if unit := strip_brackets(unit):
        return Heading(plain, unit)
    name, unit = split_brackets(plain)
    if name and unit not in {"", "-", "1"} and is_unit(unit):
        return Heading(name, unit)
    return Heading(plain, _unit_behind(plain) or unit_of_time(plain))


def unit_in_name(name: str) -> str:
    """Return the unit in the last part of the name of a channel, such as "rec.F_in_N" or "bench/t_ms"; empty without one."""
    return heading_of(re.split(r"[/.](?=[^/.]+$)", strip_index(name))[-1]).unit


def _unit_behind(heading: str) -> str:
    """Return the unit in `input_force_N`, `velocity_mm_s`, "Force N" or `force_N_45deg_trial1`."""
    words = re.split(r"[\s_]+", heading)
    for start in range(1, len(words)):
        candidate = _read_quotient("_".join(words[start:]))
        if candidate in _SUFFIXES.split():
            return candidate
    return next((word for word in words[1:] if word in _FORCES), "")


def _read_quotient(words: str) -> str:
    """Return a unit with its line: `mm_per_s` and `mm_s` are mm/s."""
    return words.replace("_", "/") if words in _PER_SECOND else words.replace("_per_", "/")


def split_brackets(heading: str) -> tuple[str, str]:
    """Return the name and what stands in brackets behind it; all of the heading where nothing does."""
    match = _BRACKETED.match(heading[:_LONGEST_HEADING])
    return (match["name"], match["unit"].strip()) if match else (heading, "")


def strip_brackets(unit: str) -> str:
    """Return a unit without the brackets around it."""
    return unit.strip().strip("[]()").strip()


def is_units_row(cells: Sequence[str]) -> bool:
    """Return whether a row holds nothing but units, as "s;N;N" or "[s],[N]"; LVM and others leave some blank."""
    written = [strip_brackets(cell) for cell in cells if cell.strip()]
    return bool(written) and all(is_unit(unit) for unit in written) and not all(map(names_time, written))


def refuse_two_units(place: str, headings: Sequence[str], units: Sequence[str], source: str = "the row of units") -> None:
    """Refuse a unit below a heading, in a row of units or in the cells, that is another than the one in the heading.

    Raises:
        DatasetError: There is such a pair.
    """
    for heading, below in zip(headings, map(strip_brackets, units), strict=False):
        unit = heading_of(heading).unit
        if unit and below and is_unit(unit) and is_unit(below) and (reason := differing_units(unit, below)):
            raise DatasetError(
                f"{place}: the heading {shown(' '.join(heading.split()))} is in {unit}, and {source} says "
                f"{below} below it, {reason}; correct the one that is wrong, or delete {source}."
            )


def is_number(text: str) -> bool:
    """Return whether a heading is only a number, as the wrap angle over the columns of a run."""
    return bool(_NUMBER.fullmatch(text.strip()))


def repeated_heading(heading: str, headings: Collection[str]) -> str:
    """Return the heading of which another is a repeat, as pandas names "Force (N).1" after "Force (N)"; empty for others."""
    match = _REPEATED.fullmatch(heading)
    return match["first"] if match and match["first"] in headings else ""


def find_candidates(
    headings: Sequence[tuple[str, str]], wanted: tuple[Quantity, ...], stated: Collection[str] = ()
) -> dict[str, list[MatchedColumn]]:
    """Return the columns that can be each quantity; several where a file leaves it open.

    The name of a quantity comes first, then other spellings of it; one that only a pair makes clear, such as T1 beside T2,
    counts where nothing clearer does and the other end is there too.

    Args:
        headings: Heading of each column, and the unit that the file gives elsewhere; both may be empty.
        wanted: Quantities to look for.
        stated: Quantities whose column the user has named; none is looked for.
    """
    by_quantity: dict[str, list[MatchedColumn]] = {quantity.name: [] for quantity in wanted}
    loose: dict[str, list[MatchedColumn]] = {quantity.name: [] for quantity in wanted}
    written_out = {heading for heading, _ in headings}
    for i, (repeat, unit) in enumerate(headings):
        heading = repeated_heading(repeat, written_out) or repeat
        named = meanings(heading, wanted)
        for quantity, written in named:
            by_quantity[quantity.name].append(MatchedColumn(i, written or unit or None))
        other = parse_heading(heading, unit) if heading and not named and len(heading) <= _LONGEST_HEADING else None
        if other and other.quantity in by_quantity:
            (loose if other.pair else by_quantity)[other.quantity].append(MatchedColumn(i, other.unit, other.pair))
    for one, far in (("input_force", "output_force"), ("output_force", "input_force")):
        if one in by_quantity and not by_quantity[one]:
            beside = [candidate.pair for candidate in (*by_quantity[far], *loose[far])] + [""] * (far in stated)
            by_quantity[one] = [candidate for candidate in loose[one] if _is_paired(candidate.pair, beside)]
    return {name: [] if name in stated else columns for name, columns in by_quantity.items()}


def _is_paired(pair: str, beside: Collection[str]) -> bool:
    """Return whether the columns at the other end make clear what this one is."""
    return "number" in beside if pair == "number" else bool({*beside} - {"number"})


def meanings(heading: str, wanted: tuple[Quantity, ...]) -> list[tuple[Quantity, str | None]]:
    """Return every quantity that the heading can mean, with the unit written in it; exact names win over name and unit."""
    if len(heading) > _LONGEST_HEADING:
        return []
    heading = heading.replace("±", " sd ")
    name, unit = split_brackets(heading)
    exact = [(q, unit or _unit_suffix(name, q.name)) for q in wanted if plain_name(name) == plain_name(q.name)]
    whole = [(q, None) for q in wanted if plain_name(heading) == plain_name(q.name)]
    named = exact or whole or [(q, behind) for q in wanted if (behind := _unit_suffix(heading, q.name)) is not None]
    return [(q, unit) for q, unit in named if not (q.dimension == "text" and unit and is_unit(unit))]


def _unit_suffix(heading: str, name: str) -> str | None:
    """Return the unit behind the name in `input_force_N` or "Input force N", case kept; None where it is no unit."""
    words = re.split(r"[\s_\-]+", heading.strip())
    units = ["_".join(words[i:]) for i in range(1, len(words)) if plain_name("_".join(words[:i])) == plain_name(name)]
    if not units:
        return None
    candidate = _read_quotient(units[-1]).replace("_", "*")
    if candidate.lower() in {"pct", "percent"}:
        return "%"
    return candidate if is_unit(candidate) else None


@lru_cache(maxsize=1024)  # of each heading it is asked for every quantity
def plain_name(heading: str) -> str:
    """Return heading in lower case with underscores for anything between words."""
    return re.sub(r"[\W_]+", "_", heading.lower()).strip("_")


def option_naming(quantity: str, heading: str, unit: str = "", option: str = "--column") -> str:
    """Return the option that names a column or channel, as it can be pasted into a shell."""
    return f"{option} {quantity}={shlex.quote(heading + (f':{unit}' if unit else ''))}"


def rank_headings(headings: Sequence[tuple[str, str]], dimension: str) -> list[int]:
    """Return which columns may measure a dimension, the likeliest first: by their unit, by a weight, without one, others.

    Of equal ones those with a word for a force come first, where that is the dimension and several have one.

    Args:
        headings: Heading of each column, and the unit that the file gives elsewhere; both may be empty.
        dimension: Such as "force".
    """
    ranks, named = list[tuple[int, bool, int]](), [names_force(heading) for heading, _ in headings]
    by_name = dimension == "force" and named.count(True) > 1
    for i, (heading, below) in enumerate(headings):
        unit = heading_of(heading, below).unit
        fits = measures(unit, dimension)
        weighs = dimension == "force" and bool(weight_of(unit))
        rank = 0 if fits else 1 if weighs else 2 if not unit else 3
        if heading and (dimension == "time" or not names_time(heading) or parse_heading(heading, below)):
            ranks.append((rank, by_name and not named[i], i))
    return [i for _, _, i in sorted(ranks)]


def unit_to_state(heading: str, below: str, usual: str) -> str:
    """Return the unit that an option states next to a heading: that of a weight as a force, or the usual one without any."""
    unit = heading_of(heading, below).unit
    return weight_of(unit) or ("" if unit else usual)


def parse_sources(texts: Sequence[str], option: str, known: Collection[str] = ()) -> dict[str, ColumnSource]:
    """Return what the user names by options such as "input_force=ai0:lbf": the name in the file, and its unit, by quantity.

    Args:
        texts: Arguments of the options.
        option: The option, for errors.
        known: Quantities that may be named; any where it is empty.

    Raises:
        DatasetError: A text is not of that form, or names a quantity that there is not, or one twice.
    """
    what = option.removeprefix("--").upper()
    sources: dict[str, ColumnSource] = {}
    for text in texts:
        quantity, equals, target = (part.strip() for part in text.partition("="))
        name, _, unit = target.rpartition(":") if ":" in target else (target, "", "")
        if not equals or not quantity or not name.strip():
            raise DatasetError(
                f"{option} {shown(text)} is not of the form QUANTITY={what}:UNIT, such as input_force=ai0:N."
            )
        if known and quantity not in known:
            raise DatasetError(
                f"{option} {shown(text)}: no quantity is called {shown(quantity)}{suggest_name(quantity, list(known))}"
            )
        if quantity in sources:
            raise DatasetError(
                f"{option} names {quantity} twice, as {shown(sources[quantity].name)} and {shown(target)}; keep one of them."
            )
        sources[quantity] = ColumnSource(name=name.strip(), unit=unit.strip() or None)
    return sources
