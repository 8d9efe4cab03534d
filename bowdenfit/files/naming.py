"""Columns and channels that the user names on the command line, such as `--column input_force='Force input (N)'`."""

import shlex
from collections.abc import Collection, Sequence

from bowdenfit.errors import DatasetError, suggest_name
from bowdenfit.units import ColumnSource
from bowdenfit.words import shown


def option_naming(quantity: str, heading: str, unit: str = "", option: str = "--column") -> str:
    """The option that names a column or channel, as it can be pasted into a shell."""
    return f"{option} {quantity}={shlex.quote(heading + (f':{unit}' if unit else ''))}"


def parse_sources(texts: Sequence[str], option: str, known: Collection[str] = ()) -> dict[str, ColumnSource]:
    """What the user names by options such as "input_force=ai0:lbf": the name in the file, and its unit, by quantity.

    Args:
        texts: What stands behind the options.
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
