"""The frame of every page: style, scripts, navigation, and what is said where something cannot be done."""

import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any

from nicegui import ui

from bowdenfit.addons.app.elements import block, link, session_root, text
from bowdenfit.addons.app.page_words import page_words
from bowdenfit.errors import BowdenfitError
from bowdenfit.pages.page import page_assets
from bowdenfit.words import capitalized

_HERE = Path(__file__).parent
_HEAD = '<link rel="stylesheet" href="{0}/assets/app.css"><script defer src="{0}/assets/app.js"></script>'
_PLAIN_START = re.compile(r"[a-z]+ ")  # of a sentence: no name of a file or parameter
NAME = "bowdenfit"


@cache
def style_and_script() -> tuple[str, str]:
    """Return style and script of all pages: those of the report, and ours."""
    style, script = page_assets()
    own_style, own_script = ((_HERE / name).read_text(encoding="utf-8") for name in ("app.css", "app.js"))
    return f"{style}\n{own_style}", f"{script}\n{own_script}"


@contextmanager
def frame(title: str, above: Sequence[tuple[str, str]] = ()) -> Iterator[None]:
    """Put what is inside below the navigation and the title of a page.

    Args:
        title: Title of the page.
        above: Pages on the way to it, as (words, address).
    """
    ui.page_title(f"{title} - {NAME}" if title != NAME else NAME)
    ui.add_head_html(_HEAD.format(session_root()))
    link("To the content", "#content", "skip")
    with block("header", "top"), block("nav", aria_label="Where this is"), block("ol"):
        for words, address in ((NAME, "/"), *above):
            with block("li"):
                link(words, address)
        if title != NAME:
            with block("li", aria_current="page"):
                text(title, "span")
    with block("main", id="content", tabindex="-1"):
        text(title, "h1", dir="auto")
        yield


@contextmanager
def section(heading: str, name: str) -> Iterator[None]:
    """Put what is inside below a heading.

    Args:
        heading: The heading.
        name: By which it is linked to.
    """
    with block("section", aria_labelledby=name):
        text(heading, "h2", id=name)
        yield


def refused(sentence: str) -> None:
    """Show why something was not done."""
    with block("div", "verdict bad", role="alert"):
        for line in page_words(sentence).splitlines():
            text(capitalized(line) if _PLAIN_START.match(line) else line)


def notify(sentence: str) -> None:
    """Show a sentence over the page for a while."""
    words = page_words(sentence)
    ui.notify(words, position="bottom", multi_line=True, timeout=8000, close_button="Close", classes="note-over-page")


async def attempt(action: Callable[[], Any]) -> bool:
    """Do something, or say why it cannot be done; return whether it was done.

    Args:
        action: Function to call, which may be awaited.
    """
    try:
        result = action()
        if hasattr(result, "__await__"):
            await result
    except BowdenfitError as error:
        notify(str(error))
        return False
    return True
