"""Whether the data of a fit are still as they were fitted.

Checksums of the files are in fit.json, with the path of the data set below the folder that holds the results; no path leads
out of it. A results folder may come from anybody, so that this is a hint: only what is below that folder is compared, and
nothing is reported of a data set that is not there.
"""

from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Any

from bowdenfit.errors import BowdenfitError
from bowdenfit.inputs import match_files, read_toml_file, sha256_of
from bowdenfit.results.folder import FIT, read_page
from bowdenfit.words import few, shown

DATA_SET, CHECKSUMS = "data_set", "sha256"  # keys of fit.json
_DESCRIPTION = "cable.toml"
_USUAL_FOLDER = "fits"  # that holds results, next to the data sets
_BAG = "metadata.yaml"  # in the folder of a ROS 2 bag, which counts as one file
_MOST_NAMES = 6  # of files in a sentence


@dataclass(frozen=True)
class DataChanges:
    """What became of the data of a fit.

    Args:
        folder: The data set; None where it is not found.
        files: Files that are not as they were fitted, or are gone, or were not there yet.
    """

    folder: Path | None = None
    files: tuple[str, ...] = ()

    def describe(self, fit: str = "this fit") -> str:
        """Return which data have changed since the fit, in a sentence; empty where none have.

        Args:
            fit: What the fit is called.
        """
        if not self.files:
            return ""
        names = few([shown(name) for name in self.files], _MOST_NAMES)
        return f"Changed since {fit}: {names}. Fit again for an answer from the data as they are now."


def locate_data_set(folder: Path | None, results: Path) -> dict[str, str]:
    """Return what fit.json says of where the data set is; nothing of one that is elsewhere.

    A folder in which it would not be looked for is not said.

    Args:
        folder: Folder of the data set; None without one.
        results: The results folder.
    """
    if folder is None or not folder.is_dir():  # a data frame, for one, was read from a folder that is gone
        return {}
    above = _folder_above(results.resolve())
    is_below = folder.resolve().is_relative_to(above)
    return {DATA_SET: folder.resolve().relative_to(above).as_posix()} if is_below else {}


def _folder_above(results: Path) -> Path:
    """Return the folder below which the data set of a results folder is looked for."""
    return results.parent.parent if results.parent.name == _USUAL_FOLDER else results.parent


def find_data_changes(results: Path, checksum: Callable[[Path], str] = sha256_of) -> DataChanges:
    """Return what became of the data of a fit.

    Args:
        results: Its results folder, which may be damaged or hostile.
        checksum: Returns the checksum of a file.
    """
    with suppress(BowdenfitError, OSError, ValueError, TypeError, AttributeError, KeyError):
        page = read_page(results / FIT)
        checksums = {str(name): str(digest) for name, digest in page[CHECKSUMS].items() if _is_inside(str(name))}
        folder = _find_data_set(results, page, checksums, checksum)
        if folder is not None and checksums:
            changed = [name for name, digest in checksums.items() if not _is_unchanged(folder, name, digest, checksum)]
            return DataChanges(folder, (*changed, *_list_new_files(folder, checksums)))
    return DataChanges()


def _is_inside(name: str) -> bool:
    """Whether a file of a data set is inside its folder, as far as its name says; others are not compared."""
    path = PurePosixPath(name)
    return not (path.is_absolute() or ".." in path.parts or "\\" in name)


def _find_data_set(
    results: Path, page: Mapping[str, Any], checksums: Mapping[str, str], checksum: Callable[[Path], str]
) -> Path | None:
    """Return the folder of the data set: where the fit says it is, or one next to the results that is likely to be it."""
    folder = results.resolve()
    above = _folder_above(folder)
    if isinstance(page.get(DATA_SET), str):
        data_set = (above / page[DATA_SET]).resolve()
        expected = [_DESCRIPTION] if _DESCRIPTION in checksums else checksums
        if data_set.is_relative_to(above) and any((data_set / name).exists() for name in expected):
            return data_set
    if _DESCRIPTION not in checksums:
        return None
    candidates = [path for path in (above, *above.iterdir()) if (path / _DESCRIPTION).is_file()]
    by_name = [path for path in candidates if f"{folder.name}-".startswith(f"{path.name}-")]
    same = [path for path in by_name if any(_is_unchanged(path, *file, checksum) for file in checksums.items())]
    likely = same or [path for path in candidates if _is_unchanged(path, _DESCRIPTION, checksums[_DESCRIPTION], checksum)]
    return max(likely, key=lambda path: len(path.name), default=None)


def _is_unchanged(folder: Path, name: str, digest: str, checksum: Callable[[Path], str]) -> bool:
    """Whether a file of a data set is as it was fitted; tables are named without folders, and looked for."""
    path = folder / name
    if path.is_dir():
        return not (path / _BAG).is_file() or checksum(path) == digest  # any other folder is no file of a data set
    paths = [path] if path.exists() or name == _DESCRIPTION else [other for other in folder.rglob("*") if other.name == name]
    with suppress(OSError, BowdenfitError):
        return any(checksum(other) == digest for other in paths)
    return False


def _list_new_files(folder: Path, checksums: Mapping[str, str]) -> Iterator[str]:
    """Yield files that the patterns of an unchanged description match by now, and that were not fitted."""
    if _DESCRIPTION not in checksums:
        return
    _, description = read_toml_file(folder / _DESCRIPTION)
    tables = description.get("tables", {})
    patterns = [settings["files"] for settings in tables.values() if isinstance(settings, dict) and "files" in settings]
    for pattern in (part for parts in patterns for part in ([parts] if isinstance(parts, str) else parts)):
        for path in match_files(folder, pattern):
            name = path.relative_to(folder).as_posix()
            if not {name, path.name} & {*checksums}:
                yield name
