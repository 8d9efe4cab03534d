"""Friction coefficients of Bowden cables from bench measurements, with honest uncertainty, and the best cable length.

Everything a notebook needs is here; importing it loads nothing heavy and changes no global setting.

    import bowdenfit as bf
    fit = bf.fit("datasets/on-body-exoskeleton")
    fit.optimal_length()
"""

TYPE_CHECKING = False  # typing's, unloaded: until the command line listens, an interrupt is a traceback of Python's

if TYPE_CHECKING:
    from typing import Any

    from bowdenfit.addons import *  # noqa: F403  (its functions are not named in the core)
    from bowdenfit.cable_model import model as model
    from bowdenfit.described_cable import Cable as Cable
    from bowdenfit.described_cable import Contact as Contact
    from bowdenfit.errors import BowdenfitError as BowdenfitError
    from bowdenfit.errors import ConvergenceError as ConvergenceError
    from bowdenfit.errors import DatasetError as DatasetError
    from bowdenfit.errors import DescriptionError as DescriptionError
    from bowdenfit.errors import StoreError as StoreError
    from bowdenfit.errors import UsageError as UsageError
    from bowdenfit.finished_fit import Fit as Fit
    from bowdenfit.finished_fit import load as load
    from bowdenfit.questions.calibrate.verb import calibrate as calibrate
    from bowdenfit.questions.check.verb import check as check
    from bowdenfit.questions.compare.verb import compare as compare
    from bowdenfit.questions.export.verb import export as export
    from bowdenfit.questions.identify.verb import identify as identify
    from bowdenfit.questions.next.verb import next_measurement as next_measurement
    from bowdenfit.questions.predict.verb import predict as predict
    from bowdenfit.questions.report.verb import report as report
    from bowdenfit.questions.schema.verb import schema as schema
    from bowdenfit.questions.simulate.verb import simulate as simulate
    from bowdenfit.questions.summary.verb import plot as plot
    from bowdenfit.questions.watch.verb import watch as watch
    from bowdenfit.reading import read as read
    from bowdenfit.run.verb import fit as fit

    __version__: str

_MODULES = {  # of the public names above; tests/house/test_contracts.py compares
    "Cable": "bowdenfit.described_cable",
    "Contact": "bowdenfit.described_cable",
    "Fit": "bowdenfit.finished_fit",
    "calibrate": "bowdenfit.questions.calibrate.verb",
    "check": "bowdenfit.questions.check.verb",
    "compare": "bowdenfit.questions.compare.verb",
    "export": "bowdenfit.questions.export.verb",
    "fit": "bowdenfit.run.verb",
    "identify": "bowdenfit.questions.identify.verb",
    "load": "bowdenfit.finished_fit",
    "model": "bowdenfit.cable_model",
    "next_measurement": "bowdenfit.questions.next.verb",
    "plot": "bowdenfit.questions.summary.verb",
    "predict": "bowdenfit.questions.predict.verb",
    "read": "bowdenfit.reading",
    "report": "bowdenfit.questions.report.verb",
    "schema": "bowdenfit.questions.schema.verb",
    "simulate": "bowdenfit.questions.simulate.verb",
    "watch": "bowdenfit.questions.watch.verb",
    **dict.fromkeys(
        ("BowdenfitError", "ConvergenceError", "DatasetError", "DescriptionError", "StoreError", "UsageError"),
        "bowdenfit.errors",
    ),
}

if not TYPE_CHECKING:  # to type checkers there are the names above, and no others
    __all__ = sorted(_MODULES)

    def __getattr__(name: str) -> "Any":
        """Load a public name when it is first used; a name that is not of the core is looked for among the verbs of add-ons."""
        from importlib import import_module
        from importlib.util import find_spec

        if name == "__version__":
            from importlib.metadata import version

            return version("bowdenfit")
        if name in _MODULES:
            return getattr(import_module(_MODULES[name]), name)
        if not name.startswith("_") and find_spec(f"{__name__}.{name}") is None:  # a module of the core has precedence
            from bowdenfit.extensions import list_problems
            from bowdenfit.verb import load_added_verb

            verb = load_added_verb(name)
            if verb is not None and not verb.serves:
                return verb.function
            problems = [sentence for sentence in list_problems() if repr(name) in sentence]
            raise AttributeError(f"module 'bowdenfit' has no attribute {name!r}. {' '.join(problems)}".strip())
        raise AttributeError(f"module 'bowdenfit' has no attribute {name!r}")


def __dir__() -> list[str]:
    """Return the public names, and the functions of add-ons."""
    from bowdenfit.verb import load_added_verbs

    return [*__all__, *(verb.command_name for verb in load_added_verbs() if not verb.serves)]
