"""How the readings of each table scatter about a fit, by what makes them scatter."""

from collections.abc import Mapping, Sequence

import numpy as np

from bowdenfit.models.build import Term

_FREEDOM = 0.5  # degrees of freedom below which the scatter of a table cannot be estimated


def scatter_about(
    terms: Sequence[Term], residuals: Mapping[str, np.ndarray], leverage: np.ndarray
) -> tuple[np.ndarray, dict[str, float]]:
    """Scatter of the standardized residuals about the fit: for each residual, and by table (of its first block).

    A block whose residuals are all used up by parameters has no scatter of its own; its weight stands.
    """
    scale, by_table, start = np.ones(len(leverage)), {}, 0
    for term in terms:
        spreads, first = [], start
        for count, independent in term.residual_blocks:
            rows, values = slice(start, start + count), residuals[term.name][start - first : start - first + count]
            freedom = min(int(np.count_nonzero(values)), independent) - float(leverage[rows].sum())
            spread = float(np.sqrt(np.sum(values**2) / freedom)) if freedom > _FREEDOM else float("nan")
            scale[rows] = spread if np.isfinite(spread) else 1.0
            spreads.append(spread)
            start = rows.stop
        by_table[term.name] = spreads[0]
    return scale, by_table
