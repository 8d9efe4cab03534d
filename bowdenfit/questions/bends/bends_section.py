"""Stretch, preload and loops in the report."""

from bowdenfit.pages.section import PageSection, PageTable, prose_section
from bowdenfit.questions.bends.overview import elastic_overview
from bowdenfit.questions.bends.words import HEADING, elastic_tables
from bowdenfit.results.record import Record


def section(fit: Record) -> PageSection | None:
    """The answers at wrap angles; None of a cable that has none."""
    overview = elastic_overview(fit)
    if overview is None:
        return None
    tables = [PageTable(*cells, HEADING) for cells in elastic_tables(overview)]
    return prose_section("Stretch and preload", overview.sentences, tables)
