"""A calibration as a page: whether intervals keep their word, quantity by quantity, and what was left out."""

from bowdenfit.pages.section import HtmlPage, PageTable, Picture, make_meanings_table, prose_section
from bowdenfit.questions.calibrate.answer import Calibration
from bowdenfit.questions.calibrate.figures import select_figures
from bowdenfit.questions.calibrate.words import (
    EVIDENCE_HEADS,
    HEADS,
    describe_procedure,
    evidence_note,
    evidence_rows,
    omission_sentences,
    quantity_note,
    quantity_rows,
    verdict_sentences,
)

FOLDED = ("ranks", "sharpness")


def calibration_page(calibration: Calibration) -> HtmlPage:
    """The page of a calibration.

    Args:
        calibration: The calibration.
    """
    first, *others = verdict_sentences(calibration)
    table = [PageTable(HEADS, tuple(quantity_rows(calibration)))] if calibration.quantities else []
    evidence = PageTable(EVIDENCE_HEADS, tuple(evidence_rows(calibration)), evidence_note(calibration))
    names = make_meanings_table({quantity.name: quantity.meaning for quantity in calibration.quantities})
    sections = (
        prose_section("The answer", [*others, describe_procedure(calibration)], headline=first),
        prose_section(
            "Quantity by quantity", [quantity_note(calibration)] if table else [], table,
            folded=[("What the names stand for", names), ("What the verdict on each rests on", evidence)],
            pictures=_pictures(calibration),
        ),
        prose_section("What was left out", omission_sentences(calibration)),
    )  # fmt: skip
    return HtmlPage(calibration.name, "Calibration by bowdenfit", sections)


def _pictures(calibration: Calibration) -> tuple[Picture, ...]:
    """The figures with their captions, those for statisticians folded."""
    figures = select_figures(calibration).items()
    return tuple(Picture(name, figure.HEADING, figure.caption(calibration), folded=name in FOLDED) for name, figure in figures)
