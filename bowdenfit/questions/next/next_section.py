"""What to measure next, ranked, in the report."""

from bowdenfit.pages.section import PageSection, PageTable, prose_section
from bowdenfit.questions.next.answer import NextMeasurement
from bowdenfit.questions.next.words import HOW_TO_READ, ranking_sentences, ranking_table

TITLE = "What to measure next"
_MAX_ROWS = 10


def ranking_section(ranking: NextMeasurement) -> PageSection:
    """The advice, and the best candidates in a table."""
    heads, rows = ranking_table(ranking, _MAX_ROWS)
    return prose_section(TITLE, ranking_sentences(ranking), [PageTable(tuple(heads), tuple(map(tuple, rows)), HOW_TO_READ)])
