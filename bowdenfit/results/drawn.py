"""The figures that a fit drew: they need not be drawn again as long as they are just as they were written."""

from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

from bowdenfit.errors import StoreError
from bowdenfit.results.folder import FIGURES
from bowdenfit.results.kept import checksum, keep_too, kept, version_of

_DRAWN = "drawn"


def keep_drawn(folder: Path, captions: Mapping[str, str]) -> None:
    """Keep which figures there are, and what their files are.

    Args:
        folder: The results folder, whose figures have all been drawn.
        captions: Of each figure, by its name.
    """
    files = {path.name: checksum(path) for path in (folder / FIGURES).iterdir() if path.stem in captions}
    keep_too(folder, _DRAWN, {"with": version_of("matplotlib"), "captions": dict(captions), "files": files})


def drawn_before(folder: Path, names: Collection[str], endings: Collection[str]) -> dict[str, str] | None:
    """Captions of all figures of a fit, by name; None where those asked for do not all lie there as they would be drawn now.

    Args:
        folder: The results folder.
        names: Of those asked for; all if empty.
        endings: In which formats.
    """
    page: dict[str, Any] = kept(folder).get(_DRAWN, {})
    if page.get("with") != version_of("matplotlib"):
        return None
    captions: dict[str, str] = page["captions"]
    files = [f"{name}.{ending}" for name in names or captions for ending in endings]
    try:
        same = all(page["files"][file] == checksum(folder / FIGURES / file) for file in files)
    except (KeyError, StoreError, OSError):  # a figure that it has not, or something else that lies there
        return None
    return captions if same else None
