"""A pooled fleet as a page: the answer, the population, every cable, and what is not told."""

from bowdenfit.pages.section import HtmlPage, PageTable, Picture, prose_section
from bowdenfit.questions.pool.answer import Pool
from bowdenfit.questions.pool.figures import HEADINGS, captions
from bowdenfit.questions.pool.words import (
    cable_rows,
    effect_sentences,
    headline,
    how_to_read,
    life_sentences,
    next_sentences,
    outlier_sentences,
    population_rows,
    trust_sentences,
)


def pool_page(pool: Pool) -> HtmlPage:
    """The page of a pooled fleet.

    Args:
        found: The pooled fleet.
    """
    texts = captions(pool)
    pictures = {name: Picture(name, heading, texts[name]) for name, heading in HEADINGS.items()}
    heads, rows = population_rows(pool)
    cable_heads, cables = cable_rows(pool)
    left_out = [f"{inspection.inspection}: {inspection.why}." for inspection in pool.left_out]
    sections = (
        prose_section(
            "The answer",
            [*trust_sentences(pool), *life_sentences(pool), *outlier_sentences(pool), *next_sentences(pool)],
            headline=headline(pool),
            pictures=(pictures["pooled-life"], pictures["pooled-wear"]),
        ),
        prose_section(
            "What cables have in common",
            [*effect_sentences(pool), how_to_read(pool)],
            [PageTable(heads, tuple(rows))],
        ),
        prose_section(
            "Every cable",
            [
                "Drawn toward the others as far as its own inspections leave it open, or by its own inspections alone if it is "
                "unlike the rest; median ± standard deviation."
            ],
            [PageTable(cable_heads, tuple(cables))],
            pictures=(pictures["pooled-coefficients"],),
        ),
        prose_section("What is not told", pool.notes or ["Everything that was measured is pooled."], items=left_out),
    )
    return HtmlPage(pool.name or "Fleet", f"Pooled by bowdenfit; seed {pool.seed}", sections)
