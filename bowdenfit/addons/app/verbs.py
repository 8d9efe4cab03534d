"""The verb `app`: serve the bench in the browser until it is interrupted."""

import os
import traceback
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter

from bowdenfit.addons import app as room
from bowdenfit.arguments import HIDDEN, PATH, read_first
from bowdenfit.errors import BowdenfitError, UsageError, describe_unforeseen, system_error
from bowdenfit.verb import Reply, Verb

_LIBRARIES = {"nicegui", "fastapi", "uvicorn", "tomlkit"}  # of the extra


@read_first
def app(
    folder: Annotated[str | Path | None, Parameter("FOLDER"), PATH] = None,
    *,
    port: Annotated[int, Parameter(metavar="NUMBER", show_default="one that is free")] = 0,
    browser: Annotated[bool, Parameter(negative="--no-browser")] = True,
    say: Annotated[Callable[..., None], HIDDEN] = lambda *_, **__: None,
    is_stopped: Annotated[Callable[[], bool], HIDDEN] = lambda: False,
) -> None:
    """Serve the app until it is stopped.

    Args:
        folder: Where data sets and fits lie; the current folder if omitted.
        port: On which this machine serves the page.
        browser: Open the page in the default browser.
        say: Prints a sentence, on standard error with `err=True`.
        is_stopped: Whether to end.

    Raises:
        UsageError: There is no such folder, the port is in use, or the libraries of the app are not installed.
    """
    try:
        serve_app = room.serve_app  # loaded here, because NiceGUI is large, and not everybody has installed it
    except ModuleNotFoundError as error:
        if error.name not in _LIBRARIES:
            raise
        raise UsageError("the app needs NiceGUI, which is not installed; install it: pip install 'bowdenfit[app]'.") from None
    serve_app(Path(folder or ""), port, browser, is_stopped, say, partial(_report_error, say))


def _report_error(say: Callable[..., None], error: Exception) -> None:
    """Print what went wrong in a page, while the app goes on."""
    if os.environ.get("BOWDENFIT_DEBUG"):
        traceback.print_exception(error)
    refusal = error if isinstance(error, BowdenfitError) else system_error(error)
    say(f"Error: {refusal or describe_unforeseen(error)}", err=True)


def _reply(_: None, __: dict[str, Any]) -> Reply:
    return Reply("")


APP = Verb(
    app,
    _reply,
    """Open the app in the browser: add data, fit, view, plan what to measure.

    The page is served to this machine alone, and asks no other for anything. Data
    sets and fits lie in FOLDER as the other commands write them: data sets beside
    each other, fits in its folder fits. It needs pip install 'bowdenfit[app]'.
    """,
    json="",
    serves=True,
)
