"""The figures of a calibration, in the order in which they are read."""

from pathlib import Path

from bowdenfit.questions.calibrate import coverage_figure, ranks_figure, sharpness_figure
from bowdenfit.questions.calibrate.answer import Calibration
from bowdenfit.questions.figure_files import AnswerFigure, write_figure


def figures_of_calibration(found: Calibration) -> dict[str, AnswerFigure]:
    """The figures that a calibration has something to show in, by their names."""
    if not found.quantities:
        return {}
    always: dict[str, AnswerFigure] = {"coverage": coverage_figure}
    if found.truths:  # ranks need not be uniform then, and there is no prior variance to compare with
        return always
    return always | {"ranks": ranks_figure, "sharpness": sharpness_figure}


def draw_calibration(found: Calibration, folder: Path) -> list[Path]:
    """Draw and write all figures of a calibration, and what each shows in words.

    Args:
        found: The calibration.
        folder: Where the files go; made if it is missing.
    """
    drawn = figures_of_calibration(found).items()
    return [path for name, figure in drawn for path in write_figure(figure, found, folder, name, found.name)]
