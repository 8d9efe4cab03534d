"""How the readings of each table scatter about a fit, by what makes them scatter."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from bowdenfit.kinds.term import Term

_FREEDOM = 0.5  # degrees of freedom below which the scatter of a table cannot be estimated
_DECIDES = 1e-6  # leverage from which a residual is that of a reading


def scatter_about(
    terms: Sequence[Term], residuals: Mapping[str, np.ndarray], leverage: np.ndarray
) -> tuple[np.ndarray, dict[str, float]]:
    """Scatter of the standardized residuals about the fit: for each residual, and by table (of its first block).

    A block whose residuals are all used up by parameters has no scatter of its own; its weight stands.
    """
    scale = np.ones(len(leverage))
    by_table: dict[str, float] = {}
    for name, rows, values, freedom in _blocks(terms, residuals, leverage):
        spread = float(np.sqrt(np.sum(values**2) / freedom)) if freedom > _FREEDOM else float("nan")
        scale[rows] = spread if np.isfinite(spread) else 1.0
        by_table.setdefault(name, spread)
    return scale, by_table


def freedom_by_block(
    terms: Sequence[Term], residuals: Mapping[str, np.ndarray], leverage: np.ndarray
) -> tuple[list[slice], np.ndarray]:
    """Rows of each block, and the degrees of freedom of its scatter; infinite where its weight stands."""
    blocks = [(rows, freedom) for _, rows, _, freedom in _blocks(terms, residuals, leverage)]
    return [rows for rows, _ in blocks], np.array([f if f > _FREEDOM else np.inf for _, f in blocks])


def _blocks(
    terms: Sequence[Term], residuals: Mapping[str, np.ndarray], leverage: np.ndarray
) -> Iterator[tuple[str, slice, np.ndarray, float]]:
    """Table, rows, residuals and degrees of freedom of every block of residuals that scatter alike."""
    start = 0
    for term in terms:
        first = start
        for count, independent in term.residual_blocks:
            rows, values = slice(start, start + count), residuals[term.name][start - first : start - first + count]
            # A reading that parameters of its own fit exactly is one whatever rounding leaves; a bound that is met is none.
            read = int(np.count_nonzero((values != 0) | (leverage[rows] > _DECIDES)))
            yield term.name, rows, values, min(read, independent) - float(leverage[rows].sum())
            start = rows.stop
