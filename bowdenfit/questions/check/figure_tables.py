"""From the checks of a fit to what their figure shows."""

import numpy as np

from bowdenfit.inference.psis import RELIABLE_K
from bowdenfit.kinds import readings_called
from bowdenfit.questions.check.answer import Checks, TableChecks
from bowdenfit.questions.check.figure_data import CheckedTable

_SHOWN = 2  # places that deviations are shown against


def checked_tables(found: Checks | None) -> tuple[CheckedTable, ...]:
    """What the figure of the checks shows; empty without draws."""
    if found is None:
        return ()
    outliers = {(table.table, i) for table, i in found.outliers}
    return tuple(
        _checked(table, [(table.table, i) in outliers for i in range(len(table.labels))]) for table in found.tables
    )


def _checked(table: TableChecks, outlier: list[bool]) -> CheckedTable:
    judged, nothing = table.uniformity, np.zeros(0)
    at, off, low, high = nothing, nothing, nothing, nothing
    if judged is not None:
        at = judged.at
        off, low, high = (part - at for part in (judged.share, judged.low, judged.high))
    return CheckedTable(
        readings_called(table.table).words,
        table.z_score,
        dict(list(table.places.numbers.items())[:_SHOWN]),
        table.places.group,
        table.places.back,
        ~(table.predicted.pareto_k <= RELIABLE_K),
        np.array(outlier),
        table.labels,
        at,
        off,
        low,
        high,
        judged.probability if judged is not None else float("nan"),
    )
