"""What to do next, in the report where nothing was ranked."""

from bowdenfit.pages.section import Section, prose
from bowdenfit.questions.next.next_section import TITLE
from bowdenfit.questions.summary.trust_words import next_step
from bowdenfit.questions.summary.verdict import verdict
from bowdenfit.results.record import Record


def section(fit: Record) -> Section | None:
    """The next step with a fit that may be trusted; of another the reasons say it."""
    said = next_step(fit) if verdict(fit).trusted else ""
    return prose(TITLE, [said]) if said else None
