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
