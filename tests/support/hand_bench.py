"""A bench in a few lines of NumPy that shares no code with the likelihood: forces at both ends of ropes that slide."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np


@dataclass(frozen=True)
class Readings:
    """Rows of a force table: label of the run, length [mm] or wrap angle [deg], stroke, forces [N]."""

    label: np.ndarray
    place: np.ndarray
    stroke: np.ndarray
    force_in: np.ndarray
    force_out: np.ndarray

    def swapped(self, rows: np.ndarray | slice = slice(None)) -> "Readings":
        """With input and output exchanged in some rows."""
        force_in, force_out = self.force_in.copy(), self.force_out.copy()
        force_in[rows], force_out[rows] = self.force_out[rows], self.force_in[rows]
        return replace(self, force_in=force_in, force_out=force_out)


def pull(
    generator: np.random.Generator,
    places: Sequence[float],
    loss: Sequence[float],
    loads: Sequence[float],
    *,
    labels: Sequence[str] | None = None,
    strokes: Sequence[int] = (1, -1),
    repeats: int = 1,
    noise: tuple[float, float] = (0.0, 0.0),
    drag: float = 0.0,
    offset: tuple[float, float] = (0.0, 0.0),
    scatter: float = 0.0,
) -> Readings:
    """One mounting at each place: the output is (input + drag) exp(-stroke loss) - drag, and each cell adds its error.

    Args:
        generator: Source of the noise.
        places: Length or wrap angle of each mounting.
        loss: Friction exponent of each.
        loads: True input forces [N].
        labels: Label of each; numbered if omitted.
        strokes: +1 pulling, -1 returning.
        repeats: Readings of each load.
        noise: Standard deviation of a reading at the input and at the output [N].
        drag: Hidden tension [N].
        offset: What each cell shows of no force [N].
        scatter: Standard deviation of the exponent from mounting to mounting, none of which has less than no friction.
    """
    run, stroke, load, _ = (
        axis.ravel() for axis in np.meshgrid(np.arange(len(places)), strokes, loads, np.arange(repeats), indexing="ij")
    )
    exponent = np.maximum(np.asarray(loss) + scatter * generator.standard_normal(len(places)), 0.0)[run]
    out = (load + drag) * np.exp(-stroke * exponent) - drag
    names = np.array(labels if labels is not None else [str(i + 1) for i in range(len(places))])
    read_in, read_out = (
        force + zero + sd * generator.standard_normal(len(load))
        for force, zero, sd in zip((load.astype(float), out), offset, noise, strict=True)
    )
    return Readings(names[run], np.asarray(places, dtype=float)[run], stroke, read_in, read_out)


STROKES = {1: "pull", -1: "return"}
BENDS = """
schema = 1
name = "bench"
[[contact]]
name = "sheath"
friction = "mu"
wrap_angle = { column = "wrap_angle", nominal = { value = 180, unit = "deg" } }
[tables]
forces = { file = "forces.csv" }
"""

LENGTHS = """
schema = 1
name = "bench"
[route]
variable = "cable_length"
unit = "mm"
range = [440, 540]
[[contact]]
name = "sheath"
friction = "mu"
wrap_angle = { curve = "gaussian", column = "sheath_angle" }
[tables]
angles = { file = "angles.csv" }
forces = { file = "forces.csv" }
"""


def write(
    folder: Path, rows: Readings, description: str = BENDS, place: str = "wrap_angle_deg", more: str = ""
) -> Path:
    """A data set's folder: its forces, and what is said of the cable."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "cable.toml").write_text(description + more)
    lines = [
        f"{label},{place:.6g},{STROKES[int(stroke)]},{force_in:.8g},{force_out:.8g}"
        for label, place, stroke, force_in, force_out in zip(
            rows.label, rows.place, rows.stroke, rows.force_in, rows.force_out, strict=True
        )
    ]
    head = f"run,{place},stroke,input_force_N,output_force_N"
    (folder / "forces.csv").write_text("\n".join([head, *lines]) + "\n")
    return folder
