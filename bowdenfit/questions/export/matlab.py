"""A function of MATLAB and Octave, one file, with the same tables as the C header."""

import re
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from bowdenfit.errors import UsageError
from bowdenfit.questions.export.transmission import Transmission
from bowdenfit.questions.export.words import comment, filled_template, plain

_ACROSS = 5  # numbers in a line
_NAME = re.compile(r"[A-Za-z]\w{0,62}", re.ASCII)


def function(found: Transmission, name: str) -> str:
    """The file.

    Args:
        found: The tables.
        name: Of the function, as of the file.
    """
    levels, places = found.levels, found.places
    return filled_template(
        "bowden.m",
        function=name,
        about=comment(found.sentences, "%  "),
        level_words=f"its name, such as 'q50', or its number from 1 to {len(levels)}",
        place_words=plain(places.words) if places.unit else "not used: friction is the same everywhere",
        speed_words=f"in {found.speed_unit}" if found.of_rate else "not used: friction does not depend on it",
        names=", ".join(f"'{level.name}'" for level in levels),
        place=_matrix([places.at]),
        pull=_matrix([level.exponent[0] for level in levels]),
        returning=_matrix([level.exponent[1] for level in levels]),
        taut_loss=_matrix([level.taut_loss for level in levels]),
        load=_matrix([(level.load_exponent, level.drag) for level in levels]),
        rate=_matrix([level.rate for level in levels]),
        is_loop=_logical(found.is_loop),
        of_load=_logical(found.of_load),
        of_rate=_logical(found.of_rate),
        varies=int(bool(places.unit)),
        reference_force=repr(float(found.reference_force)),
        reference_speed=repr(float(found.reference_speed)),
    )


def function_name(path: Path) -> str:
    """Name of the function in a file, which is that of the file.

    Args:
        path: The file.

    Raises:
        UsageError: It cannot be the name of a function.
    """
    if path.suffix != ".m" or not _NAME.fullmatch(path.stem):
        raise UsageError(
            f"--output {path.name}: the name of a function in MATLAB is that of its file; write it as bowden.m, of letters, "
            "digits and underscores."
        )
    return path.stem


def _matrix(rows: Iterable[Iterable[float]]) -> str:
    """Rows of numbers with all their digits, on lines of a length that can be read."""
    return ";\n        ".join(_row(row) for row in rows)


def _row(values: Iterable[float]) -> str:
    texts = [repr(float(value)) for value in np.asarray(list(values))]
    return ", ...\n        ".join(", ".join(texts[i : i + _ACROSS]) for i in range(0, len(texts), _ACROSS))


def _logical(value: bool) -> str:
    return "true" if value else "false"
