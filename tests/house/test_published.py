"""What README.md shows is what the published fit printed (`scripts/publish.py` replaces both), and its links lead somewhere."""

import re
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def test_the_readme_shows_what_the_first_fit_prints():
    (shown,) = re.findall(r"\$ bowdenfit fit on-body-exoskeleton\n(.*?)```\n", README, re.DOTALL)
    assert shown == (ROOT / "fits" / "published" / "on-body-exoskeleton" / "summary.txt").read_text(encoding="utf-8")


def test_the_readme_is_short_and_its_links_and_those_of_the_guides_lead_somewhere():
    assert len(README.splitlines()) <= 150
    for page in (ROOT / "README.md", *(ROOT / "docs").glob("*.md")):
        for target in re.findall(r"\]\(([^)#:]+)\)", page.read_text(encoding="utf-8")):
            assert (page.parent / target).exists(), f"{page.name}: {target}"


def test_the_citation_is_of_this_version_and_license():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    said = (ROOT / "CITATION.cff").read_text(encoding="utf-8").splitlines()
    assert f"version: {project['version']}" in said
    assert f"license: {project['license']}" in said
