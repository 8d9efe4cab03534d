"""Stretch, preload and loops in the report."""

from bowdenfit.pages.section import Section, Table, prose
from bowdenfit.questions.bends.overview import elastic_overview
from bowdenfit.questions.bends.words import HEADING, elastic_tables
from bowdenfit.results.record import Record


def section(fit: Record) -> Section | None:
    """The answers at wrap angles; None of a cable that has none."""
    overview = elastic_overview(fit)
    if overview is None:
        return None
    tables = [Table(*cells, HEADING) for cells in elastic_tables(overview)]
    return prose("Stretch and preload", overview.sentences, tables)
