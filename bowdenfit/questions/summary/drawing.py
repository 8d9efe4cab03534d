"""Figures of a fit in a folder: copied where the fit has drawn them, which loads no NumPy, else drawn from stored data."""

import shutil
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bowdenfit.arguments import NumberWithUnit
from bowdenfit.errors import UsageError, suggest_name
from bowdenfit.plots.write import FORMATS, PNG
from bowdenfit.questions import summary
from bowdenfit.questions.writing import Files
from bowdenfit.results.answer_cache import captions_if_unchanged, copy_captions, write_captions
from bowdenfit.results.folder import FIGURES as FIGURES_FOLDER
from bowdenfit.results.folder import fill_folder_atomically

if TYPE_CHECKING:
    from bowdenfit.questions.summary.figure_files import FigureFiles


def draw_into_folder(
    fit: Any, output: str | Path | None, names: Sequence[str], width: NumberWithUnit | None, formats: Sequence[str]
) -> Files:
    """Draw figures of a fit into a folder, with captions.txt beside them.

    Args:
        fit: The fit, or its results folder.
        output: Folder for the figures; "figures" in the results folder if None.
        names: Which figures; all if empty.
        width: Width of the page with its unit; what suits each figure if None.
        formats: Endings of the files; PNG if empty.

    Returns:
        The files written.

    Raises:
        UsageError: No folder is known, there is no such figure or format, or figures cannot be so wide.
        StoreError: The results folder is missing or damaged, or the other cannot be written.
    """
    results = Path(fit) if isinstance(fit, str | Path) else None
    if results is not None:
        output = output or results / FIGURES_FOLDER
    if output is None:
        raise UsageError("a fit on its own has no folder; name one for the figures.")
    endings = _check_formats(formats)
    existing = _find_drawn_figures(results, names, endings) if results is not None and width is None else None
    captions, order, write_files = existing or summary.prepare_figures(fit, names, width)
    with fill_folder_atomically(Path(output)) as folder:
        copy_captions(Path(output), folder)
        write_files(folder, endings)
        captions_file = write_captions(captions, folder, order)
    files = [f"{name}.{ending}" for name in captions for ending in endings]
    return Files(Path(output) / name for name in (*files, captions_file.name))


def _find_drawn_figures(results: Path, names: Sequence[str], endings: Sequence[str]) -> "FigureFiles | None":
    """Return figures that the fit has drawn before, to be copied; None where they must be drawn."""
    captions = captions_if_unchanged(results, names, endings)
    if captions is None:
        return None
    chosen = {name: text for name, text in captions.items() if name in names or not names}
    return chosen, tuple(captions), partial(_copy_figures, results / FIGURES_FOLDER, tuple(chosen))


def _copy_figures(source: Path, names: Sequence[str], folder: Path, endings: Sequence[str]) -> None:
    """Copy figures from one folder to another."""
    for name in names:
        for ending in endings:
            shutil.copyfile(source / f"{name}.{ending}", folder / f"{name}.{ending}")


def _check_formats(names: Sequence[str]) -> Sequence[str]:
    """Return the endings of the files; PNG where none is named."""
    for name in names:
        if name not in FORMATS:
            raise UsageError(f"there is no format {name!r} for figures{suggest_name(name, list(FORMATS))}")
    return tuple(dict.fromkeys(names)) or (PNG,)
