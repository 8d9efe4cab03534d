"""Fleets as draws of single fits, from known truth, without a fit: log coefficients with heavy-tailed errors."""

import json
from dataclasses import dataclass

import numpy as np

from bowdenfit.addons.fleet.folder import FleetDraws

PRIOR = json.dumps({"kind": "LogNormal", "median": 0.12, "log_sd": 0.7})
REFERENCE = 50_000.0


@dataclass(frozen=True)
class Truth:
    """What a fleet is made from; wear in `REFERENCE` cycles."""

    mean: tuple[float, ...] = (np.log(0.1), np.log(0.15))
    spread: float = 0.2
    wear: float = 0.2
    wear_spread: float = 0.08
    lubrication: float = -0.2
    error: float = 0.03
    freedom: float = 5.0


def fleet_draws(
    seed: int, cables: int = 12, cycles: tuple[float, ...] = (0.0, 25_000.0, 50_000.0), truth: Truth = Truth(),
    shifts: dict[int, float] | None = None, wears: dict[int, float] | None = None, draws: int = 1024,
) -> tuple[FleetDraws, np.ndarray]:  # fmt: skip
    """Draws, and the truth of each cable: log coefficients when new and dry, and wear.

    Args:
        seed: Random seed.
        cables, cycles: How many, and when each is inspected.
        truth: Of the population.
        shifts: Added to all log coefficients of some cables.
        wears: Added to the wear of some.
        draws: Of each inspection.
    """
    generator, count = np.random.default_rng(seed), len(truth.mean)
    start = np.array(truth.mean) + truth.spread * generator.standard_normal((cables, count))
    wear = truth.wear + truth.wear_spread * generator.standard_normal(cables)
    for i, shift in (shifts or {}).items():
        start[i] += shift
    for i, more in (wears or {}).items():
        wear[i] += more
    oiled = (generator.uniform(size=(cables, len(cycles))) < 0.5).astype(float)
    true = start[:, None] + (wear[:, None] * np.array(cycles) / REFERENCE + truth.lubrication * oiled)[..., None]
    error = truth.error * np.arange(1, count + 1)

    def heavy(shape: tuple[int, ...]) -> np.ndarray:
        chi = np.sqrt(truth.freedom / generator.chisquare(truth.freedom, (*shape[:-1], 1)))
        return error * chi * generator.standard_normal(shape)

    seen = true + heavy(true.shape)
    logs = (seen[:, :, None] + heavy((*seen.shape[:2], draws, count))).reshape(-1, draws, count)
    names = [f"cable-{i + 1:02d}" for i in range(cables)]
    labels = tuple(f"{name} after {c:g} cycles" for name in names for c in cycles)
    total = len(labels)
    values = {f"mu_{k}": np.exp(logs[:, :, k]) for k in range(count)}
    about = {"units": "1", "symbol": "$\\mu$", "role": "friction", "prior": PRIOR}
    stats = {"shape": np.array(["one"] * total, dtype=object), "trusted": np.ones(total, dtype="int8")}
    fleet = FleetDraws(
        labels, tuple(np.repeat(names, len(cycles))), np.tile(np.array(cycles), cables), np.full(total, 20.0), oiled.ravel(),
        values, stats, dict.fromkeys(values, about), {"name": "made", "seed": 1},
    )  # fmt: skip
    return fleet, np.concatenate([start, wear[:, None]], axis=1)
