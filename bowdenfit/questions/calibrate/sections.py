"""A calibration as a page: whether intervals keep their word, quantity by quantity, and what was left out."""

from bowdenfit.pages.section import HtmlPage, PageTable, Picture, make_meanings_table, prose_section
from bowdenfit.questions.calibrate.answer import Calibration
from bowdenfit.questions.calibrate.figures import figures_of_calibration
from bowdenfit.questions.calibrate.words import (
    EVIDENCE_HEADS,
    HEADS,
    account_sentences,
    evidence_rows,
    how_to_read,
    how_to_read_evidence,
    rows,
    verdict_sentences,
    what_was_done,
)

FOLDED = ("ranks", "sharpness")


def calibration_page(found: Calibration) -> HtmlPage:
    """The page of a calibration.

    Args:
        found: The calibration.
    """
    first, *others = verdict_sentences(found)
    table = [PageTable(HEADS, tuple(rows(found)))] if found.quantities else []
    evidence = PageTable(EVIDENCE_HEADS, tuple(evidence_rows(found)), how_to_read_evidence(found))
    names = make_meanings_table({quantity.name: quantity.meaning for quantity in found.quantities})
    sections = (
        prose_section("The answer", [*others, what_was_done(found)], headline=first),
        prose_section(
            "Quantity by quantity", [how_to_read(found)] if table else [], table,
            folded=[("What the names stand for", names), ("What the verdict on each rests on", evidence)],
            pictures=_pictures(found),
        ),
        prose_section("What was left out", account_sentences(found)),
    )  # fmt: skip
    return HtmlPage(found.name, "Calibration by bowdenfit", sections)


def _pictures(found: Calibration) -> tuple[Picture, ...]:
    """The figures with their captions, those for statisticians folded."""
    figures = figures_of_calibration(found).items()
    return tuple(Picture(name, figure.HEADING, figure.caption(found), folded=name in FOLDED) for name, figure in figures)
