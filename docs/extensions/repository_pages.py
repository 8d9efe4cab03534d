"""Pages that stand elsewhere in the repository, and links among them: each page reads as well there as here.

A page of `PAGES` is empty in docs/ and takes its text from the file that it names. Links from any page to such a file lead to
the page, links to other files of the repository are taken from where they lie.
"""

import os
import re
from pathlib import Path

from sphinx.application import Sphinx

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
PAGES = {
    "changelog": "CHANGELOG.md",
    "evidence/verdicts": "fits/README.md",
    "evidence/on-body": "fits/on-body-exoskeleton/README.md",
    "evidence/calibration": "fits/calibration/README.md",
    "evidence/published": "fits/published/README.md",
}
_LINK = re.compile(r"(\]\()([^)\s:#]+)((?:#[^)\s]*)?\))")


def text_of(_: Sphinx, name: str, source: list[str]) -> None:
    """The text of a page, with links that lead somewhere from here."""
    here = ROOT / PAGES[name] if name in PAGES else DOCS / f"{name}.md"
    if name in PAGES:
        source[0] = here.read_text(encoding="utf-8")
    page = (DOCS / name).parent

    def link(match: re.Match[str]) -> str:
        target = (here.parent / match[2]).resolve()
        known = next((DOCS / f"{page}.md" for page, file in PAGES.items() if (ROOT / file) == target), target)
        return f"{match[1]}{Path(os.path.relpath(known, page)).as_posix()}{match[3]}"

    source[0] = _LINK.sub(link, source[0])


def setup(app: Sphinx) -> dict[str, bool]:
    """Take part whenever a page is read."""
    app.connect("source-read", text_of)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
