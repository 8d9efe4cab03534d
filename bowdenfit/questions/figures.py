"""All the figures of a fit, in the order in which they are read: each is a file, and a line here.

A figure file has `HEADING`, `data`, what the figure shows of a fit as plain arrays, None where that has nothing of it, and of
such data `draw`, the figure, as wide as it is told, and `caption`, what is drawn, in plain words. Data load no matplotlib.
"""

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, get_type_hints

from bowdenfit import plots
from bowdenfit.arguments import NumberWithUnit
from bowdenfit.errors import StoreError, UsageError
from bowdenfit.inputs import damage_as
from bowdenfit.plots.borrowed import count_panels, draw_on, flatten_axes
from bowdenfit.plots.layout import add_mark, title_above
from bowdenfit.plots.style import in_paper_style
from bowdenfit.plots.write import FORMATS, write_all
from bowdenfit.questions.bends import (
    bending_loss_figure,
    loops_figure,
    motor_force_figure,
    preload_figure,
    preload_window_figure,
    ring_down_figure,
    stretch_figure,
)
from bowdenfit.questions.check import checks_figure
from bowdenfit.questions.figure_files import add_cable_name
from bowdenfit.questions.length import efficiency_figure, wrap_angles_figure
from bowdenfit.questions.recorded import (
    autocorrelation_figure,
    dependence_figure,
    hysteresis_figure,
    recordings_figure,
    sample_efficiency_figure,
)
from bowdenfit.questions.summary import (
    coefficients_figure,
    forces_figure,
    pairs_figure,
    residuals_figure,
    traces_figure,
)
from bowdenfit.results.answer_cache import read_answers
from bowdenfit.results.folder import FIGURE_DATA
from bowdenfit.results.serialization import read_arrays
from bowdenfit.words import listed

if TYPE_CHECKING:
    from bowdenfit.plots.layout import Figure
    from bowdenfit.results.record import Record

_FILES = (  # first what was measured beside the model, then what follows, then whether it can be relied on
    forces_figure,
    motor_force_figure,
    stretch_figure,
    preload_figure,
    loops_figure,
    ring_down_figure,
    recordings_figure,
    wrap_angles_figure,
    efficiency_figure,
    residuals_figure,
    hysteresis_figure,
    sample_efficiency_figure,
    dependence_figure,
    bending_loss_figure,
    preload_window_figure,
    coefficients_figure,
    pairs_figure,
    traces_figure,
    checks_figure,
    autocorrelation_figure,
)
FIGURES = {file.__name__.rpartition(".")[2].removesuffix("_figure"): file for file in _FILES}
NARROWEST, WIDEST = 3.0, 20.0  # in, of a figure; a judgement
HIGHEST = 40.0  # in, of a figure; a judgement


def collect_figure_data(fit: "Record", names: Collection[str] = ()) -> Iterator[tuple[str, Any]]:
    """Yield name and data of each figure that a fit has something to show in, or of some of them."""
    import jax  # here alone, because figures are drawn again from stored data without it

    for name in names or FIGURES:
        with jax.enable_x64(True):
            data = FIGURES[name].data(fit)
        if data is not None:
            yield name, data


def read_figure_data(folder: Path, names: Iterable[str] = ()) -> dict[str, Any]:
    """Read the data of the figures that a fit was drawn with, or of some of them; empty where they are not kept.

    Args:
        folder: Its results folder.
        names: Which; all if omitted.
    """
    if not read_answers(folder, FIGURE_DATA) or not (folder / FIGURE_DATA).exists():
        return {}
    try:
        with damage_as(damaged_figure_data(folder)):
            return read_arrays(folder / FIGURE_DATA, figure_data_types(names or FIGURES))
    except StoreError:  # or kept when the figure showed something else
        return {}


def damaged_figure_data(folder: Path) -> StoreError:
    """Return the error that says that figures cannot be drawn from the data that a folder keeps of them."""
    return StoreError(
        f"{folder / FIGURE_DATA} is damaged, and figures cannot be drawn from it; remove it, and they are worked out again."
    )


def figure_data_types(names: Iterable[str]) -> dict[str, Any]:
    """Return the annotated type of the data of some figures, by their names."""
    return {name: get_type_hints(FIGURES[name].data, localns={"Record": object})["return"] for name in names}


@in_paper_style
def draw_with_title(
    name: str, data: Any, cable: str = "", width: float | None = None, mark: str = "", height: float | None = None
) -> "Figure":
    """Draw a figure under its title; loads matplotlib, and no model.

    Args:
        name: Which of `FIGURES`.
        data: Data of the figure.
        cable: Name of the cable, for the title.
        width: Width of the page [in], on which words stay as large as they are; what suits the figure if omitted.
        mark: See `warning_mark`.
        height: Height of the page [in], to which panels are stretched; what suits the figure if omitted.

    Raises:
        UsageError: The page is too low for the figure.
    """
    figure: Figure = FIGURES[name].draw(data, width)
    title_above(figure, figure_title(name, cable), mark, height)
    return figure


