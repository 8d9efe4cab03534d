"""What the compared programs share: the on-body tables read plainly.

Nothing here uses bowdenfit: the plain programs are what a user would write who has the model and no package for it.
"""

import csv
from pathlib import Path

import numpy as np

DATASET = Path(__file__).resolve().parents[2] / "datasets" / "on-body-exoskeleton"
MIDDLE, HALF_WIDTH = 480.0, 50.0  # of the 430 to 530 mm that the curves hold over
LIMIT = np.deg2rad(10.0)  # angles below it were too small to detect
EDGE = np.deg2rad(45.0)  # wrap angle of the bracket edge
CURVES = ("free_sheath_angle_deg", "squeezed_sheath_angle_deg")
NAMES = ("mu1", "mu2", "mu3", *(f"{c[:-4]}_{x}" for c in CURVES for x in "abc"), "sigma_theta", "tau")

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

