"""A matplotlib figure that a notebook displays by itself, whatever the state of pyplot; imported when something is drawn."""

import io

from matplotlib.artist import Artist
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.legend import Legend
from matplotlib.text import Text

from bowdenfit.plots.write import save

_PIXELS = 100  # of the screen, an inch; the usual resolution of notebooks
_LEFT, _RIGHT = 0.62, 0.18  # in, margins by which the width of a panel is estimated before it is placed
_DIGITS = 7  # of positions on a page: far less than a dot
_PAD = 0.04  # in, around each panel with its words; a judgement


class _Layout(ConstrainedLayoutEngine):
    """Constrained layout whose last digits, which its solver takes from the order of addresses, are cut off."""

    def execute(self, fig: Figure) -> None:
        """Place the panels."""
        super().execute(fig)
        for axes in fig.axes:
            in_layout = axes.get_in_layout()
            left, bottom, width, height = (round(float(part), _DIGITS) for part in axes.get_position().bounds)
            axes.set_position((left, bottom, width, height))
            axes.set_in_layout(in_layout)


class Page(Figure):
    """A matplotlib figure that pyplot does not know: panels that matplotlib places, and rows above them all.

    Args:
        width, height: Size without rows above the panels [in].
    """

    def __init__(self, width: float, height: float) -> None:
        engine = _Layout(w_pad=_PAD, h_pad=_PAD, wspace=0.0, hspace=0.0)
        super().__init__(figsize=(width, height), layout=engine)
        self.subplotpars.update(left=_LEFT / width, right=1 - _RIGHT / width, wspace=0.1)  # until panels are placed
        self.panel_height = height  # in, of all rows of panels
        self._above: list[tuple[Artist | None, float]] = []  # the lowest first

    def add_above(self, artist: Artist | None, height: float) -> None:
        """Make the page higher by a row for a text or a legend, above all that is there [in]; for nothing if it is None."""
        if artist is not None:
            artist.set_in_layout(False)
        self._above.append((artist, height))
        self.set_height(float(self.get_size_inches()[1]) + height)

    def set_height(self, height: float) -> None:
        """Make the page as high as stated [in], by the height of its panels; rows above them stay as high as they are."""
        self.set_figheight(height)
        top = 1.0
        for artist, room in reversed(self._above):
            if isinstance(artist, Text):
                artist.set_y(top)
            elif isinstance(artist, Legend):
                artist.set_bbox_to_anchor((0.5, top), self.transFigure)
            top -= room / height
        engine = self.get_layout_engine()
        assert isinstance(engine, ConstrainedLayoutEngine)
        engine.set(rect=(0.0, 0.0, 1.0, top))

    def place_panels(self) -> None:
        """Place the panels as they are now, for what depends on how large they are."""
        engine = self.get_layout_engine()
        assert engine is not None
        engine.execute(self)

    def _repr_png_(self) -> tuple[bytes, dict[str, int]]:
        """Return the PNG for notebooks and its width in pixels, at a resolution that is fine on any screen."""
        buffer = io.BytesIO()
        save(self, buffer, "png")
        return buffer.getvalue(), {"width": int(_PIXELS * self.get_size_inches()[0])}
