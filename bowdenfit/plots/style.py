"""How every figure looks: colors, sizes and words; the one place where matplotlib's settings are chosen.

This room and the figure files load matplotlib only once they draw, so that what a figure shows can be worked out without.
"""

import functools
import logging
import math
import warnings
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import Any, ParamSpec, TypeVar

from bowdenfit import plots

Arguments, Result = ParamSpec("Arguments"), TypeVar("Result")

# Okabe and Ito's palette, which readers with any kind of color vision can tell apart.
BLACK, ORANGE, SKY, GREEN = "#000000", "#E69F00", "#56B4E9", "#009E73"
BLUE, VERMILLION, PURPLE, GRAY = "#0072B2", "#D55E00", "#CC79A7", "#666666"
LIGHT = "#E9E9E9"
# Each series differs in color, marker and line, so that it survives a gray print.
SERIES_COLORS = (BLUE, VERMILLION, GREEN, PURPLE, BLACK, ORANGE, SKY, GRAY)
SERIES_MARKERS = ("o", "s", "^", "D", "v", "P", "X", "h")
SERIES_LINES = ("-", (0, (5, 1.5)), (0, (1, 1)), (0, (5, 1, 1, 1)))

WIDE = 7.0  # in, both columns of a paper of the IEEE
MEDIUM = 4.6  # in, figures of one panel; a judgement
SMALL = 7  # pt, ticks and legends
TITLE_SIZE = 8  # pt
LEAST = 6  # pt, of any words; what journals still print
DOTS_PER_INCH = 160  # a judgement: sharp on a screen, and small enough to be mailed

IN_WORDS = {"log rad": "log angle"}  # units that few would understand
EFFICIENCY, WRAP_ANGLE = "Efficiency (%)", "Wrap angle (deg)"
WIDE_INTERVAL, NARROW_INTERVAL, MEDIAN, LEAST_SQUARES = "90 % interval", "50 % interval", "Median", "Least squares"
LEFT_OUT = "Left out by the user"  # readings that no fit uses, gray

FAMILIES = ["DejaVu Sans", "Bitstream Vera Sans", "Verdana", "Arial"]  # in SVG; here always the first
SETTINGS: dict[Any, Any] = {
    "font.family": ["sans-serif"],
    "font.sans-serif": FAMILIES,
    "mathtext.fontset": "dejavusans",
    "font.size": 8,
    "axes.titlesize": 8,
    "axes.titley": 1.0,  # given, not searched for: the search takes longer than drawing the title
    "axes.labelsize": 8,
    "xtick.labelsize": SMALL,
    "ytick.labelsize": SMALL,
    "legend.fontsize": SMALL,
    "legend.frameon": False,
    "legend.handlelength": 1.8,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.7,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.formatter.limits": [-4, 6],
    "axes.formatter.useoffset": False,
    "grid.color": "#DDDDDD",
    "grid.linewidth": 0.5,
    "lines.linewidth": 1.3,
    "lines.markersize": 4.5,
    "hatch.linewidth": 0.5,
    "figure.dpi": DOTS_PER_INCH,
    "figure.facecolor": "white",
    "svg.fonttype": "none",
    "svg.hashsalt": "bowdenfit",
    "pdf.fonttype": 42,  # letters as letters
    "text.hinting": "no_hinting",  # as far apart in PNG as in SVG and PDF; to fit letters to dots takes a sixth of a PNG
}

_NO_LOOKS = {
    "backend", "backend_fallback", "interactive", "toolbar", "timezone", "webagg", "tk", "macosx", "docstring", "keymap",
}  # fmt: skip


def in_paper_style(function: Callable[Arguments, Result]) -> Callable[Arguments, Result]:
    """Run a function under the settings of this file; matplotlib's own are back afterwards."""
    @functools.wraps(function)
    def styled(*args: Arguments.args, **kwargs: Arguments.kwargs) -> Result:
        if all(plots.mpl.rcParams[name] == value for name, value in SETTINGS.items()):
            return function(*args, **kwargs)  # called by another such function; a context takes 3 ms
        with plots.mpl.rc_context(_all_settings()), _boxes_without_words():
            return function(*args, **kwargs)

    return styled


@functools.cache
def _all_settings() -> dict[Any, Any]:
    """Return the settings of this file on top of matplotlib's defaults, so that no matplotlibrc lying about counts.

    What does not concern the look of a figure stays: the backend, and how windows behave.
    """
    defaults = plots.mpl.rcParamsDefault
    looks = {name: defaults[name] for name in defaults if name.partition(".")[0] not in _NO_LOOKS}
    return looks | SETTINGS


@contextmanager
def _boxes_without_words() -> Iterator[None]:
    """Silence matplotlib's warnings about letters that the font lacks, which are boxes in a figure."""
    log = logging.getLogger("matplotlib.mathtext")  # where letters behind a symbol are placed
    log.addFilter(_is_not_about_glyphs)
    try:
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", message=r"Glyph \d+ .* missing from")
            yield
    finally:
        log.removeFilter(_is_not_about_glyphs)


def _is_not_about_glyphs(message: logging.LogRecord) -> bool:
    return "does not have a glyph" not in str(message.msg)


def mapped_color(colors: str, position: float) -> Any:
    """Return the color at a position from 0 to 1 of one of matplotlib's color maps."""
    return plots.mpl.colormaps[colors](position)


def percent(fraction: float) -> str:
    """Return a fraction in percent, such as '1 %'."""
    return f"{100 * fraction:.3g} %"


def axis_label(symbol: str, unit: str) -> str:
    """Return the label of an axis: symbol and unit, without a unit where there is none."""
    return symbol if unit in {"", "1"} else f"{symbol} ({IN_WORDS.get(unit, unit)})"


def rounded_texts(values: Iterable[float], spread: float) -> list[str]:
    """Return numbers as text, to two significant digits of their spread."""
    decimals = 3 if not 0 < spread < math.inf else max(0, 1 - math.floor(math.log10(spread)))
    return [f"{value:z.{decimals}f}".replace("-", "\N{MINUS SIGN}") for value in values]
