"""What packages add to bowdenfit through entry points: verbs and kinds of tables. Our own add-ons come the same way.

A package states in its pyproject.toml what it adds, under the name by which it is asked for:

    [project.entry-points."bowdenfit.verbs"]
    shares = "bowdenfit_shares.verbs:SHARES"

Entry points are read of installed packages alone, never of the working folder, whose files came with somebody's data. An
extension that cannot be loaded is left out and named in a sentence; the rest goes on.
"""

from collections.abc import Iterator, Mapping
from functools import cache
from importlib.metadata import Distribution, EntryPoint
from pathlib import Path
from typing import Any

from bowdenfit.child_process import package_folders

VERBS = "bowdenfit.verbs"  # group of entry points, of a `Verb` each
KINDS = "bowdenfit.kinds"  # of a subclass of `Kind` each
CLUSTERS = "bowdenfit.engines"  # of a `Cluster` each
EXPORTS = "bowdenfit.exports"  # of an `ExportFormat` each
CONTROLLERS = "bowdenfit.controllers"  # of a function each, which gives parameters of a controller by fit and device.toml
SCHEMAS = "bowdenfit.schemas"  # of a model of pydantic each, by the name of its file
SIMULATIONS = "bowdenfit.simulations"  # of a function each, with the arguments and the answer of `make_data_set`
_OURS, _GROUPS = "bowdenfit", "bowdenfit."

_problems: list[str] = []


def list_names(group: str) -> list[str]:
    """Names of the extensions of a group, in alphabetical order."""
    return sorted(_find_entry_points().get(group, {}))


def load_extension(group: str, name: str) -> Any:
    """Load an extension; None if there is none of this name, or it cannot be loaded, which `list_problems` then says.

    Args:
        group: Group of entry points.
        name: Its name there.
    """
    return _load(group, name) if name in _find_entry_points().get(group, {}) else None


def iterate_extensions(group: str) -> Iterator[tuple[str, Any]]:
    """Yield the extensions of a group with their names, in alphabetical order, without those that cannot be loaded."""
    for name in list_names(group):
        extension = load_extension(group, name)
        if extension is not None:
            yield name, extension


def list_problems() -> tuple[str, ...]:
    """Sentences about extensions that could not be loaded so far."""
    return tuple(_problems)


def report_problem(sentence: str) -> None:
    """Keep a sentence about an extension that is left out for `list_problems`."""
    if sentence not in _problems:
        _problems.append(sentence)


@cache
def _load(group: str, name: str) -> Any:
    """Load an extension once."""
    package, entry_point = _find_entry_points()[group][name]
    return _load_or_report(entry_point, f"{name!r} of the package {package}")


def load_class_of_extension(place: str, name: str) -> Any:
    """Load a class that an extension names; None if that fails, which `list_problems` then says.

    Args:
        place: Module and class, such as "scratch.losses.term:LossTerms".
        name: Name of the extension.
    """
    return _load_or_report(EntryPoint(name=name, value=place, group=KINDS), f"{place} of {name!r}")


def _load_or_report(entry_point: EntryPoint, words: str) -> Any:
    """Load an object; report what goes wrong."""
    try:
        return entry_point.load()
    except Exception as error:  # whatever a module may raise while it is imported
        report_problem(
            f"{words} cannot be used and is left out ({type(error).__name__}: {error}); install its package again, in a "
            "version for this version of bowdenfit, or uninstall it."
        )
        return None


@cache
def _find_entry_points() -> Mapping[str, Mapping[str, tuple[str, EntryPoint]]]:
    """Package and entry point by group and name; of equal names ours counts, or that of the first package by name."""
    packages = _read_packages()
    if not any(entry_point.group.startswith(_GROUPS) for entry_point in packages.get(_OURS, ())):
        report_problem(
            "the add-ons that come with bowdenfit are not registered, because it was updated without being installed again; "
            "install it again in the way in which it was installed, such as pip install -e . in a checkout."
        )
    groups: dict[str, dict[str, tuple[str, EntryPoint]]] = {}
    for name in sorted(packages, key=lambda name: (name != _OURS, name)):
        for entry_point in packages[name]:
            groups.setdefault(entry_point.group, {}).setdefault(entry_point.name, (name, entry_point))
    return groups


def _read_packages() -> dict[str, tuple[EntryPoint, ...]]:
    """Entry points of the installed packages that name bowdenfit in theirs; of equal packages that of the first folder.

    Looking at the files alone takes a third of the time of `importlib.metadata.entry_points`.
    """
    packages: dict[str, tuple[EntryPoint, ...]] = {}
    for file in (file for folder in package_folders() for file in Path(folder).glob("*.dist-info/entry_points.txt")):
        try:
            if _GROUPS in file.read_text(encoding="utf-8"):
                packages.setdefault(file.parent.name.partition("-")[0], tuple(Distribution.at(file.parent).entry_points))
        except Exception as error:  # a folder of metadata may hold anything, and the others count all the same
            report_problem(f"the metadata of an installed package cannot be read, so it adds nothing ({error!r}).")
    return packages
