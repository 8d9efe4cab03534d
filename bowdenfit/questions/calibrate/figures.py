"""The figures of a calibration, in the order in which they are read."""

from pathlib import Path

from bowdenfit.questions.calibrate import coverage_figure, ranks_figure, sharpness_figure
from bowdenfit.questions.calibrate.answer import Calibration
from bowdenfit.questions.figure_files import AnswerFigure, write_figure


def select_figures(calibration: Calibration) -> dict[str, AnswerFigure]:
    """The figures that a calibration has something to show in, by their names."""
    if not calibration.quantities:
        return {}
    always: dict[str, AnswerFigure] = {"coverage": coverage_figure}
    if calibration.truths:  # ranks need not be uniform then, and there is no prior variance to compare with
        return always
    return always | {"ranks": ranks_figure, "sharpness": sharpness_figure}


def draw_calibration(calibration: Calibration, folder: Path) -> list[Path]:
    """Draw and write all figures of a calibration, and what each shows in words.

    Args:
        calibration: The calibration.
        folder: Where the files go; made if it is missing.
    """
    figures = select_figures(calibration).items()
    return [path for name, figure in figures for path in write_figure(figure, calibration, folder, name, calibration.name)]
