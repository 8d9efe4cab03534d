"""What to measure next, in the report."""

from bowdenfit.pages.section import Section, prose
from bowdenfit.questions.summary.trust_words import next_step
from bowdenfit.questions.summary.verdict import verdict
from bowdenfit.results.record import Record


def section(fit: Record) -> Section | None:
    """The next step with a fit that may be trusted; of another the reasons say it."""
    said = next_step(fit) if verdict(fit).trusted else ""
    said = said.removeprefix("Next: ")
    return prose("What to measure next", [said[0].upper() + said[1:]]) if said else None
