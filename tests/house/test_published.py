"""What README.md shows is what the published fit printed (`scripts/publish.py` replaces both), and its links lead somewhere."""

import re
import tomllib
from pathlib import Path

import pytest
import quoted_sentences

from bowdenfit.cli import bowdenfit as program

ROOT = Path(__file__).parents[2]
REFERENCE = {"index", "api", "commands", "changelog"}  # which the guides lead to
README = (ROOT / "README.md").read_text(encoding="utf-8")


def test_the_readme_shows_what_the_first_fit_prints():
    (shown,) = re.findall(r"\$ bowdenfit fit on-body-exoskeleton\n(.*?)```\n", README, re.DOTALL)
    assert shown == (ROOT / "fits" / "published" / "on-body-exoskeleton" / "summary.txt").read_text(encoding="utf-8")


def test_what_pages_tell_in_sentences_is_what_fits_say():
    assert quoted_sentences.missing() == []
    assert len(list(quoted_sentences.sentences())) > 20


def test_the_readme_is_short_and_its_links_and_those_of_the_guides_lead_somewhere():
    assert len(README.splitlines()) <= 120
    for page in (ROOT / "README.md", *(ROOT / "docs").glob("*.md")):
        for target in re.findall(r"\]\(([^)#:]+)\)", page.read_text(encoding="utf-8")):
            assert (page.parent / target).exists(), f"{page.name}: {target}"


@pytest.mark.parametrize("source", [None, "https://example.org/cables/bowdenfit/"])
def test_a_package_index_gets_no_link_or_image_that_is_dead_there(source, monkeypatch):
    monkeypatch.syspath_prepend(ROOT / "scripts")
    from index_page import IndexPage

    metadata = {"urls": {"Source": source}} if source else {}
    IndexPage(str(ROOT), {}).update(metadata)
    page = metadata["readme"]["text"]
    targets = re.findall(r"\]\(([^)]*)\)", page)
    files = {file for file in re.findall(r"\]\(([^)]*)\)", README) if "://" not in file}
    assert all(target.startswith("https://") for target in targets) and all(file in page for file in files)
    assert page.count("![") == (2 if source else 0)
    if source:
        assert f"{source}raw/HEAD/fits/published/on-body-exoskeleton/figures/efficiency.png" in targets
        assert [target for target in targets if "//" in target.removeprefix("https://")] == []


def test_the_readme_has_a_line_for_every_verb():
    table = README.split("## All verbs")[1].split("\n## ")[0]
    named = {name for row in table.splitlines() if row.startswith("| `") for name in re.findall(r"`(\w+)`", row.split("|")[1])}
    assert named == {name for name in program if not name.startswith("-")}


def test_every_guide_can_be_reached_from_the_readme_and_from_the_first_page():
    first = (ROOT / "docs" / "index.md").read_text(encoding="utf-8")
    for page in (ROOT / "docs").glob("*.md"):
        assert page.stem == "index" or page.stem in first, page.name
        assert page.stem in REFERENCE or f"docs/{page.name}" in README, page.name


def test_the_citation_is_of_this_version_and_license():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    lines = (ROOT / "CITATION.cff").read_text(encoding="utf-8").splitlines()
    assert f"version: {project['version']}" in lines
    assert f"license: {project['license']}" in lines
