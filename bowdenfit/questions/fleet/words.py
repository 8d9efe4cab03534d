"""What `bowdenfit fleet` prints."""

import math

from bowdenfit.display import text_of
from bowdenfit.questions.fleet.answer import Fleet
from bowdenfit.words import counted, decimals, filled, give_or_take, listed, table

_NAMED = 12  # broken or untrusted inspections that are named
_ENGINES = {"laplace": "importance sampling", "ensembles": "full sampling", "nuts": "sampling by gradients"}
_HEADS = ("quantity", "unit", "middle", "from", "to", "± of one")


@text_of.register(Fleet)
def fleet_text(found: Fleet) -> str:
    """A fleet for people: whether all went well, the range of each quantity, and what is broken."""
    blocks = [
        filled(verdict(found)),
        "\n".join([*_listed("broken", [(b.inspection, b.why) for b in found.broken]), *_untrusted(found)]),
        f"{table(_HEADS, _rows(found))}\n\n{filled(_how_to_read(found))}" if found.fitted else "",
        "\n".join(filled(line) for line in _what_was_done(found)),
    ]
    return "\n\n".join(block for block in blocks if block) + "\n"


def verdict(found: Fleet) -> str:
    """Whether every inspection was fitted and may be trusted."""
    total = len(found.fitted) + len(found.broken)
    what = f"{counted(total, 'inspection')} of {counted(len(found.cables), 'cable')}"
    if found.is_trusted:
        return f"{found.name}: {what}, every one fitted, and every fit may be trusted."
    wrong = [f"{len(found.broken)} could not be fitted"] if found.broken else []
    wrong += [f"{len(found.untrusted)} must not be trusted"] if found.untrusted else []
    return f"{found.name}: of {what} {listed(wrong)}; the others are as they would be without these."


def _listed(what: str, named: list[tuple[str, str]]) -> list[str]:
    """Inspections with what is wrong, and how many more."""
    lines = [filled(f"- {label}: {' '.join(why.split())}", hangs=True) for label, why in named[:_NAMED]]
    more = len(named) - _NAMED
    return [*lines, f"- and {more} more {what} ones, in fleet.json."] if more > 0 else lines


def _untrusted(found: Fleet) -> list[str]:
    return _listed("untrusted", [(each.inspection, f"not to be trusted: {each.reasons[0]}.") for each in found.untrusted])


def _rows(found: Fleet) -> list[tuple[str, ...]]:
    """Every quantity, under `_HEADS`."""
    rows = []
    for name, unit in found.units.items():
        low, middle, high, sd = found.middle(name)
        digits = decimals(max(high - low, sd, abs(middle) * 1e-6))
        shown = [f"{value:z.{digits}f}" for value in (middle, low, high)]
        rows.append((name, "" if unit == "1" else unit, *shown, f"{sd:z.{digits}f}"))
    return rows


def _how_to_read(found: Fleet) -> str:
    first = next(iter(found.units))
    _, middle, _, sd = found.middle(first)
    return (
        f"Middle, from and to: median, 5 % and 95 % of all inspections, each fitted by itself; a single {first} is known to "
        f"about {give_or_take(middle, sd)}, which is in these ranges too."
    )


def _what_was_done(found: Fleet) -> list[str]:
    """Models, engines, and what is known of the inspections."""
    lines = []
    if len(found.shapes) > 1:
        models = listed(list(found.shapes))
        lines.append(f"The descriptions or designs differ, so {len(found.shapes)} models were fitted: {models}.")
    drawn = listed([f"{_ENGINES.get(name, name)} ({n})" for name, n in found.engines.items()])
    lines.append(f"Fitted by {drawn}; seed {found.seed}." if found.fitted else f"Seed {found.seed}.")
    unknown = sum(math.isnan(each.cycles) for each in found.fitted)
    if unknown:
        some = counted(unknown, "inspection")
        lines.append(f"Of {some} nobody says after how many cycles, so nothing follows from them on wear.")
    if len(found.cables) == 1:
        lines.append("It is one cable only, so there is no population to compare it with.")
    return lines
