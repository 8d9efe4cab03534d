"""A verb: one function for notebooks, what the command line prints of its answer, and its progress bar. Loads little."""

import io
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from tqdm import tqdm

NOT_TRUSTED = 3  # exit code


@dataclass(frozen=True)
class Reply:
    """What the command line prints of an answer.

    Args:
        text: For people.
        page: Gives the answer for programs, asked only for `--json`.
        csv: Gives it as CSV, asked only for `--csv`.
        notes: Lines beside the answer, on standard error.
        pieces: Parts of lines that are printed as they come, before the text.
        exit_code: 0; 3 for an answer that must not be trusted, 2 for what is said of input that cannot be used.
    """

    text: str
    page: Callable[[], Any] | None = None
    notes: tuple[str, ...] = ()
    exit_code: int = 0
    csv: Callable[[], str] | None = None
    pieces: Iterable[str] = ()


@dataclass(frozen=True)
class Watch:
    """Progress bar and interrupts of a verb that takes long.

    Args:
        kept: File in the results folder that lets it go on later; empty where nothing does.
        remark: What is kept; the folder follows.
        bar: Options of the progress bar.
        show: Moves the bar by what the function reports.
    """

    kept: str
    remark: str
    bar: Mapping[str, Any]
    show: Callable[..., None]


@dataclass(frozen=True)
class Verb:
    """One verb of the command line and of notebooks.

    Args:
        function: What notebooks call.
        reply: What the command line prints, from the answer and the keywords it was asked with.
        text: The verb's help, in lines of at most 80 characters. The list of verbs shows the first, which stands apart.
        name: On the command line; the function's if omitted.
        json: What `--json` prints, in words; empty without that option.
        csv: What `--csv` prints, in words; empty without that option.
        results: Folder in which results go unless `output` names another.
        watch: How it is interrupted; None if it is quick.
        warns: Whether a fit that is not to be trusted is said beside the answer, which then ends with `NOT_TRUSTED`.
        explains: A trouble of a fit that the answer is about, so that it is right in spite of it.
        kept: The reply by what a fit has answered before, and the keywords; None where they ask for something else. A
            reply without a page is for people only.
    """

    function: Callable[..., Any]
    reply: Callable[..., Reply]
    text: str
    name: str = ""
    json: str = "Print as JSON."
    csv: str = ""
    results: str = ""
    watch: Watch | None = None
    warns: bool = False
    explains: str = ""
    kept: Callable[[Mapping[str, Any], Mapping[str, Any]], Reply | None] | None = None


@contextmanager
def show_progress_bar(watch: Watch, report: Callable[..., None] | None) -> Iterator[Callable[..., None] | None]:
    """Yield what to call while a verb runs: the caller's function, else in a notebook one that moves a bar.

    The line is a display object rather than a stream, so that a notebook keeps one line; tqdm's own bar for notebooks asks
    for ipywidgets.

    Args:
        watch: What the bar shows.
        report: What the caller wants called; None if nothing.
    """
    if report is not None or not is_notebook():
        yield report
        return
    from IPython.display import display  # which a notebook brings, and nothing else needs

    line = display({"text/plain": ""}, raw=True, display_id=True)

    class Bar(tqdm):
        monitor_interval = 0  # no thread of its own: a process with threads is not copied

        def display(self, msg: str | None = None, pos: int | None = None) -> None:  # noqa: ARG002
            line.update({"text/plain": str(self) if msg is None else msg}, raw=True)

    with Bar(file=io.StringIO(), **watch.bar) as bar:
        yield lambda *progress: watch.show(bar, *progress)


def is_notebook() -> bool:
    """Return whether the program runs in the kernel of a notebook."""
    shell: Any = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    return getattr(shell, "kernel", None) is not None
