"""A notebook beside a data set: fit it, look at the answer, say what to measure next."""

import json
from pathlib import Path

from bowdenfit.dataset import DESCRIPTION_FILE
from bowdenfit.description.file import read_toml

NOTEBOOK = "first-fit.ipynb"
_FORMAT = {"nbformat": 4, "nbformat_minor": 5}  # of Jupyter
_KERNEL = {"kernelspec": {"name": "python3", "display_name": "Python 3", "language": "python"}}
_CODE, _TEXT = "code", "markdown"
_BEGIN = (
    (_TEXT, "# {name}\n\nThis notebook is in the folder of a data set, next to its `cable.toml`; start Jupyter there."),
    (_CODE, 'import bowdenfit as bf\n\nfit = bf.fit(".", seed=1)\nfit'),
    (_TEXT, "Whether these numbers can be trusted, and why, is said first; here for programs:"),
    (_CODE, "fit.verdict()"),
    (_TEXT, "## Friction coefficients\n\nMedians with 90 % intervals, next to least squares, and the draws behind them:"),
    (_CODE, "fit.to_frame()"),
    (_CODE, "fit.plot.coefficients()"),
)
_OF_ROUTE = (
    (_TEXT, "## Which length?"),
    (_CODE, "fit.optimal_length()"),
    (_CODE, "fit.plot.efficiency()"),
)
_END = (
    (_TEXT, "## Do the readings agree with the model, and with each other?"),
    (_CODE, "fit.checks"),
    (_TEXT, "## What to measure next?"),
    (_CODE, "bf.next_measurement(fit)"),
    (_TEXT, 'Keep it with `fit.save("results")`. The figures of this fit are listed by `dir(fit.plot)`.'),
)


def write_notebook(folder: Path) -> None:
    """Write a notebook into the folder of a data set.

    Args:
        folder: Folder with a cable.toml.
    """
    _, page = read_toml(folder / DESCRIPTION_FILE, ())
    cells = [*_BEGIN, *(_OF_ROUTE if "route" in page else ()), *_END]
    written = [_make_cell(number, kind, text.replace("{name}", str(page["name"]))) for number, (kind, text) in enumerate(cells)]
    notebook = {"cells": written, "metadata": _KERNEL, **_FORMAT}
    (folder / NOTEBOOK).write_text(json.dumps(notebook, indent=1) + "\n", encoding="utf-8")


def _make_cell(number: int, kind: str, text: str) -> dict[str, object]:
    """Return a cell as the format of notebooks has it."""
    outputs: dict[str, object] = {"execution_count": None, "outputs": []} if kind == _CODE else {}
    return {"cell_type": kind, "id": f"cell-{number}", "metadata": {}, "source": text, **outputs}
