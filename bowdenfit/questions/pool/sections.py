"""A pooled fleet as a page: the answer, the population, every cable, and what is not told."""

from bowdenfit.pages.section import Page, Picture, Table, prose
from bowdenfit.questions.pool.answer import Pool
from bowdenfit.questions.pool.figures import HEADINGS, captions
from bowdenfit.questions.pool.words import (
    cable_rows,
    effect_sentences,
    headline,
    how_to_read,
    life_sentences,
    next_sentences,
    population_rows,
    trust_sentences,
    unlike_sentences,
)


def pool_page(found: Pool) -> Page:
    """The page of a pooled fleet.

    Args:
        found: The pooled fleet.
    """
    said = captions(found)
    pictures = {name: Picture(name, heading, said[name]) for name, heading in HEADINGS.items()}
    heads, rows = population_rows(found)
    cable_heads, cables = cable_rows(found)
    left_out = [f"{each.inspection}: {each.why}." for each in found.left_out]
    sections = (
        prose(
            "The answer",
            [*trust_sentences(found), *life_sentences(found), *unlike_sentences(found), *next_sentences(found)],
            headline=headline(found),
            pictures=(pictures["pooled-life"], pictures["pooled-wear"]),
        ),
        prose("What cables have in common", [*effect_sentences(found), how_to_read(found)], [Table(heads, tuple(rows))]),
        prose(
            "Every cable",
            [
                "Drawn toward the others as far as its own inspections leave it open, or by its own inspections alone if it is "
                "unlike the rest; median ± standard deviation."
            ],
            [Table(cable_heads, tuple(cables))],
            pictures=(pictures["pooled-coefficients"],),
        ),
        prose("What is not told", found.notes or ["Everything that was measured is pooled."], items=left_out),
    )
    return Page(found.name or "Fleet", f"Pooled by bowdenfit; seed {found.seed}", sections)
