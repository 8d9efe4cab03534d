"""Pages whose text lies elsewhere in the repository, and the links among them, which work in both places.

A page of `PAGES` is empty in docs/ and takes its text from the file named there. Links from any page to such a file are
redirected to the page; links to other files of the repository are resolved relative to the file that contains them.
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
    """Replace the source of a page by its text, with links that are valid in the documentation."""
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
    """Register the function that reads pages with Sphinx."""
    app.connect("source-read", text_of)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
