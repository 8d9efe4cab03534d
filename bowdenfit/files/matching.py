"""Which columns or channels of a file can be which quantity, by what is written over them."""

import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from functools import lru_cache

from bowdenfit.files.headings import split_brackets
from bowdenfit.files.spellings import parse_heading
from bowdenfit.units import is_unit

_LONGEST_HEADING = 200


@dataclass(frozen=True)
class Quantity:
    """A column that a table may have.

    Args:
        name: Canonical name.
        dimension: Kind of quantity (`units.INTERNAL_UNITS`), "route" for the route variable, "speed" for the velocity of
            the rope or of the motor, "text" for labels.
        to: Unit to convert to; the internal one if omitted.
    """

    name: str
    dimension: str
    to: str | None = None


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


def find_candidates(
    headings: Sequence[tuple[str, str]], wanted: tuple[Quantity, ...], stated: Collection[str] = ()
) -> dict[str, list[MatchedColumn]]:
    """The columns that can be each quantity; several where a file leaves it open.

    The name of a quantity comes first, then other spellings of it; one that only a pair makes clear, such as T1 beside T2,
    counts where nothing clearer does and the other end is there too.

    Args:
        headings: What stands over each column, and the unit that the file gives elsewhere; both may be empty.
        wanted: What to look for.
        stated: Quantities whose column the user has named; none is looked for.
    """
    by_quantity: dict[str, list[MatchedColumn]] = {quantity.name: [] for quantity in wanted}
    loose: dict[str, list[MatchedColumn]] = {quantity.name: [] for quantity in wanted}
    for i, (heading, unit) in enumerate(headings):
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
    """Whether the columns at the other end make clear what this one is."""
    return "number" in beside if pair == "number" else bool({*beside} - {"number"})


def meanings(heading: str, wanted: tuple[Quantity, ...]) -> list[tuple[Quantity, str | None]]:
    """Every quantity that the heading can mean, with the unit written in it; exact names win over name and unit."""
    if len(heading) > _LONGEST_HEADING:
        return []
    name, unit = split_brackets(heading)
    exact = [(q, unit or _suffix(name, q.name)) for q in wanted if plain_name(name) == plain_name(q.name)]
    whole = [(q, None) for q in wanted if plain_name(heading) == plain_name(q.name)]
    named = exact or whole or [(q, behind) for q in wanted if (behind := _suffix(heading, q.name)) is not None]
    return [(q, unit) for q, unit in named if not (q.dimension == "text" and unit and is_unit(unit))]


def _suffix(heading: str, name: str) -> str | None:
    """Unit behind the name in `input_force_N` or "Input force N", case kept; None where it is no unit."""
    words = re.split(r"[\s_\-]+", heading.strip())
    units = ["_".join(words[i:]) for i in range(1, len(words)) if plain_name("_".join(words[:i])) == plain_name(name)]
    if not units:
        return None
    candidate = units[-1].replace("_per_", "/").replace("_", "*")
    if candidate.lower() in {"pct", "percent"}:
        return "%"
    return candidate if is_unit(candidate) else None


@lru_cache(maxsize=1024)  # of each heading it is asked for every quantity
def plain_name(heading: str) -> str:
    """Heading in lower case with underscores for anything between words."""
    return re.sub(r"[\W_]+", "_", heading.lower()).strip("_")


