"""The app in a process of its own, and a browser that may ask nobody else for anything."""

import re
import subprocess
import sys
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

PATIENCE = 60_000  # ms; a machine with other work on it loads JAX slowly


@dataclass
class Served:
    """An app that runs.

    Args:
        address: With the key, as it was printed.
        process: Its process.
    """

    address: str
    process: Any

    @property
    def root(self) -> str:
        """The address without the key."""
        return self.address.partition("?")[0].rstrip("/")

    @property
    def port(self) -> int:
        """Its port."""
        return int(self.root.rpartition(":")[2])


@contextmanager
def served(folder: Path, *options: str):
    """The app of a folder; killed at the end, if it has not ended."""
    command = [sys.executable, "-m", "bowdenfit", "app", str(folder), "--no-browser", *options]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        line = process.stdout.readline()
        assert "http" in line, process.stderr.read()
        yield Served(re.search(r"http\S+", line)[0], process)
    finally:
        process.terminate()
        try:
            process.communicate(timeout=20)
        except subprocess.TimeoutExpired:
            process.kill()
            process.communicate()


@dataclass
class Visit:
    """A page, what it said on the console, and what it asked of others than the app."""

    page: Any
    console: list[str] = field(default_factory=list)
    elsewhere: list[str] = field(default_factory=list)

    def faults(self) -> list[str]:
        """What is wrong so far."""
        return self.console + self.elsewhere


@contextmanager
def visiting(chromium, app: Served, width=1280, **settings):
    """A tab of a browser of its own at the start of the app; the visit must end without faults."""
    context = chromium.new_context(viewport={"width": width, "height": 900}, **settings)
    context.set_default_timeout(PATIENCE)
    try:
        visit = Visit(context.new_page())
        watch(visit, visit.page, app)
        visit.page.goto(app.address)
        yield visit
        assert visit.faults() == [], visit.faults()
    finally:
        context.close()


def watch(visit, page, app):
    """Note what a page says on the console, and what it asks of others than the app."""
    page.on("console", lambda message: visit.console.append(message.text))
    page.on("pageerror", lambda error: visit.console.append(str(error)))
    asked = ("data:", "blob:", app.root, app.root.replace("http", "ws"))
    page.on("request", lambda request: request.url.startswith(asked) or visit.elsewhere.append(request.url))
    page.on("websocket", lambda socket: socket.url.startswith(asked) or visit.elsewhere.append(socket.url))
