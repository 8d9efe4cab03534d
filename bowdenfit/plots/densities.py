"""Smooth densities of draws, from fine histograms.

`kde` of arviz_stats gives the same curves, but takes 2 s to import where a figure alone takes less, and refuses draws outside
its grid.
"""

import numpy as np

GRID_POINTS = 160
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
