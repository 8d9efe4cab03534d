"""A module of plain Python with the same tables and answers as the C header."""

import math
from collections.abc import Iterable
from dataclasses import asdict

from bowdenfit.questions.export.sensors import SensorErrors
from bowdenfit.questions.export.tables import FrictionLevel, TransmissionTables
from bowdenfit.questions.export.text import ascii_text, fill_template, format_comment

_ACROSS = 5  # numbers in a line


def python_module(tables: TransmissionTables) -> str:
    """Return the module.

    Args:
        tables: The tables.
    """
    points = tables.points
    return fill_template(
        "module.template",
        about=format_comment(tables.sentences, "").replace('"""', "'''"),
        place_words=ascii_text(points.words) if points.unit else "not used: friction is the same everywhere",
        speed_words=f"in {tables.speed_unit}" if tables.depends_on_rate else "not used: friction does not depend on it",
        version=ascii_text(tables.about.version).replace('"', "'"),
        seed=int(tables.about.seed),
        is_loop=tables.is_loop,
        of_rate=tables.depends_on_rate,
        reference_force=repr(float(tables.reference_force)),
        reference_speed=repr(float(tables.reference_speed)),
        places=_format_numbers(points.values, "    "),
        varies=bool(points.unit),
        sensors=_format_sensors(tables.sensors),
        levels="\n".join(_format_level(level) for level in tables.levels),
    )


def _format_sensors(sensors: SensorErrors) -> str:
    """Format what is known of the sensors as entries of a dictionary."""
    return ", ".join(
        f'"{name}": {"math.nan" if math.isnan(value) else repr(float(value))}' for name, value in asdict(sensors).items()
    )


def _format_level(level: FrictionLevel) -> str:
    """Format one level as an entry of a dictionary."""
    columns = {
        "pull": level.exponent[0],
        "return": level.exponent[1],
        "taut_loss": level.taut_loss,
        "load": (level.load_exponent, level.drag),
        "rate": level.rate,
        "presliding": level.presliding,
    }
    entries = [f'        "{name}": ({_format_numbers(values, "            ")},),' for name, values in columns.items()]
    return "\n".join([f'    "{level.name}": {{', *entries, "    },"])


def _format_numbers(values: Iterable[float], before: str) -> str:
    """Format numbers with all their digits, some in a line."""
    texts = [repr(float(value)) for value in values]
    return f",\n{before}".join(", ".join(texts[i : i + _ACROSS]) for i in range(0, len(texts), _ACROSS))