@in_paper_style
def draw_on_axes(name: str, data: Any, ax: Any, mark: str = "") -> "Figure":
    """Draw a figure on axes of matplotlib, and return the figure that these belong to.

    Args:
        name: Which of `FIGURES`.
        data: Data of the figure.
        ax: One, for the first panel alone, or as many as there are panels, in a list or an array as of `plt.subplots`.
        mark: See `warning_mark`; stands in the first panel.

    Raises:
        UsageError: These are no axes, or another number of them.
    """
    axes = flatten_axes(ax)
    if not axes or not all(isinstance(one, plots.mpl.Axes) for one in axes):
        raise UsageError(
            "ax must be axes of matplotlib: one for the first panel, such as ax=plt.subplots()[1], or one for each panel."
        )

    def draw() -> "Figure":
        figure: Figure = FIGURES[name].draw(data, None)
        return figure

    count = count_panels(draw)
    if len(axes) not in (1, count) or len(set(axes)) < len(axes):
        panels = f"{count} panels" if count > 1 else "1 panel"
        several = f", or {count} different ones, such as those of plt.subplots({count})" if count > 1 else ""
        raise UsageError(
            f"the figure {name!r} has {panels}, and ax holds {len(axes)} axes; give one, on which the first panel is "
            f"drawn{several}."
        )
    draw_on(draw, axes)
    first = axes[0]
    if mark:
        add_mark(first, mark)
    figure: Figure = first.figure
    return figure


def warning_mark(troubles: Iterable[str]) -> str:
    """Return what stands on every figure of a fit that is not to be trusted; empty of one that is.

    Args:
        troubles: Kinds of what is wrong, see `verdict`.
    """
    kinds = tuple(troubles)
    return f"Do not use: this fit is {listed(kinds)}." if kinds else ""


def parse_page_width(width: NumberWithUnit | None) -> float | None:
    """Return the width of the page [in]; None for what suits each figure.

    Args:
        width: As stated, with its unit.

    Raises:
        UsageError: It is no length, or none that a figure can have.
    """
    if width is None:
        return None

    from bowdenfit.units import conversion_factor  # here alone, because figures are drawn without pydantic

    value, unit = width
    inches = round(value * conversion_factor(unit, "length") / conversion_factor("in", "length"), 9)
    if not NARROWEST <= inches <= WIDEST:
        raise UsageError(
            f"figures cannot be {value:g} {unit} wide; give a width from {NARROWEST:g} in to {WIDEST:g} in, such as 3.5in for "
            "a column of a paper."
        )
    return float(inches)


def parse_page_size(figsize: tuple[float, float]) -> tuple[float, float]:
    """Return width and height of the page [in].

    Args:
        figsize: As stated.

    Raises:
        UsageError: These are no two numbers, or none that a figure can have.
    """
    remedy = f"write figsize=(7, 5), from {NARROWEST:g} in to {WIDEST:g} in wide and up to {HIGHEST:g} in high."
    try:
        width, height = (float(size) for size in figsize)
    except (TypeError, ValueError):
        raise UsageError(f"figsize is the width and the height of the page in inches, not {figsize!r}; {remedy}") from None
    if not (NARROWEST <= width <= WIDEST and 0 < height <= HIGHEST):
        raise UsageError(f"a figure cannot be {width:g} in wide and {height:g} in high; {remedy}")
    return width, height


def figure_title(name: str, cable: str) -> str:
    """Return the heading of a figure with the name of the cable."""
    return add_cable_name(FIGURES[name].HEADING, cable)


def figure_caption(name: str, data: Any) -> str:
    """Say what a figure shows, in plain words: what is drawn, what the bands are, of how many."""
    text: str = FIGURES[name].caption(data)
    return text


def write_figure_files(
    name: str,
    data: Any,
    folder: Path,
    formats: Sequence[str] = FORMATS,
    cable: str = "",
    width: float | None = None,
    mark: str = "",
) -> list[Path]:
    """Draw and write one figure.

    Args:
        name: Which of `FIGURES`.
        data: Data of the figure.
        folder: Where the files go; made if it is missing.
        formats: Endings; the figure is written in every one.
        cable, width, mark: See `draw_with_title`.
    """
    folder.mkdir(parents=True, exist_ok=True)
    return write_all(draw_with_title(name, data, cable, width, mark), folder, name, formats)


def titles_and_captions(data: Mapping[str, Any], cable: str, mark: str) -> dict[str, str]:
    """Return title and caption of each figure, by name.

    Args:
        data: Data of the figures, by name.
        cable: Name of the cable.
        mark: See `warning_mark`.
    """
    titles = {name: f"{figure_title(name, cable)}. {mark}".rstrip() for name in FIGURES if name in data}
    return {name: f"{title} {figure_caption(name, data[name])}" for name, title in titles.items()}
