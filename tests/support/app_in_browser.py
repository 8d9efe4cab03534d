"""The app in a process of its own, and a browser that may ask nobody else for anything."""

import queue
import re
import shutil
import subprocess
import sys
import tarfile
import threading
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import pytest
from offline_browser import FAULTS

_AXE = "axe-core@4.10.2"
_ALLOWED = ("acts", "not one header", "not one nav", "not one main", "not one footer")  # what an app has, and a report has not
PATIENCE = 60_000  # ms; a machine with other work on it loads JAX slowly


_SHELL_WORDS = r"""() => {
  const texts = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT), faults = [];
  while (texts.nextNode()) {
    const words = texts.currentNode.data, element = texts.currentNode.parentElement;
    if (element.closest("script, style, .equivalent, .toml")) continue;
    if (/\bbowdenfit [a-z]|Ctrl-C|terminal|(^|[\s(])--[a-z]/.test(words)) faults.push(`of a shell: ${words.slice(0, 80)}`);
  }
  return faults;
}"""


def faults_of(page):
    """What is wrong with a page: contrast, names of controls, headings, width, and words that only a shell understands."""
    faults = [fault for fault in page.evaluate(FAULTS) if not fault.startswith(_ALLOWED)]
    return faults + page.evaluate(_SHELL_WORDS)


_SERIOUS = """async () => (await axe.run(document, { resultTypes: ["violations"] })).violations
  .filter(fault => ["serious", "critical"].includes(fault.impact) || fault.id.includes("main"))
  .map(fault => `${fault.impact}, ${fault.id}: ${fault.nodes.map(node => node.html.slice(0, 120)).join(" | ")}`)"""


def get_axe(folder: Path) -> str:
    """Return the script of axe-core, from npm; the test is skipped where that cannot be reached.

    Args:
        folder: Where npm puts it.
    """
    npm = shutil.which("npm")
    if npm is None:
        pytest.skip("there is no npm to get axe-core with")
    command = [npm, "pack", _AXE, "--silent", "--pack-destination", str(folder)]
    packed = subprocess.run(command, capture_output=True, text=True, check=False, timeout=120, cwd=folder)
    if packed.returncode:
        pytest.skip(f"npm cannot get axe-core: {packed.stderr.strip()[-200:]}")
    with tarfile.open(folder / packed.stdout.split()[-1]) as archive:
        return archive.extractfile("package/axe.min.js").read().decode()


def serious_findings(page, axe):
    """What axe-core finds serious or critical on a page.

    Args:
        page: The page.
        axe: Script of axe-core.
    """
    page.evaluate(axe)
    return page.evaluate(_SERIOUS)


class Served:
    """An app that runs.

    Args:
        process: Its process, whose standard output and error are pipes.
    """

    def __init__(self, process: Any) -> None:
        self.process, self.errors = process, list[str]()
        self._addresses: queue.Queue[str] = queue.Queue()
        readers = (self._listen, lambda: self.errors.extend(process.stderr))
        self._readers = [threading.Thread(target=read, daemon=True) for read in readers]
        for reader in self._readers:
            reader.start()
        self._next = self._addresses.get(timeout=PATIENCE / 1000)
        self.port = urlsplit(self._next).port

    def close(self) -> None:
        """End it."""
        self.process.terminate()
        try:
            self.process.wait(timeout=20)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        for reader, stream in zip(self._readers, (self.process.stdout, self.process.stderr), strict=True):
            reader.join()
            stream.close()

    def _listen(self) -> None:
        """Keep every address that is printed."""
        for line in self.process.stdout:
            if address := re.search(r"http\S+", line):
                self._addresses.put(address[0])

    def new_address(self) -> str:
        """An address that opens the app, once."""
        address, self._next = self._next or self._addresses.get(timeout=PATIENCE / 1000), ""
        return address


@contextmanager
def served(folder: Path, *options: str, **settings: Any):
    """The app of a folder; killed at the end, if it has not ended."""
    command = [sys.executable, "-m", "bowdenfit", "app", str(folder), *(options or ("--no-browser",))]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **settings)
    app = Served(process)
    try:
        yield app
    finally:
        app.close()


@dataclass
class Visit:
    """A page, what it said on the console, and what it asked of others than the app.

    Args:
        page: The page.
        root: Address of the start page in this browser, without a slash at its end.
    """

    page: Any
    root: str = ""
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
        visit.page.goto(app.new_address())
        visit.page.wait_for_url(re.compile(r"/[\w-]{20,}/$"))
        visit.root = visit.page.url.rstrip("/")
        yield visit
        assert visit.faults() == [], visit.faults()
    finally:
        context.close()


def watch(visit, page, app):
    """Note what a page says on the console, and what it asks of others than the app."""
    page.on("console", lambda message: visit.console.append(message.text))
    page.on("pageerror", lambda error: visit.console.append(str(error)))
    own_addresses = ("data:", "blob:", f"http://127.0.0.1:{app.port}/", f"ws://127.0.0.1:{app.port}/")
    page.on("request", lambda request: request.url.startswith(own_addresses) or visit.elsewhere.append(request.url))
    page.on("websocket", lambda socket: socket.url.startswith(own_addresses) or visit.elsewhere.append(socket.url))
