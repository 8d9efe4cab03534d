"""A comparison of fits to its folder: as plain data, for people, and as a figure."""

import json
from pathlib import Path
from typing import TYPE_CHECKING

from bowdenfit.errors import StoreError

if TYPE_CHECKING:
    from bowdenfit.questions.compare.answer import Comparison

PAGE, TEXT, FIGURE = "comparison.json", "comparison.txt", "comparison"


def refuse_to_replace(folder: Path, force: bool) -> None:
    """Stop before anything is computed if a comparison would have no place.

    Args:
        folder: Where it would go.
        force: Whether an earlier comparison there may be replaced.

    Raises:
        StoreError: The folder holds something else already, or an earlier comparison.
    """
    if not folder.exists() or (folder.is_dir() and not any(folder.iterdir())):
        return
    if not (folder / PAGE).exists():
        raise StoreError(f"{folder} exists and holds no comparison; name another with --output.")
    if not force:
        raise StoreError(
            f"{folder} holds a comparison already; add --force to replace it, or name another with --output."
        )


def write_comparison(found: "Comparison", folder: Path) -> list[Path]:
    """Write comparison.txt, the figure as PNG and SVG, and, last, comparison.json.

    Args:
        found: The comparison.
        folder: Where to; made if missing.

    Returns:
        The files.

    Raises:
        StoreError: The folder cannot be written.
    """
    from bowdenfit.plots.write import FORMATS, write
    from bowdenfit.questions.compare.figure import comparison
    from bowdenfit.questions.compare.words import comparison_text
    from bowdenfit.results.folder import made, write_text

    with made(folder):
        write_text(folder / TEXT, comparison_text(found))
        figure = comparison(found)
        figures = [write(figure, folder / f"{FIGURE}.{ending}") for ending in FORMATS]
        write_text(folder / PAGE, json.dumps(found.page(), indent=1) + "\n")
    return [folder / TEXT, *figures, folder / PAGE]
