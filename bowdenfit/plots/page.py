"""A matplotlib figure that a notebook displays by itself, whatever the state of pyplot; imported when something is drawn."""

import io

from matplotlib.figure import Figure

from bowdenfit.plots.write import save

_PIXELS = 100  # of the screen, an inch


class Page(Figure):
    """matplotlib's figure, unknown to pyplot."""

    def _repr_png_(self) -> tuple[bytes, dict[str, int]]:
        """What a notebook shows, and how wide, so that the points are fine on any screen."""
        buffer = io.BytesIO()
        save(self, buffer, "png")
        return buffer.getvalue(), {"width": int(_PIXELS * self.get_size_inches()[0])}
