"""Write a figure to a file, whole or not at all."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

from bowdenfit import plots
from bowdenfit.outputs import replace_atomically
from bowdenfit.plots.style import DOTS_PER_INCH, in_paper_style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PNG = "png"
FORMATS = (PNG, "svg", "pdf")
OPTIONS: dict[str, dict[str, Any]] = {
    "svg": {"metadata": {"Date": None}},
    "pdf": {"metadata": {"CreationDate": None}},
}


def write_all(figure: Figure, folder: Path, name: str, formats: Sequence[str] = FORMATS) -> list[Path]:
    """Write a figure into a folder in every format, and return the files."""
    return [write(figure, folder / f"{name}.{ending}") for ending in formats]


def write(figure: Figure, path: Path) -> Path:
    """Write one file under a temporary name and rename it; the same figure always gives the same bytes.

    Whoever reads the folder meanwhile sees the old file or the new one, never half of one.
    """
    with replace_atomically(path) as temporary:
        save(figure, temporary, path.suffix.removeprefix("."))
    return path


@in_paper_style
def save(figure: Figure, target: Path | BinaryIO, ending: str) -> None:
    """Save a figure as it is meant to look.

    Args:
        figure: The figure.
        target: File.
        ending: Format.
    """
    options: dict[str, Any] = {"format": ending, "dpi": DOTS_PER_INCH, **OPTIONS.get(ending, {})}
    try:
        figure.savefig(target, **options)
    except ValueError:  # a name that someone chose has dollar signs in it, and no formula between them
        _show_as_written(figure)
        figure.savefig(target, **options)


def _show_as_written(figure: Figure) -> None:
    """Show texts literally that have dollar signs but are not formulas."""
    parser = plots.mpl.MathTextParser("path")
    for text in figure.findobj(plots.mpl.Text):
        assert isinstance(text, plots.mpl.Text)
        try:
            parser.parse(text.get_text())
        except ValueError:
            text.set_parse_math(False)
