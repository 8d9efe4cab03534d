"""A bar in a notebook while a verb takes long: one line of output, written over again and again."""

import io
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from bowdenfit.verb import Watch


@contextmanager
def show_progress_bar(watch: Watch, report: Callable[..., None] | None) -> Iterator[Callable[..., None] | None]:
    """Gives what to call while a verb runs: what its caller wants called, else in a notebook what moves a bar there.

    The line is a display of its own and no stream, so that a notebook keeps one line of it; tqdm's own bar for notebooks asks
    for ipywidgets.

    Args:
        watch: What the bar shows.
        report: What the caller wants called; None if nothing.
    """
    if report is not None or not is_notebook():
        yield report
        return
    from IPython.display import display
    from tqdm import tqdm

    line = display({"text/plain": ""}, raw=True, display_id=True)

    class Bar(tqdm):
        monitor_interval = 0  # no thread of its own: a process with threads is not copied

        def display(self, msg: str | None = None, pos: int | None = None) -> None:  # noqa: ARG002
            line.update({"text/plain": str(self) if msg is None else msg}, raw=True)

    with Bar(file=io.StringIO(), **watch.bar) as bar:
        yield lambda *progress: watch.show(bar, *progress)


def is_notebook() -> bool:
    """Whether the program runs in the kernel of a notebook."""
    shell: Any = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    return getattr(shell, "kernel", None) is not None
