"""Sentences of pages that tell numbers of the published on-body fit, and of fits beside it: what they must say now."""

import json
import re
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[2]
PUBLISHED = ROOT / "fits" / "published" / "on-body-exoskeleton"
STORY, TRUST = ROOT / "fits" / "on-body-exoskeleton" / "README.md", ROOT / "docs" / "trust.md"
PLACES = {"mu1": "free sheath", "mu2": "squeezed sheath", "mu3": "bracket edge"}


def sentences() -> Iterator[tuple[Path, str]]:
    """Each page with a sentence that must stand in it."""
    quoted = json.loads((PUBLISHED / "quoted.json").read_text(encoding="utf-8"))
    summary = json.loads((PUBLISHED / "summary.json").read_text(encoding="utf-8"))
    details = one_line((PUBLISHED / "details.txt").read_text(encoding="utf-8"))
    parameters, best = summary["parameters"], summary["optimal"]["length"]
    span = {name: f"{parameters[name]['q05']:.3f} to {parameters[name]['q95']:.3f}" for name in PLACES}
    for name, place in PLACES.items():
        yield STORY, f"| {place} | {name} = {parameters[name]['median']:.3f} | {span[name]} |"
    low, middle, high = (f"{best[key]:.0f}" for key in ("q05", "median", "q95"))
    yield STORY, f"The best length is {middle} mm (90 % interval {low} to {high} mm)"
    yield STORY, f"one curve gives {low} to {high} mm"
    yield STORY, f"the best length over {interval(quoted['published_length'])} (90 % interval)"
    yield STORY, f"The best length would stay: {quoted['without_length'].partition(';')[0]})"
    yield STORY, f"the answer is the same: {quoted['student_length'].partition(';')[0]})"
    for start in ("These measurements determine", "efficiency at 550 mm: measured", "Interval widths depend on the prior"):
        yield STORY, sentence(details, start)
    for name in ("mu1", "mu3"):
        yield STORY, f"{name} {'would be known ' if name == 'mu1' else ''}to {quoted[f'without_{name}']}"
    yield STORY, f"Least squares alone would have claimed {' and '.join(least_squares(details))}"
    yield STORY, f"profile interval for mu1, which takes that into account, is {profile(quoted['least_squares'], 'mu1')}"
    yield STORY, quoted["compared"].partition(" Prefer")[0]
    for target in ("length", "mu3"):
        yield STORY, sentence(one_line(quoted[f"next_{target}"]), "Measure the efficiency", "from ± ")
    yield TRUST, f"{dashed(quoted['plain_mu3'])} to {dashed(quoted['mistaken_mu3'])} and ends with exit code 3"
    yield TRUST, f"with Student noise it is {dashed(quoted['mistaken_student_mu3'])}"
    yield TRUST, re.findall(r"from (± [\d.]+ mm to ± [\d.]+ mm)", one_line(quoted["next_length"]))[0]


def missing() -> list[str]:
    """What does not stand where it should."""
    pages = {page: one_line(page.read_text(encoding="utf-8").replace("\n> ", "\n")) for page in (STORY, TRUST)}
    return [f"{page.relative_to(ROOT)} should say: {message}" for page, message in sentences() if message not in pages[page]]


def one_line(text: str) -> str:
    """A text without its line breaks."""
    return " ".join(text.split())


def sentence(text: str, start: str, through: str = "") -> str:
    """From a beginning to the next full stop, behind certain words."""
    tail = text[text.index(start) :]
    return tail[: tail.index(". ", tail.index(through)) + 1]


def interval(message: str) -> str:
    """The interval in "471 mm (450 to 478 mm; ± 12.2 mm)"."""
    return message.partition("(")[2].partition(";")[0]


def dashed(span: str) -> str:
    """An interval as docs/trust.md writes it."""
    return span.replace(" to ", "-")


def least_squares(details: str) -> list[str]:
    """The three coefficients with their standard errors, the first two joined."""
    row = r"\b{} [\d.]+ [\d.]+ to [\d.]+ [\d.]+ ± [\d.]+ ([\d.]+) ± ([\d.]+) "
    matches = [re.findall(row.format(name), details)[0] for name in PLACES]
    intervals = [f"{float(value):.3f} +- {float(error):.3f}" for value, error in matches]
    return [", ".join(intervals[:2]), intervals[2]]


def profile(text: str, name: str) -> str:
    """An interval in the table of a summary."""
    return re.findall(rf"^{name} +[\d.]+ +([\d.]+ to [\d.]+)", text, re.MULTILINE)[0]
