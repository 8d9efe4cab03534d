"""The page about the checks of a fit in `summary.json`; people's version is made from the same numbers."""

from dataclasses import asdict
from typing import Any

import numpy as np

from bowdenfit.questions.check.answer import FALSE_ALARM, Checks, TableChecks, diagnosis


def checks_page(found: Checks | None) -> dict[str, Any]:
    """Every reading beside its prediction from the others, and what follows; empty without draws.

    Args:
        found: The checks.
    """
    if found is None:
        return {}
    outliers, decisive = ({(t.table, i) for t, i in part} for part in (found.outliers, found.decisive))
    readings = [
        _reading(t, i) | {"outlier": (t.table, i) in outliers, "decisive": (t.table, i) in decisive}
        for t in found.tables
        for i in range(len(t.labels))
    ]
    return {
        "false_alarm": FALSE_ALARM,
        "tables": [_table(t) for t in found.tables],
        "readings": readings,
        "trends": [asdict(trend) for trend in found.trends],
        "sensitivities": [asdict(s) | {"diagnosis": diagnosis(s)} for s in found.sensitivities],
    }


def _reading(table: TableChecks, i: int) -> dict[str, Any]:
    predicted, bound = table.predicted, bool(table.at_most[i])
    return {
        "table": table.table,
        "label": table.labels[i],
        "unit": table.unit,
        "at_most" if bound else "measured": table.reading[i],
        "expected": predicted.median[i],
        "sd": predicted.sd[i],
        "q05": predicted.q05[i],
        "q95": predicted.q95[i],
        "z": table.z_score[i],
        "probability": table.probability[i],
        "chance": table.chance[i],
        "pareto_k": predicted.pareto_k[i],
        "inside": bool(table.places.inside[i]),
    }


def _table(table: TableChecks) -> dict[str, Any]:
    """How many readings of a table there are, how many their 90 % intervals hold, and whether they scatter as predicted."""
    numbers = ~table.at_most
    inside = (table.predicted.q05 <= table.reading) & (table.reading <= table.predicted.q95)
    judged = table.uniformity
    return {
        "table": table.table,
        "readings": int(numbers.sum()),
        "in_interval": int(np.sum(inside & numbers)),
        "bounds": int(table.at_most.sum()),
        "uniform": None if judged is None else judged.holds,
        "fault": "" if judged is None else judged.fault,
    }
