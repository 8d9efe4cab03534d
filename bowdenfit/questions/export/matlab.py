"""A function of MATLAB and Octave, one file, with the same tables as the C header."""

import re
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from bowdenfit.errors import UsageError
from bowdenfit.questions.export.tables import TransmissionTables
from bowdenfit.questions.export.text import ascii_text, fill_template, format_comment

_ACROSS = 5  # numbers in a line
_NAME = re.compile(r"[A-Za-z]\w{0,62}", re.ASCII)

_PLAY_WORDS = """%  output = {function}('step', level, place, speed, input_force, 0, output_before)
%     Force at the load side during any motion; call it once per sample, with output_before = NaN for the first one."""
_CREEP_WORDS = """%  [output, flags, state] = {function}('step', level, place, speed, input_force, seconds, state)
%     Force at the load side during any motion, friction building up after a turn (docs/theory.md, presliding); call it once
%     per sample, with the seconds since the one before (0 if not known: bristles are then not damped), and state = [] for
%     the first one. The state holds the force at the load side and the friction."""


def matlab_function(tables: TransmissionTables, name: str) -> str:
    """Return the MATLAB function.

    Args:
        tables: The tables.
        name: Name of the function, as of the file.
    """
    levels, points = tables.levels, tables.points
    return fill_template(
        "bowden.m",
        function=name,
        about=format_comment(tables.sentences, "%  "),
        level_words=f"its name, such as 'q50', or its number from 1 to {len(levels)}",
        place_words=ascii_text(points.words) if points.unit else "not used: friction is the same everywhere",
        speed_words=f"in {tables.speed_unit}" if tables.depends_on_rate else "not used: friction does not depend on it",
        names=", ".join(f"'{level.name}'" for level in levels),
        place=_format_matrix([points.values]),
        pull=_format_matrix([level.exponent[0] for level in levels]),
        returning=_format_matrix([level.exponent[1] for level in levels]),
        taut_loss=_format_matrix([level.taut_loss for level in levels]),
        load=_format_matrix([(level.load_exponent, level.drag) for level in levels]),
        rate=_format_matrix([level.rate for level in levels]),
        is_loop=_format_logical(tables.is_loop),
        of_load=_format_logical(tables.depends_on_load),
        of_rate=_format_logical(tables.depends_on_rate),
        of_turns=_format_logical(tables.builds_up),
        presliding=_format_matrix([level.presliding for level in levels]),
        step_words=(_CREEP_WORDS if tables.builds_up else _PLAY_WORDS).format(function=name),
        varies=int(bool(points.unit)),
        reference_force=repr(float(tables.reference_force)),
        reference_speed=repr(float(tables.reference_speed)),
    )


def function_name(path: Path) -> str:
    """Return the name of the function in a file, which is that of the file.

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


def _format_matrix(rows: Iterable[Iterable[float]]) -> str:
    """Format rows of numbers with all their digits, on lines of a length that can be read."""
    return ";\n        ".join(_format_row(row) for row in rows)


def _format_row(values: Iterable[float]) -> str:
    texts = [repr(float(value)) for value in np.asarray(list(values))]
    return ", ...\n        ".join(", ".join(texts[i : i + _ACROSS]) for i in range(0, len(texts), _ACROSS))


def _format_logical(value: bool) -> str:
    return "true" if value else "false"
