"""Write a new data set into a folder that exists whole or not at all."""

import shlex
import shutil
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from importlib import resources
from pathlib import Path

from bowdenfit.arguments import FIT, parameters_of
from bowdenfit.dataset import DESCRIPTION_FILE
from bowdenfit.errors import DatasetError, UsageError, suggest_name
from bowdenfit.inputs import refuse_special
from bowdenfit.questions.start.notebook import write_notebook
from bowdenfit.results.folder import fill_folder_atomically, is_empty
from bowdenfit.verb import Verb, load_added_verbs
from bowdenfit.words import listed, shown

TEMPLATES = (DESCRIPTION_FILE, "angles.csv", "forces.csv")
_PACKAGE, _CHECKOUT = "examples", "datasets"  # folders of the shipped data sets, in a wheel and beside the package


def refuse_existing(folder: Path) -> None:
    """Refuse a folder that holds something, before anything is asked.

    Raises:
        UsageError: It does, or it is a file.
    """
    if folder.is_dir() and is_empty(folder):
        return
    if folder.exists() or folder.is_symlink():
        raise UsageError(f"{folder} exists already; name another folder, nothing was written.")


@contextmanager
def new_folder(folder: Path) -> Iterator[Path]:
    """Yield a folder to write into, which takes its name when all is written, and is gone if that fails or is interrupted.

    Args:
        folder: What it will be called.

    Raises:
        UsageError, StoreError: It exists already, or cannot be written.
    """
    refuse_existing(folder)
    with fill_folder_atomically(folder) as partial:
        yield partial


def write_template(folder: Path) -> None:
    """Write the description and the tables to fill in.

    Raises:
        UsageError, StoreError: See `new_folder`.
    """
    with new_folder(folder) as place:
        for name in TEMPLATES:
            text = resources.files("bowdenfit.templates").joinpath(name).read_text(encoding="utf-8")
            (place / name).write_text(text, encoding="utf-8")


def write_data_set(folder: Path, description: str, files: Sequence[Path]) -> None:
    """Write a description beside copies of the files that it is of.

    Args:
        folder: Where to.
        description: Its text.
        files: The files.

    Raises:
        UsageError, StoreError: See `new_folder`.
    """
    with new_folder(folder) as place:
        for file in files:
            shutil.copyfile(file, place / file.name)
        (place / DESCRIPTION_FILE).write_text(description, encoding="utf-8")


def refuse_files(files: Sequence[Path]) -> None:
    """Refuse files that are not there, or could not lie beside each other.

    Raises:
        UsageError, DatasetError: Which, and why.
    """
    for file in files:
        refuse_special(file)
        if not file.is_file():
            what = "is a folder" if file.is_dir() else "does not exist"
            raise UsageError(f"{file} {what}; name the files that you measured.")
        if not file.name.isprintable():
            raise DatasetError(
                f"a cable.toml cannot name the file {shown(file.name)}; rename it in letters that print."
            )
    names = [file.name for file in files]
    if twice := [name for name in names if names.count(name) > 1 or name == DESCRIPTION_FILE]:
        raise DatasetError(f"a data set cannot hold {shown(twice[0])} twice; rename one of the files.")


def find_examples() -> Mapping[str, Path]:
    """Return the shipped data sets by their names: those of the wheel, or those beside the package in a checkout."""
    package = Path(str(resources.files("bowdenfit")))
    for place in (package / _PACKAGE, package.parent / _CHECKOUT):
        if place.is_dir():
            return {path.name: path for path in sorted(place.iterdir()) if find_verb(path)}
    return {}


def find_verb(folder: Path) -> str:
    """Return the verb that reads a folder, by its description; empty without one."""
    if (folder / DESCRIPTION_FILE).is_file():
        return "fit"
    return next((verb.command_name for verb in _iterate_readers(folder)), "")


def next_command(folder: Path) -> str:
    """Return the command that reads a folder which has a description: one that is asked of a fit reads the file itself."""
    name, place = find_verb(folder), shlex.quote(str(folder))
    for verb in _iterate_readers(folder):
        first = next(iter(parameters_of(verb.function).values()))
        if verb.command_name == name and first.reader is FIT:
            return f"{name} {first.written_name} {shlex.quote(str(folder / verb.reads))}"
    return f"{name} {place}"


def _iterate_readers(folder: Path) -> Iterator[Verb]:
    """Yield the verbs of add-ons that read a file in a folder."""
    return (verb for verb in load_added_verbs() if verb.reads and (folder / verb.reads).is_file())


def write_example(name: str, folder: Path, with_notebook: bool = False) -> None:
    """Copy a shipped data set.

    Args:
        name: Which.
        folder: Where to.
        with_notebook: Whether a notebook that fits it is written beside it.

    Raises:
        UsageError, StoreError: There is none of that name, or none that a notebook fits; or see `new_folder`.
    """
    known = find_examples()
    if name not in known:
        hint = suggest_name(name, list(known)) if known else "; none was installed."
        raise UsageError(f"there is no example {shown(name)}{hint}")
    if with_notebook and find_verb(known[name]) != "fit":
        fitted = [example for example, path in known.items() if find_verb(path) == "fit"]
        raise UsageError(f"{name} is no data set of one cable, which the notebook fits; there is one for {listed(fitted)}.")
    with new_folder(folder) as place:
        _copy_files(known[name], place)
        if with_notebook:
            write_notebook(place)


def copy_data_set(source: Path, folder: Path, left_out: Collection[str] = ()) -> None:
    """Copy a data set as it is.

    Args:
        source: Its folder.
        folder: The new one.
        left_out: Names of files that are not copied.

    Raises:
        UsageError, StoreError: See `new_folder`.
    """
    with new_folder(folder) as place:
        _copy_files(source, place, left_out)


def _copy_files(source: Path, place: Path, left_out: Collection[str] = ()) -> None:
    """Copy the files in a folder; `shutil.copytree` hides what the system says."""
    for file in [file for file in sorted(source.rglob("*")) if file.is_dir() or file.name not in left_out]:
        copy = place / file.relative_to(source)
        copy.mkdir() if file.is_dir() else shutil.copyfile(file, copy)


def find_measured_files(folder: Path, endings: Sequence[str]) -> list[Path]:
    """Return the files in a folder that may hold measurements, by their endings."""
    return [path for path in sorted(folder.iterdir()) if path.suffix.lower() in endings and path.is_file()]


def describe_written_files(folder: Path) -> str:
    """Say which files were written, in a sentence."""
    return f"Wrote {listed(sorted(path.name for path in folder.iterdir()))} to {folder}."
