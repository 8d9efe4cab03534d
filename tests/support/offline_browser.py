"""A browser that reads a page from its file with the network cut, and what it found there."""

import re
import shutil
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

FAULTS = Path(__file__).with_name("page_faults.js").read_text(encoding="utf-8")


@dataclass
class Reader:
    """A page as it was opened: what it said on the console, and what it asked for."""

    page: Any
    messages: list[str] = field(default_factory=list)
    requested: list[str] = field(default_factory=list)

    def faults(self) -> list[str]:
        """What is wrong with the page, a sentence each."""
        complaints = [f"on the console: {text}" for text in self.messages] + [f"asked for {url}" for url in self.requested]
        return complaints + self.page.evaluate(FAULTS)

    def sheets(self) -> int:
        """How many sheets of paper it is."""
        return len(re.findall(rb"/Type\s*/Page\b", self.page.pdf(prefer_css_page_size=True)))


@contextmanager
def browser():
    """Debian's Chromium; the tests that need one are skipped where there is none."""
    program = shutil.which("chromium")
    if program is None:
        pytest.skip("there is no chromium to open reports with; install Debian's package chromium")
    from playwright.sync_api import sync_playwright

    with sync_playwright() as play:
        chromium = play.chromium.launch(executable_path=program, args=["--no-sandbox"])
        try:
            yield chromium
        finally:
            chromium.close()


@contextmanager
def opened(chromium, path: Path, width=1200, **settings):
    """A page opened from its file, whatever it asks for besides recorded and refused."""
    context = chromium.new_context(viewport={"width": width, "height": 900}, **settings)
    try:
        context.set_offline(True)
        reader = Reader(context.new_page())

        def answer(route):
            if route.request.url == path.as_uri():
                return route.continue_()
            reader.requested.append(route.request.url)
            return route.abort()

        context.route("**/*", answer)
        reader.page.on("console", lambda message: reader.messages.append(message.text))
        reader.page.on("pageerror", lambda error: reader.messages.append(str(error)))
        reader.page.on("dialog", lambda dialog: (reader.messages.append(dialog.message), dialog.dismiss()))
        reader.page.goto(path.as_uri())
        yield reader
    finally:
        context.close()
