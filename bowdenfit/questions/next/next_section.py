"""What to measure next, ranked, in the report."""

from bowdenfit.pages.section import Section, Table, prose
from bowdenfit.questions.next.answer import NextMeasurement
from bowdenfit.questions.next.words import HOW_TO_READ, ranking_sentences, ranking_table

TITLE = "What to measure next"
_TOP = 10


def ranking_section(found: NextMeasurement) -> Section:
    """The advice, and the best candidates in a table."""
    heads, rows = ranking_table(found, _TOP)
    return prose(TITLE, ranking_sentences(found), [Table(tuple(heads), tuple(map(tuple, rows)), HOW_TO_READ)])
