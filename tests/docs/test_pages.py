"""The documentation builds without a warning and without a network, its notebooks run, and its links lead somewhere."""

import json
import os
import re
import subprocess
import sys
from html.parser import HTMLParser
from importlib.metadata import metadata
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest
from conftest import ROOT

pytestmark = pytest.mark.extended

LINKS = {
    "https://docs.dask.org": "",  # distributed names another page there
    "https://github.com/pradyunsg/furo": "furo",
    "https://keepachangelog.com": "",
    "https://pint.readthedocs.io": "pint",
    "https://semver.org": "",
}
"""Where pages lead on the network, and the installed package that names that address as its own.

The tests have no network and cannot follow them. Those that no package names were looked over by a person.
"""
MOST_TEXT = 2000  # characters of one output


@pytest.fixture(scope="module")
def built(tmp_path_factory) -> Path:
    """The documentation, whose notebooks are shown and not run."""
    return _built(tmp_path_factory, "-D", "nb_execution_mode=off")


@pytest.fixture(scope="module")
def built_anew(tmp_path_factory) -> Path:
    """The documentation as a reader has it."""
    return _built(tmp_path_factory)


def _built(tmp_path_factory, *settings: str) -> Path:
    place = tmp_path_factory.mktemp("documentation") / "html"
    nowhere = dict.fromkeys(("http_proxy", "https_proxy", "HTTP_PROXY", "HTTPS_PROXY"), "http://127.0.0.1:9")
    variables = {**os.environ, **nowhere, "PYTHONPATH": str(ROOT), "JUPYTER_PLATFORM_DIRS": "1"}
    variables.setdefault("JAX_COMPILATION_CACHE_DIR", str(place.parent / "compiled"))  # two notebooks make the same fit
    variables.setdefault("JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS", "0.1")
    command = [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", *settings, "-b", "html", ROOT / "docs", place]
    done = subprocess.run(command, env=variables, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return place


class Page(HTMLParser):
    """What a page of the documentation refers to, and what can be referred to in it."""

    def __init__(self, path: Path):
        super().__init__()
        self.links: list[str] = []
        self.parts: list[str] = []
        self.names: set[str] = set()
        self.formulas = 0
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag, attrs):
        """Note what matters of a tag."""
        attributes = dict(attrs)
        self.names |= {name for name in (attributes.get("id"), attributes.get("name")) if name}
        if tag == "a" and attributes.get("href"):
            self.links.append(attributes["href"])
        elif tag != "a":
            self.parts += [attributes[name] for name in ("src", "href") if attributes.get(name)]
        self.formulas += tag == "math"


@pytest.fixture(scope="module")
def pages(built) -> dict[Path, Page]:
    """Every page by its file."""
    return {path: Page(path) for path in built.rglob("*.html")}


def test_every_link_inside_the_documentation_leads_to_a_page_and_to_a_place_on_it(pages):
    for path, page in pages.items():
        for link in page.links:
            target, _, place = unquote(link).partition("#")
            if "://" in link:
                continue
            file = (path.parent / target).resolve() if target else path
            assert file.exists(), f"{path.name}: {link}"
            assert not place or file not in pages or place in pages[file].names, f"{path.name}: {link}"


def test_links_to_the_network_are_well_formed_and_lead_to_known_sites(pages):
    links = {link for page in pages.values() for link in page.links if "://" in link}
    for link in links:
        parts = urlsplit(link)
        assert parts.scheme == "https" and parts.port is None and not parts.username, link
        assert re.fullmatch(r"(/[\w.~-]*)*", parts.path) and parts.path[-1:] != "." and not parts.query, link
    assert {link.rstrip("/") for link in links} == set(LINKS)
    for link, package in LINKS.items():
        named = metadata(package).get_all("Project-URL") if package else [f"address, {link}"]
        assert link in {item.partition(", ")[2].rstrip("/") for item in named}, link


def test_no_page_needs_a_network(pages):
    for path, page in pages.items():
        for part in page.parts:
            assert "//" not in part, f"{path.name} takes {part} from a network"
            assert part.startswith(("data:", "#")) or (path.parent / part.partition("?")[0]).exists(), f"{path.name}: {part}"


def test_formulas_are_shown_by_the_browser_itself(pages):
    theory = next(page for path, page in pages.items() if path.name == "theory.html")
    assert theory.formulas > 50


@pytest.mark.slow
def test_notebooks_say_something_in_every_output_and_never_too_much(built_anew):
    notebooks = sorted((built_anew.parent / "jupyter_execute").rglob("*.ipynb"))
    assert [path.stem for path in notebooks] == ["first-fit", "recordings-or-loops", "what-to-measure-next"]
    for path in notebooks:
        cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
        outputs = [output for cell in cells for output in cell.get("outputs", ())]
        assert len(outputs) > 3, path.stem
        for output in outputs:
            assert output["output_type"] != "error", output
            text = "".join(output.get("text", ()) or output.get("data", {}).get("text/plain", ()))
            assert 0 < len(text) <= MOST_TEXT, (path.stem, text)
