"""The figures that a fit drew: they need not be drawn again as long as they are just as they were written."""

from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

from bowdenfit.errors import StoreError
from bowdenfit.results.folder import FIGURES
from bowdenfit.results.kept import add_answer, file_checksum, installed_version, read_answers

_DRAWN = "drawn"


def record_drawn_figures(folder: Path, captions: Mapping[str, str]) -> None:
    """Keep which figures there are, and what their files are.

    Args:
        folder: The results folder, whose figures have all been drawn.
        captions: Of each figure, by its name.
    """
    files = {path.name: file_checksum(path) for path in (folder / FIGURES).iterdir() if path.stem in captions}
    add_answer(folder, _DRAWN, {"with": installed_version("matplotlib"), "captions": dict(captions), "files": files})


def captions_if_unchanged(folder: Path, names: Collection[str], endings: Collection[str]) -> dict[str, str] | None:
    """Captions of all figures of a fit, by name; None where those asked for do not all lie there as they would be drawn now.

    Args:
        folder: The results folder.
        names: Of those asked for; all if empty.
        endings: In which formats.
    """
    page: dict[str, Any] = read_answers(folder).get(_DRAWN, {})
    if page.get("with") != installed_version("matplotlib"):
        return None
    captions: dict[str, str] = page["captions"]
    files = [f"{name}.{ending}" for name in names or captions for ending in endings]
    try:
        same = all(page["files"][file] == file_checksum(folder / FIGURES / file) for file in files)
    except (KeyError, StoreError, OSError):  # a figure that it has not, or something else that lies there
        return None
    return captions if same else None
