"""What a format cannot express, and which one can."""

from collections.abc import Mapping
from types import MappingProxyType

from bowdenfit.errors import DatasetError, UsageError
from bowdenfit.questions.export.tables import SUPPORTED_OPTIONS
from bowdenfit.questions.export.transmission import TablePoints
from bowdenfit.results.record import Record
from bowdenfit.units import conversion_factor, route_conversion_factor
from bowdenfit.words import listed

NAMES: Mapping[str, str] = MappingProxyType(
    {"c": "a C header", "csv": "CSV", "fmu": "an FMU", "matlab": "MATLAB", "mujoco": "MuJoCo", "yaml": "YAML"}
)


def refuse_inexpressible(fit: Record, to: str, draws: int) -> None:
    """Refuse a cable that a format cannot express.

    Args:
        fit: The fit.
        to: The format.
        draws: Number of draws asked for.

    Raises:
        UsageError: It cannot; another that can is named.
    """
    unsupported = [name for name in fit.model.cable.friction.options if name not in SUPPORTED_OPTIONS]
    if unsupported and (to != "csv" or draws):
        raise UsageError(
            f"{NAMES[to]}{' of draws' if to == 'csv' else ''} cannot express the friction model {listed(unsupported)}; export "
            "the lookup table instead, with --to csv."
        )


def refuse_compensation(to: str) -> None:
    """Refuse a device for a format that does not write what may be compensated.

    Raises:
        UsageError: It does not.
    """
    if to != "yaml":
        raise UsageError(
            f"--device is asked of yaml; {NAMES[to]} tells of the cable alone. Leave it out, or write --to yaml."
        )


def convert_point(fit: Record, points: TablePoints, to: str, at: tuple[float, str] | None) -> float | None:
    """Where a format that holds at one place does, in the unit of the tables; None if not said.

    Args:
        fit: The fit.
        places: Where friction is tabled.
        to: The format.
        at: What was said.

    Raises:
        UsageError: It has another unit, or the format holds everywhere, or friction is the same everywhere.
    """
    if at is None:
        return None
    if to != "mujoco":
        raise UsageError(f"--at is asked of mujoco; {NAMES[to]} has tables over the whole range. Leave it out.")
    if not points.unit:
        raise UsageError("friction of this cable is the same everywhere; leave --at out.")
    route = fit.dataset.description.route
    try:
        factor = conversion_factor(at[1], "angle") if route is None else route_conversion_factor(at[1], route.unit)
    except DatasetError as error:
        raise UsageError(f"--at {at[0]:g}{at[1]}: {error}.") from None
    return at[0] * factor
