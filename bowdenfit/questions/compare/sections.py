"""A comparison as a page: which fit predicts best, how well each does, and what changes between them."""

from bowdenfit.pages.section import HtmlPage, PageTable, Picture, make_meanings_table, prose_section
from bowdenfit.questions.compare.answer import Comparison
from bowdenfit.questions.compare.comparison_figure import HEADING, caption
from bowdenfit.questions.compare.words import (
    HOW_WELL,
    WHAT_CHANGES,
    basis_sentences,
    parameter_cells,
    scores,
    speed_sentences,
    treated_text,
    verdict_sentences,
)
from bowdenfit.words import listed


def comparison_page(found: Comparison) -> HtmlPage:
    """The page of a comparison.

    Args:
        found: The comparison.
    """
    heads, rows = scores(found)
    first, *others = verdict_sentences(found)
    names, values = parameter_cells(found)
    sections = (
        prose_section("The answer", others, headline=first),
        prose_section(
            "How well each predicts",
            basis_sentences(found),
            [PageTable(heads, tuple(rows), HOW_WELL, left=(0, 1))],
            folded=[("Readings on which a fit leans", treated_text(found))],
            pictures=(Picture("comparison", HEADING, caption(found)),),
        ),
        prose_section(
            "What changes",
            speed_sentences(found),
            [PageTable(names, tuple(values), WHAT_CHANGES)],
            folded=[("What the names stand for", make_meanings_table({n: row.meaning for n, row in found.parameters.items()}))],
        ),
    )
    return HtmlPage(listed(list(found.differences)), "Comparison by bowdenfit", sections)
