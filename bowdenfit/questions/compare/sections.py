"""A comparison as a page: which fit predicts best, how well each does, and what changes between them."""

from bowdenfit.pages.section import HtmlPage, PageTable, Picture, make_meanings_table, prose_section
from bowdenfit.questions.compare.answer import Comparison
from bowdenfit.questions.compare.comparison_figure import HEADING, caption
from bowdenfit.questions.compare.words import (
    HOW_WELL,
    WHAT_CHANGES,
    basis_sentences,
    influential_text,
    parameter_table,
    score_table,
    speed_sentences,
    verdict_sentences,
)
from bowdenfit.words import listed


def comparison_page(comparison: Comparison) -> HtmlPage:
    """The page of a comparison.

    Args:
        comparison: The comparison.
    """
    heads, rows = score_table(comparison)
    first, *others = verdict_sentences(comparison)
    names, values = parameter_table(comparison)
    meanings = {name: parameter.meaning for name, parameter in comparison.parameters.items()}
    sections = (
        prose_section("The answer", others, headline=first),
        prose_section(
            "How well each predicts",
            basis_sentences(comparison),
            [PageTable(heads, tuple(rows), HOW_WELL, left=(0, 1))],
            folded=[("Influential readings", influential_text(comparison))],
            pictures=(Picture("comparison", HEADING, caption(comparison)),),
        ),
        prose_section(
            "What changes",
            speed_sentences(comparison),
            [PageTable(names, tuple(values), WHAT_CHANGES)],
            folded=[("What the names stand for", make_meanings_table(meanings))],
        ),
    )
    return HtmlPage(listed(list(comparison.differences)), "Comparison by bowdenfit", sections)
