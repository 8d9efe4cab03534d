"""Smooth densities of draws, in one dimension and in two, from fine histograms.

scipy.stats would do the same, but takes longer to import than all the figures take to draw.
"""

import numpy as np

GRID_POINTS = 160
BINS = 44  # each way, in two dimensions
ENOUGH = 40_000  # draws, beyond which more do not change a picture


def thin_draws(draws: np.ndarray) -> np.ndarray:
    """All draws in one row, or every so many where there are more than enough."""
    return np.ravel(draws)[:: -(-np.size(draws) // ENOUGH)]


def limits(draws: np.ndarray, share: float = 0.996) -> tuple[float, float]:
    """An axis that shows the given share of the draws with a little room; never below zero where no draw is.

    Draws that are all the same get some width all the same.
    """
    low, high = (float(q) for q in np.quantile(draws, (0.5 - share / 2, 0.5 + share / 2)))
    room = 0.08 * (high - low) or 0.05 * abs(high) or 0.5
    return (max(low - room, 0.0) if np.min(draws) >= 0 else low - room), high + room


def support(*samples: np.ndarray) -> float:
    """Zero where no draw is below it, the usual bound of a positive quantity; otherwise minus infinity."""
    return 0.0 if all(np.min(sample) >= 0 for sample in samples) else -np.inf


def density(draws: np.ndarray, grid: np.ndarray, lower: float = -np.inf, upper: float = np.inf) -> np.ndarray:
    """Kernel density of the draws at the points of an even grid.

    A Gaussian is folded over a histogram whose bins are the grid's; draws near a bound are
    mirrored at it, so that a density that does not vanish there is not smoothed away.

    Args:
        draws: Of any shape.
        grid: Equally spaced points.
        lower, upper: Bounds of the quantity.

    Returns:
        Density, per unit of the draws; zero outside the bounds.
    """
    draws, step = thin_draws(draws), float(grid[1] - grid[0])
    width = bandwidth(draws, step)
    near = int(np.ceil(4 * width / step))
    everything = np.concatenate([draws, *(2 * bound - draws for bound in (lower, upper) if np.isfinite(bound))])
    edges = grid[0] + step * (np.arange(-near, len(grid) + near + 1) - 0.5)
    counts, _ = np.histogram(everything, edges)
    kernel = np.exp(-0.5 * (step / width * np.arange(-near, near + 1)) ** 2)
    smooth = np.convolve(counts, kernel / kernel.sum(), mode="valid") / (len(draws) * step)
    return np.where((grid >= lower) & (grid <= upper), smooth, 0.0)


def bandwidth(draws: np.ndarray, least: float) -> float:
    """Silverman's rule of thumb, a third wider as draws of a chain repeat each other, but no less than a given width."""
    low, high = np.quantile(draws, (0.25, 0.75))
    spread = min((s for s in (float(np.std(draws)), float(high - low) / 1.34) if s > 0), default=0.0)
    return max(1.2 * spread * len(draws) ** -0.2, least)


def bin_numbers(draws: np.ndarray, shown: tuple[float, float]) -> np.ndarray:
    """The bin of each draw on an axis with `BINS` of them; -1 where it lies off the axis."""
    draws, (low, high) = thin_draws(draws), shown
    position = np.minimum((draws - low) / (high - low) * BINS, BINS - 1)
    return np.where((draws >= low) & (draws <= high), position, -1).astype(int)


def enclosed_share(columns: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Share of the draws that lie in denser places than each cell of a two-dimensional histogram.

    Its contour at 0.68 encloses 68 % of the draws in the smallest area.

    Args:
        columns, rows: Bins of the draws, from `bin_numbers`.

    Returns:
        Shares, rows first.
    """
    on_axes = (columns >= 0) & (rows >= 0)
    counts = np.bincount(rows[on_axes] * BINS + columns[on_axes], minlength=BINS**2).reshape(BINS, BINS)
    smooth = _blur(rows) @ counts @ _blur(columns).T
    order = np.argsort(smooth, axis=None)[::-1]
    share = np.empty(BINS**2)
    share[order] = np.cumsum(smooth.ravel()[order]) / smooth.sum()
    return share.reshape(BINS, BINS)


def _blur(numbers: np.ndarray) -> np.ndarray:
    """Matrix that smooths along one axis; what would leave the axis is mirrored back."""
    width = max(1.5 * float(np.std(numbers)) * len(numbers) ** (-1 / 6), 0.6)
    here, there = np.arange(BINS)[:, None], np.arange(BINS)[None]
    images = (there, -1 - there, 2 * BINS - 1 - there)
    kernel = sum(np.exp(-0.5 * ((here - image) / width) ** 2) for image in images)
    return np.asarray(kernel / kernel.sum(axis=0))
