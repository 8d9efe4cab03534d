"""A calibration as a page: whether intervals keep their word, quantity by quantity, and what was left out."""

from bowdenfit.pages.section import Page, Picture, Table, prose
from bowdenfit.questions.calibrate.answer import Calibration
from bowdenfit.questions.calibrate.words import (
    HEADS,
    account_sentences,
    how_to_read,
    rows,
    verdict_sentences,
    what_was_done,
)

PICTURES = (
    Picture(
        "coverage",
        "How often intervals hold the truth",
        "Share of the 50 % and 90 % intervals of each quantity that held the true value (dots), and what chance allows (gray).",
    ),
    Picture(
        "ranks",
        "Where truths lie within what the fits say",
        "Share of the truths below each level, less what even ones would be; gray: what chance leaves in 99 % of calibrations. "
        "A hump, then a dip is of intervals too wide, the reverse of intervals too narrow.",
        folded=True,
    ),
    Picture(
        "sharpness",
        "Bias, and what the measurements tell",
        "Left: estimate less truth, with three standard errors. Right: how much of what was open beforehand the measurements "
        "settle.",
        folded=True,
    ),
)


def calibration_page(found: Calibration) -> Page:
    """The page of a calibration.

    Args:
        found: The calibration.
    """
    first, *others = verdict_sentences(found)
    table = [Table(HEADS, tuple(rows(found)))] if found.quantities else []
    sections = (
        prose("The answer", [*others, what_was_done(found)], headline=first),
        prose("Quantity by quantity", [how_to_read(found)] if table else [], table, pictures=PICTURES),
        prose("What was left out", account_sentences(found)),
    )
    return Page(found.name, "Calibration by bowdenfit", sections)
