"""The words that a figure shows, for tests of what people read."""

from matplotlib.text import Text


def words(figure):
    """Every visible text of a figure, and its box on the page."""
    figure.draw_without_rendering()
    unseen = {label for axes in figure.axes for label in labels_out_of_view(axes)}
    texts = [t for t in figure.findobj(Text) if t.get_visible() and t.get_text().strip() and t not in unseen]
    return [(t.get_text(), t.get_window_extent()) for t in texts]


def labels_out_of_view(axes):
    """Tick labels that matplotlib keeps but does not draw."""
    for axis in (axes.xaxis, axes.yaxis):
        low, high = sorted(axis.get_view_interval())
        for tick in (*axis.get_major_ticks(), *axis.get_minor_ticks()):
            if not axes.axison or not low <= tick.get_loc() <= high:
                yield tick.label1


def check_words(figure, name):
    """No text of a figure overlaps another or leaves the page."""
    boxes, page = words(figure), figure.bbox.padded(1.0)
    for i, (text, box) in enumerate(boxes):
        inside = page.x0 <= box.x0 and box.x1 <= page.x1 and page.y0 <= box.y0 and box.y1 <= page.y1
        assert inside, f"{name}: {text!r} leaves the page"
        for other, other_box in boxes[i + 1 :]:
            assert not box.padded(-1.0).overlaps(other_box.padded(-1.0)), f"{name}: {text!r} overlaps {other!r}"
