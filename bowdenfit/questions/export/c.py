"""A C header (C99) that computes forces of a fitted cable and allocates nothing: numbers as hexadecimal, so to the last bit."""

from collections.abc import Iterable

import numpy as np

from bowdenfit.questions.export.transmission import Transmission
from bowdenfit.questions.export.words import comment, filled_template, plain

_ACROSS = 4  # numbers in a line


def header(found: Transmission) -> str:
    """The header.

    Args:
        found: The tables.
    """
    places, levels = found.places, found.levels
    anywhere = not places.unit
    speed = "not used: friction does not depend on it"
    if found.of_rate:
        speed = f"in {found.speed_unit}; the coefficients hold at BOWDEN_REFERENCE_SPEED"
    return filled_template(
        "bowden.h",
        about=comment(found.sentences, " * "),
        place_words="not used: friction is the same everywhere" if anywhere else plain(places.words),
        speed_words=speed,
        version=plain(found.about.version).replace('"', "'"),
        seed=found.about.seed,
        n_places=len(places.at),
        n_levels=len(levels),
        anywhere=int(anywhere),
        is_loop=int(found.is_loop),
        of_load=int(found.of_load),
        of_rate=int(found.of_rate),
        reference_speed=float(found.reference_speed).hex(),
        place=numbers(places.at, "    "),
        exponent=",\n".join(_strokes(level.exponent) for level in levels),
        more_tables=_more_tables(found),
        law=filled_template("loop.h" if found.is_loop else "rope.h"),
    )


def numbers(values: Iterable[float], before: str) -> str:
    """Numbers as hexadecimal with commas between them, some in a line."""
    texts = [float(value).hex() for value in np.ravel(np.asarray(list(values)))]
    lines = [", ".join(texts[i : i + _ACROSS]) for i in range(0, len(texts), _ACROSS)]
    return ",\n".join(before + line for line in lines)


def _strokes(exponent: np.ndarray) -> str:
    """Exponents of both strokes."""
    return "    {\n" + ",\n".join(_row(one, "        ") for one in exponent) + "\n    }"


def _row(values: Iterable[float], before: str) -> str:
    return f"{before}{{\n{numbers(values, before + '    ')}\n{before}}}"


def _more_tables(found: Transmission) -> str:
    """What not every cable has."""
    parts = []
    if found.is_loop:
        rows = ",\n".join(_row(level.taut_loss, "    ") for level in found.levels)
        parts.append(
            "\n/* What the loop loses while both sides are taut, 2 P lambda, in newtons, by level and place. */\n"
            f"static const double bowden_taut_loss[BOWDEN_LEVELS][BOWDEN_PLACES] = {{\n{rows}\n}};\n"
        )
    if found.of_load:
        load = [(level.load_exponent, level.drag) for level in found.levels]
        reference = float(found.reference_force).hex()
        parts.append("\n" + filled_template("load.h", reference_force=reference, load=_tuples(load)))
    if found.of_rate:
        rate = _tuples([level.rate for level in found.levels])
        parts.append(
            "\n/* Stribeck rise, Stribeck speed and viscous coefficient, by level. */\n"
            f"static const double bowden_rate_coefficients[BOWDEN_LEVELS][3] = {{\n{rate}\n}};\n"
        )
    return "".join(parts)


def _tuples(rows: Iterable[tuple[float, ...]]) -> str:
    return ",\n".join("    {" + ", ".join(float(value).hex() for value in row) + "}" for row in rows)
