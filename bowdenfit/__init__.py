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
    from bowdenfit.front_desk import Fit
    from bowdenfit.questions.calibrate.verb import calibrate
    from bowdenfit.questions.identify.verb import identify
    from bowdenfit.questions.next.verb import next_measurement
    from bowdenfit.verbs import compare, fit, load, plot, read, simulate

_WHERE = {
    **dict.fromkeys(("compare", "fit", "load", "plot", "read", "simulate"), "bowdenfit.verbs"),
    "calibrate": "bowdenfit.questions.calibrate.verb",
    "identify": "bowdenfit.questions.identify.verb",
    "next_measurement": "bowdenfit.questions.next.verb",
    "Fit": "bowdenfit.front_desk",
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
