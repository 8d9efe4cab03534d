"""What a format cannot express, and which one can."""

from collections.abc import Mapping
from types import MappingProxyType

from bowdenfit.errors import UsageError
from bowdenfit.questions.export.tables import EXPRESSED
from bowdenfit.results.record import Record
from bowdenfit.words import listed

NAMES: Mapping[str, str] = MappingProxyType(
    {"c": "a C header", "csv": "CSV", "fmu": "an FMU", "matlab": "MATLAB", "mujoco": "MuJoCo", "yaml": "YAML"}
)


def refuse_what_is_not_expressed(fit: Record, to: str, draws: int) -> None:
    """Refuse a cable that a format cannot express.

    Args:
        fit: The fit.
        to: The format.
        draws: Number of draws asked for.

    Raises:
        UsageError: It cannot; another that can is named.
    """
    unknown = [name for name in fit.model.cable.friction.options if name not in EXPRESSED]
    if unknown and (to != "csv" or draws):
        raise UsageError(
            f"{NAMES[to]}{' of draws' if to == 'csv' else ''} cannot express the friction model {listed(unknown)}; export the "
            "lookup table instead, with --to csv."
        )
