"""Looking at the priors of a data set before it is fitted."""

from pathlib import Path
from typing import TYPE_CHECKING

from bowdenfit.dataset import Dataset

if TYPE_CHECKING:
    from bowdenfit.questions.check.figure_data import PriorPredictive

FIGURE = "prior_predictive"


def show_priors(dataset: Dataset, folder: str | Path, seed: int = 0) -> "PriorPredictive":
    """Draw what the priors alone hold possible beside what was measured, PNG and SVG; fit nothing.

    Args:
        dataset: The data set.
        folder: Where the figure goes; made if missing.
        seed: Seed of the draws from the priors.

    Returns:
        What the figure shows.

    Raises:
        StoreError: The folder cannot be written.
    """
    import jax

    from bowdenfit.plots.write import FORMATS, write
    from bowdenfit.questions.check.prior_figure import prior_predictive as drawn
    from bowdenfit.questions.check.prior_predictive import prior_predictive
    from bowdenfit.results.folder import made

    with jax.enable_x64(True):
        found = prior_predictive(dataset, seed)
    figure = drawn(found)
    with made(Path(folder)) as place:
        for ending in FORMATS:
            write(figure, place / f"{FIGURE}.{ending}")
    return found
