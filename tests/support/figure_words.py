"""What is wrong with a figure as people see it: words off the page or over each other, marks that look alike, empty panels."""

import re
from itertools import combinations

import numpy as np
from matplotlib.cbook import is_math_text
from matplotlib.collections import Collection
from matplotlib.container import ErrorbarContainer
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.text import Text
from terminal_pages import jargon

from bowdenfit.questions.figure_files import draw_answer_figure
from bowdenfit.questions.figures import draw_with_title, figure_caption

NARROW = 3.5  # in, a column of a paper
LEAST = 6.0  # pt
_FORMULA = re.compile(r"\$[^$]*\$")
_COMMAND = re.compile(r"\\[a-zA-Z]+|\\.")
_WORD = re.compile(r"[^\W\d_]{3,}")


def words(figure):
    """Every visible text of a figure, and its box on the page."""
    return _boxes(_texts(figure))


def _boxes(texts):
    return [(text.get_text(), text.get_window_extent()) for text in texts]


def _texts(figure):
    figure.draw_without_rendering()
    unseen = {label for axes in figure.axes for label in labels_out_of_view(axes)}
    return [t for t in figure.findobj(Text) if t.get_visible() and t.get_text().strip() and t not in unseen]


def labels_out_of_view(axes):
    """Tick labels that matplotlib keeps but does not draw."""
    for axis in (axes.xaxis, axes.yaxis):
        low, high = sorted(axis.get_view_interval())
        for tick in (*axis.get_major_ticks(), *axis.get_minor_ticks()):
            if not axes.axison or not low <= tick.get_loc() <= high:
                yield tick.label1


def check_words(figure, name):
    """No text of a figure overlaps another or leaves the page."""
    assert not (wrong := [f"{name}: {fault}" for fault in _misplaced(figure, words(figure))]), wrong


def assert_readable(shown, cable, widths=(None, NARROW)):
    """No figure has a fault on any page.

    Args:
        shown: Data of figures, by name.
        cable: Name of the cable.
        widths: Of the pages [in]; None for the usual one.
    """
    figures = [(name, width, draw_with_title(name, data, cable, width)) for name, data in shown.items() for width in widths]
    wrong = [f"{name} at {width}: {fault}" for name, width, figure in figures for fault in faults(figure)]
    wrong += [f"caption of {name}: {fault}" for name, data in shown.items() for fault in jargon(figure_caption(name, data))]
    assert not wrong, "\n".join(wrong)


def assert_answer_readable(file, shown_data, cable):
    """The figure of an answer has no fault, and its caption is in plain words.

    Args:
        file: Of the figure.
        shown_data: The answer.
        cable: Name of the cable.
    """
    caption = file.caption(shown_data)
    assert " n = " in caption
    assert not (wrong := [*faults(draw_answer_figure(file, shown_data, cable)), *jargon(caption)]), "\n".join(wrong)


def faults(figure):
    """What is wrong with a figure, in sentences."""
    texts = _texts(figure)
    boxes = _boxes(texts)
    page_faults = [*_misplaced(figure, boxes), *_alike(figure), *_empty(figure), *_garbled(texts), *_small(texts)]
    return page_faults + [f"{text!r} has {fault}" for text, _ in boxes for fault in jargon(_FORMULA.sub(" ", text))]


def _misplaced(figure, boxes):
    """Texts off the page, and texts over each other."""
    page = figure.bbox.padded(1.0)
    for text, box in boxes:
        if not (page.x0 <= box.x0 and box.x1 <= page.x1 and page.y0 <= box.y0 and box.y1 <= page.y1):
            yield f"{text!r} leaves the page"
    within = [(text, box.padded(-1.0)) for text, box in boxes]
    for (text, box), (other, other_box) in combinations(within, 2):
        if box.overlaps(other_box):
            yield f"{text!r} overlaps {other!r}"


def _alike(figure):
    """Entries of a legend that look the same."""
    legends = [*figure.legends, *(axes.get_legend() for axes in figure.axes if axes.get_legend())]
    entries = [entry for axes in figure.axes for entry in zip(*axes.get_legend_handles_labels(), strict=True)]
    marks = {label: bars[0] for bars, label in entries if isinstance(bars, ErrorbarContainer) and bars[0] is not None}
    for legend in legends:
        shown = [(text.get_text(), handle) for handle, text in zip(legend.legend_handles, legend.texts, strict=True)]
        looks = [(_look(marks.get(label, handle)), label) for label, handle in shown]
        for (look, label), (other, other_label) in combinations([(a, b) for a, b in looks if a is not None], 2):
            if look == other:
                yield f"{label!r} and {other_label!r} look alike in the legend"


def _look(handle):
    """What tells a mark of a legend from others; None of an entry that is words alone."""
    if isinstance(handle, Line2D):
        line, marker = handle.get_linestyle(), handle.get_marker()
        seen = (line not in ("None", " "), marker not in ("None", " ", "", None))
        if not any(seen):
            return None
        dashes = (line, getattr(handle, "_unscaled_dash_pattern", None)) if seen[0] else ""
        mark = (marker, _color(handle.get_markerfacecolor()), _color(handle.get_markeredgecolor())) if seen[1] else ""
        size = round(handle.get_markersize(), 1) if seen[1] and not seen[0] else 0
        return ("line", _color(handle.get_color()) if seen[0] else "", str(dashes), mark, size)
    if isinstance(handle, Patch):
        return ("area", _color(handle.get_facecolor()), _color(handle.get_edgecolor()), handle.get_hatch())
    if isinstance(handle, Collection):
        colors = _color(handle.get_facecolor()), _color(handle.get_edgecolor())
        return ("marks", colors, tuple(handle.get_linewidth()), str(handle.get_linestyle()))
    return ("several", tuple(_look(part) for part in handle)) if isinstance(handle, tuple) else (str(type(handle)), id(handle))


def _color(color):
    return tuple(np.round(np.ravel(color), 3)) if not isinstance(color, str) else color


def _empty(figure):
    """Panels that show nothing measured or worked out."""
    for axes in figure.axes:
        if not any(_shows(axes, artist) for artist in (*axes.lines, *axes.collections, *axes.patches, *axes.images)):
            yield f"the panel {axes.get_title() or axes.get_title('left') or axes.get_ylabel()!r} is empty"


def _shows(axes, artist):
    if isinstance(artist, Line2D):
        points = np.asarray(artist.get_xydata(), dtype=float)
        return artist.get_transform() == axes.transData and bool(np.any(np.all(np.isfinite(points), axis=1)))
    if isinstance(artist, Collection):
        return any(len(path.vertices) for path in artist.get_paths()) or artist.get_offsets().size > 2
    if isinstance(artist, Patch):
        return artist.get_transform().contains_branch(axes.transData) and artist.get_data_transform() == axes.transData
    return True


def _garbled(texts):
    """Names set letter by letter in a formula, and code where a name should be."""
    for text in texts:
        message = text.get_text()
        parts = re.split(r"(?<!\\)\$", message) if text.get_parse_math() and is_math_text(message) else [message]
        if any(_WORD.search(_COMMAND.sub(" ", part)) for part in parts[1::2]):
            yield f"{message!r} sets a name letter by letter"
        if any(re.search(r"\w_\w|\\(?!\$)|\^", part) for part in parts[::2]):
            yield f"{message!r} shows code"


def _small(texts):
    """Words too small to be read."""
    for text in texts:
        if text.get_fontsize() < LEAST:
            yield f"{text.get_text()!r} is {text.get_fontsize():g} pt"
