"""A matplotlib figure that a notebook displays by itself, whatever the state of pyplot; imported when something is drawn."""

import io

from matplotlib.figure import Figure

from bowdenfit.plots.write import save

_PIXELS = 100  # of the screen, an inch; the usual resolution of notebooks


class Page(Figure):
    """A matplotlib figure that pyplot does not know."""

    def _repr_png_(self) -> tuple[bytes, dict[str, int]]:
        """Return the PNG for notebooks and its width in pixels, at a resolution that is fine on any screen."""
        buffer = io.BytesIO()
        save(self, buffer, "png")
        return buffer.getvalue(), {"width": int(_PIXELS * self.get_size_inches()[0])}
