"""Friction coefficients of Bowden cables from bench measurements, with honest uncertainty, and the best cable length.

Everything a notebook needs is here; importing it loads nothing heavy and changes no global setting.

    import bowdenfit as bf
    fit = bf.fit("datasets/on-body-exoskeleton")
    fit.optimal_length()
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from bowdenfit.errors import (
        BowdenfitError,
        ConvergenceError,
        DatasetError,
        DescriptionError,
        StoreError,
        UsageError,
    )
    from bowdenfit.results.fit import Fit
    from bowdenfit.workflow import compare, fit, load, plot, read, simulate
    from bowdenfit.workflow.calibration import calibrate
    from bowdenfit.workflow.identifying import identify
    from bowdenfit.workflow.planning import next_measurement

_WHERE = {
    **dict.fromkeys(("compare", "fit", "load", "plot", "read", "simulate"), "bowdenfit.workflow"),
    "calibrate": "bowdenfit.workflow.calibration",
    "identify": "bowdenfit.workflow.identifying",
    "next_measurement": "bowdenfit.workflow.planning",
    "Fit": "bowdenfit.results.fit",
    **dict.fromkeys(
        ("BowdenfitError", "ConvergenceError", "DatasetError", "DescriptionError", "StoreError", "UsageError"),
        "bowdenfit.errors",
    ),
}

__all__ = [
    "BowdenfitError",
    "ConvergenceError",
    "DatasetError",
    "DescriptionError",
    "Fit",
    "StoreError",
    "UsageError",
    "calibrate",
    "compare",
    "fit",
    "identify",
    "load",
    "next_measurement",
    "plot",
    "read",
    "simulate",
]


def __getattr__(name: str) -> Any:
    """Load a public name when it is first used."""
    if name in _WHERE:
        return getattr(import_module(_WHERE[name]), name)
    raise AttributeError(f"module 'bowdenfit' has no attribute {name!r}")


def __dir__() -> list[str]:
    return __all__
