"""What the compared programs share: the on-body tables read plainly, the effective sample size, and the report.

Nothing here uses bowdenfit: the plain programs are what a user would write who has the model and no package for it.
"""

import csv
import json
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

DATASET = Path(__file__).resolve().parents[2] / "datasets" / "on-body-exoskeleton"
MIDDLE, HALF_WIDTH = 480.0, 50.0  # of the 430 to 530 mm that the curves hold over
LIMIT = np.deg2rad(10.0)  # angles below it were too small to detect
EDGE = np.deg2rad(45.0)  # wrap angle of the bracket edge
CURVES = ("free_sheath_angle_deg", "squeezed_sheath_angle_deg")
NAMES = ("mu1", "mu2", "mu3", *(f"{c[:-4]}_{x}" for c in CURVES for x in "abc"), "sigma_theta", "tau")
TARGET = 1000  # effective draws of every parameter

FRICTION = (np.log(0.12), 1.4)
LEVEL_SD, SLOPE_SD = 1.5, 6.0  # the root of the curvature is half-Cauchy about 1
ANGLE_NOISE, SCATTER = np.deg2rad(3.0), 0.025  # medians of half-Cauchys


def tables() -> dict:
    """Detected and undetected angles of both curves, and the four efficiencies; angles in rad, lengths as z."""
    angles, efficiencies = (_rows(DATASET / name) for name in ("angles.csv", "efficiencies.csv"))
    data: dict = {"curves": [_curve(angles, column) for column in CURVES]}
    length = np.array([float(row["cable_length_mm"]) for row in efficiencies])
    data["z"] = (length - MIDDLE) / HALF_WIDTH
    data["own"] = length > MIDDLE + HALF_WIDTH  # a row past the curves has the angles measured there
    measured = {float(row["cable_length_mm"]): row for row in angles}
    data["angles"] = np.array(
        [[np.deg2rad(float(measured[x][c])) if x > MIDDLE + HALF_WIDTH else 0.0 for c in CURVES] for x in length]
    )
    data["loss"] = -np.log([float(row["efficiency_percent"]) / 100 for row in efficiencies])
    return data


def _rows(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8") as file:
        return list(csv.DictReader(line for line in file if not line.startswith("#")))


def _curve(rows: list[dict[str, str]], column: str) -> dict:
    within = [row for row in rows if abs(float(row["cable_length_mm"]) - MIDDLE) <= HALF_WIDTH]
    z = np.array([(float(row["cable_length_mm"]) - MIDDLE) / HALF_WIDTH for row in within])
    seen = np.array([not row[column].startswith("<") for row in within])
    angle = np.deg2rad([float(row[column]) for row in within if not row[column].startswith("<")])
    return {"z": z[seen], "angle": angle, "z_undetected": z[~seen], "level": np.log(np.median(angle))}


def smallest_ess(draws: np.ndarray) -> float:
    """Bulk effective sample size of the worst parameter.

    Args:
        draws: (chain, draw, parameter).
    """
    from arviz_stats.base import array_stats

    sizes = [array_stats.ess(draws[..., i], method="bulk", chain_axis=0, draw_axis=1) for i in range(draws.shape[-1])]
    return float(min(sizes))


def report(run: Callable[[int], np.ndarray]) -> None:
    """Run a sampler twice, first cold and then with everything imported and compiled, and print what came out.

    The seed is the first argument of the command line.

    Args:
        run: From a seed to draws (chain, draw, parameter) with at least `TARGET` effective ones.
    """
    seed = int(sys.argv[1])
    draws = run(seed)
    ready_at = time.monotonic()
    start = time.perf_counter()
    again = run(seed + 1000)
    show(ready_at, draws, time.perf_counter() - start, again)


def show(ready_at: float, draws: np.ndarray, sampling_seconds: float, again: np.ndarray) -> None:
    """Print one line of JSON for scripts/benchmark_fit.py.

    Args:
        ready_at: When the draws were there, on the clock that all processes of the machine share.
        draws: Draws (chain, draw, parameter).
        sampling_seconds: Seconds that sampling took with everything compiled.
        again: The draws of those seconds.
    """
    mu = np.concatenate([draws[..., :3].reshape(-1, 3), again[..., :3].reshape(-1, 3)])
    page = {
        "ready_at": ready_at,
        "ess": smallest_ess(draws),
        "draws_per_second": smallest_ess(again) / sampling_seconds,
        "mean": mu.mean(axis=0).tolist(),
        "sd": mu.std(axis=0).tolist(),
    }
    print(json.dumps(page))
