"""C header (C99) that computes forces of a fitted cable from exact hexadecimal constants."""

from collections.abc import Iterable

import numpy as np

from bowdenfit.questions.export.sensors import SensorErrors
from bowdenfit.questions.export.tables import TransmissionTables
from bowdenfit.questions.export.text import ascii_text, fill_template, format_comment

_ACROSS = 4  # numbers in a line


def c_header(tables: TransmissionTables) -> str:
    """Return the C header.

    Args:
        tables: The tables.
    """
    points, levels = tables.points, tables.levels
    constant = not points.unit
    speed = "not used: friction does not depend on it"
    if tables.depends_on_rate:
        speed = f"in {tables.speed_unit}; the coefficients hold at BOWDEN_REFERENCE_SPEED"
    return fill_template(
        "bowden.h",
        about=format_comment(tables.sentences, " * "),
        place_words="not used: friction is the same everywhere" if constant else ascii_text(points.words),
        speed_words=speed,
        version=ascii_text(tables.about.version).replace('"', "'"),
        seed=tables.about.seed,
        n_places=len(points.values),
        n_levels=len(levels),
        anywhere=int(constant),
        is_loop=int(tables.is_loop),
        of_load=int(tables.depends_on_load),
        of_rate=int(tables.depends_on_rate),
        reference_speed=float(tables.reference_speed).hex(),
        place=format_hexadecimal(points.values, "    "),
        exponent=",\n".join(_format_strokes(level.exponent) for level in levels),
        more_tables=_format_optional_tables(tables),
        law=fill_template("loop.h" if tables.is_loop else "rope.h"),
        of_turns=int(tables.builds_up),
        motion=_format_motion(tables),
        track=fill_template("track.h", sensors=_format_sensors(tables.sensors)),
    )


def _format_motion(tables: TransmissionTables) -> str:
    """Return the function that follows any motion."""
    if not tables.builds_up:
        return fill_template("step.h")
    return fill_template("creep.h", presliding=_format_tuples([level.presliding for level in tables.levels]))


def _format_sensors(sensors: SensorErrors) -> str:
    """Return standard deviations as the estimator takes them; NAN where they must be stated."""
    values = (sensors.force_sd, sensors.noise_time, sensors.gain_sd, sensors.zero_sd, sensors.latency_sd)
    return ", ".join("NAN" if np.isnan(value) else repr(float(value)) for value in values)


def format_hexadecimal(values: Iterable[float], before: str) -> str:
    """Format numbers as hexadecimal constants, some in a line."""
    texts = [float(value).hex() for value in np.ravel(np.asarray(list(values)))]
    lines = [", ".join(texts[i : i + _ACROSS]) for i in range(0, len(texts), _ACROSS)]
    return ",\n".join(before + line for line in lines)


def _format_strokes(exponent: np.ndarray) -> str:
    """Format exponents of both strokes."""
    return "    {\n" + ",\n".join(_format_row(one, "        ") for one in exponent) + "\n    }"


def _format_row(values: Iterable[float], before: str) -> str:
    return f"{before}{{\n{format_hexadecimal(values, before + '    ')}\n{before}}}"


def _format_optional_tables(tables: TransmissionTables) -> str:
    """Return tables that not every cable has."""
    parts = []
    if tables.is_loop:
        rows = ",\n".join(_format_row(level.taut_loss, "    ") for level in tables.levels)
        parts.append(
            "\n/* What the loop loses while both sides are taut, 2 P lambda, in newtons, by level and place. */\n"
            f"static const double bowden_taut_loss[BOWDEN_LEVELS][BOWDEN_PLACES] = {{\n{rows}\n}};\n"
        )
    if tables.depends_on_load:
        load = [(level.load_exponent, level.drag) for level in tables.levels]
        reference = float(tables.reference_force).hex()
        parts.append("\n" + fill_template("load.h", reference_force=reference, load=_format_tuples(load)))
    if tables.depends_on_rate:
        rate = _format_tuples([level.rate for level in tables.levels])
        parts.append(
            "\n/* Stribeck rise, Stribeck speed and viscous coefficient, by level. */\n"
            f"static const double bowden_rate_coefficients[BOWDEN_LEVELS][3] = {{\n{rate}\n}};\n"
        )
    return "".join(parts)


def _format_tuples(rows: Iterable[tuple[float, ...]]) -> str:
    return ",\n".join("    {" + ", ".join(float(value).hex() for value in row) + "}" for row in rows)
