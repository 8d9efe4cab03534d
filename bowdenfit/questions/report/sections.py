"""The sections of a fit's report, in their order: each is a file of its question, and a line here."""

from typing import Any

from bowdenfit.pages.section import Page
from bowdenfit.questions.bends import bends_section
from bowdenfit.questions.loss import loss_section
from bowdenfit.questions.next.answer import NextMeasurement
from bowdenfit.questions.next.next_section import ranking_section
from bowdenfit.questions.report.figures_section import figures_section
from bowdenfit.questions.summary import (
    answer_section,
    checks_section,
    coefficients_section,
    measured_section,
    methods_section,
    next_section,
    provenance_section,
)
from bowdenfit.results.record import Record

ABOVE_FIGURES = (answer_section, measured_section, coefficients_section, loss_section, bends_section)
BELOW_FIGURES = (methods_section, provenance_section)


def report_page(fit: Record, figures: dict[str, Any], ranking: NextMeasurement | None = None) -> Page:
    """The report of a fit.

    Args:
        fit: The fit.
        figures: Data of the figures that are on it, by name.
        ranking: What to measure next; a sentence says how to ask if omitted.
    """
    above, below = ([file.section(fit) for file in files] for files in (ABOVE_FIGURES, BELOW_FIGURES))
    following = next_section.section(fit) if ranking is None else ranking_section(ranking)
    sections = [*above, figures_section(figures), checks_section.section(fit), following, *below]
    when = f", {fit.provenance.created[:10]}" if fit.provenance.created else ""
    subtitle = f"Report of a fit by bowdenfit {fit.provenance.versions.get('bowdenfit', '')}{when}"
    return Page(fit.name, subtitle, tuple(section for section in sections if section is not None))
