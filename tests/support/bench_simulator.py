"""Twelve simulated laboratories, unlike each other and ours: what each measures, what is true there, what goes wrong.

A rope is moved around its bends in small steps, dF/dphi = -s mu(F) (F + D), and nothing here is shared with the likelihood.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from hand_bench import BENDS, Readings, write

STEPS = 40  # of a rope around its bends
LIMIT = 5  # deg, below which no angle is read
REFERENCE = 'reference_force = {{ value = {:g}, unit = "N" }}\n'
HUNG = "\n[sensors]\ninput_force_noise = 0\n"
LENGTHS, MOUNTED = np.linspace(430.0, 550.0, 25), np.repeat(np.linspace(440.0, 540.0, 6), 3)
ROUTE = """
schema = 1
name = "bench"
[route]
variable = "cable_length"
unit = "mm"
range = [430, 550]
[[contact]]
name = "free sheath"
friction = "mu1"
wrap_angle = { curve = "gaussian", column = "free_angle" }
[[contact]]
name = "squeezed sheath"
friction = "mu2"
wrap_angle = { curve = "gaussian", column = "squeezed_angle" }
[tables]
angles = { file = "angles.csv", detection_limit = { value = 5, unit = "deg" } }
forces = { file = "forces.csv" }
"""
LOGISTIC = {"settings": ["contact.0.wrap_angle.curve=logistic"]}
Angles = Callable[[np.ndarray], np.ndarray]
BELLS: tuple[Angles, Angles] = (
    lambda length: 80 * np.exp(-(((length - 580) / 70) ** 2)),
    lambda length: 70 * np.exp(-(((length - 400) / 70) ** 2)),
)
PLATEAU: tuple[Angles, Angles] = (lambda length: 80 / (1 + np.exp(-(length - 470) / 5)), BELLS[1])


@dataclass(frozen=True)
class Rope:
    """What is true of a rope and its friction.

    Args:
        mu: Coefficient of each contact.
        exponent: p in mu (F/reference)^-p.
        reference: Force at which the coefficients hold [N].
        drag: Hidden tension [N].
        asymmetry: By how much more friction there is pulling than returning, over the mean.
        drift: By how much friction rises while a run is measured, over the mean.
        scatter: Standard deviation of the exponent from mounting to mounting.
    """

    mu: tuple[float, ...] = (0.12,)
    exponent: float = 0.0
    reference: float = 60.0
    drag: float = 0.0
    asymmetry: float = 0.0
    drift: float = 0.0
    scatter: float = 0.02

    def output(self, force: np.ndarray, loss: np.ndarray, stroke: np.ndarray) -> np.ndarray:
        """Force behind the bends [N], by the midpoint rule."""
        step, out = -stroke * loss * (1 + self.asymmetry * stroke / 2) / STEPS, force.astype(float)
        for _ in range(STEPS):
            middle = out + step / 2 * self._rubbing(out)
            out = out + step * self._rubbing(middle)
        return out

    def _rubbing(self, force: np.ndarray) -> np.ndarray:
        return (force / self.reference) ** -self.exponent * (force + self.drag)


@dataclass(frozen=True)
class Laboratory:
    """A laboratory that measures forces at both ends of a rope.

    Args:
        rope: What is true of it.
        loads: Input forces [N].
        noise: Standard deviation of a reading of the input and of the output [N].
        places: Wrap angle [deg] of each mounting, or its length [mm] where there are `angles`.
        angles: Of each contact [deg] at lengths; none where the bend is known.
        labels: Of the mountings; numbered if omitted.
        strokes: +1 pulling, -1 returning.
        repeats: Readings of each load.
        spoil: What happens to the table.
        models: How it may be fitted: keywords of `bowdenfit.fit` by name.
        right: Name of the model that describes it; empty where none may be trusted.
        alike: Models that a session may not tell from it.
        cause: What is said of the others, or of the table: words of which one must be there.
    """

    rope: Rope
    loads: Sequence[float]
    noise: tuple[float, float]
    places: Sequence[float] = (180.0,) * 3
    angles: tuple[Angles, ...] = ()
    labels: Sequence[str] = ()
    strokes: Sequence[int] = (1, -1)
    repeats: int = 4
    spoil: Callable[[Readings, np.random.Generator], Readings] = lambda rows, generator: rows
    models: Mapping[str, Mapping[str, Any]] = field(
        default_factory=lambda: {"capstan": {}, "drag": {"friction": "drag"}}
    )
    right: str = "capstan"
    alike: tuple[str, ...] = ()
    cause: tuple[str, ...] = ()

    @property
    def truth(self) -> dict[str, float]:
        """Of the parameters of friction, and the best length [mm] where there is a route."""
        names = ["mu1", "mu2"] if self.angles else ["mu"]
        truths = dict(zip(names, self.rope.mu, strict=True))
        more = {"drag": self.rope.drag, "load_exponent": self.rope.exponent, "stroke_difference": self.rope.asymmetry}
        best = {}
        if self.angles:
            along = np.linspace(LENGTHS[0], LENGTHS[-1], 100_001)
            best = {"best length": float(along[np.argmin(self._loss(along))])}
        return truths | {name: value for name, value in more.items() if value} | best

    def _loss(self, places: np.ndarray) -> np.ndarray:
        bends = [angle(places) for angle in self.angles] or [places]
        return np.sum([mu * np.deg2rad(bend) for mu, bend in zip(self.rope.mu, bends, strict=True)], axis=0)

    def write(self, folder: Path, seed: int) -> Path:
        """A folder with the tables of one session in this laboratory."""
        generator, places = np.random.default_rng(seed), np.asarray(self.places, dtype=float)
        loss = self._loss(places) + self.rope.scatter * generator.standard_normal(len(places))
        run_rows = np.array([(s, load) for s in self.strokes for load in self.loads for _ in range(self.repeats)])
        plan = np.concatenate([generator.permutation(run_rows) if self.rope.drift else run_rows for _ in places])
        run = np.repeat(np.arange(len(places)), len(run_rows))
        stroke, load = plan.T
        later = np.tile(np.linspace(-0.5, 0.5, len(run_rows)), len(places))
        out = self.rope.output(load, loss[run] * (1 + self.rope.drift * later), stroke)
        read = [f + sd * generator.standard_normal(len(f)) for f, sd in zip((load, out), self.noise, strict=True)]
        names = np.array(list(self.labels) or [str(i + 1) for i in range(len(places))])
        rows = self.spoil(Readings(names[run], places[run], stroke, *read), generator)
        more = "" if self.noise[0] else HUNG
        if not self.angles:
            return write(folder, rows, REFERENCE.format(self.rope.reference) + BENDS, "wrap_angle_deg", more)
        self._write_angles(write(folder, rows, ROUTE, "cable_length_mm", more), generator)
        return folder

    def _write_angles(self, folder: Path, generator: np.random.Generator) -> None:
        read = [angle(LENGTHS) + generator.standard_normal(len(LENGTHS)) for angle in self.angles]
        cells = [[f"{angle:.2f}" if angle >= LIMIT else f"<{LIMIT}" for angle in angles] for angles in read]
        lines = [f"{length:g},{first},{other}" for length, first, other in zip(LENGTHS, *cells, strict=True)]
        (folder / "angles.csv").write_text(
            "\n".join(["cable_length_mm,free_angle_deg,squeezed_angle_deg", *lines]) + "\n"
        )


def _dead(rows: Readings, generator: np.random.Generator) -> Readings:
    """The cell at the output shows a force that was on it once."""
    return replace(rows, force_out=12.0 + 0.3 * generator.standard_normal(len(rows.force_out)))


def _position(rows: Readings, generator: np.random.Generator) -> Readings:
    """The output is where the slide stood [mm], which goes to and fro whatever the load."""
    return replace(rows, force_out=40 + 30 * np.sin(np.arange(len(rows.force_out)) / 3) + generator.uniform(0, 5))


USUAL = (20.0, 40.0, 60.0, 80.0, 100.0, 120.0)
LOADS = {"drag": {"friction": "drag"}, "load-dependent": {"friction": "load-dependent"}}
STROKES = {"stroke-dependent": {"friction": "stroke-dependent"}}
CAPSTAN: dict[str, dict[str, Any]] = {"capstan": {}}
LABORATORIES = {
    "threads on weights of 0.5 to 3 N": Laboratory(Rope((0.15,)), (0.5, 1, 2, 3), (0.0, 0.01)),
    "a winch of 20 kN, mounted once": Laboratory(Rope(scatter=0.01), (5e3, 1e4, 1.5e4, 2e4), (40.0, 40.0), (180.0,)),
    "brake cables mounted 20 times": Laboratory(Rope(), USUAL, (0.4, 0.4), (90.0, 180.0, 270.0, 360.0) * 5, repeats=1),
    "a tube with drag": Laboratory(
        Rope(drag=3.5), USUAL, (0.4, 0.4), models=CAPSTAN | LOADS, right="drag", alike=("load-dependent",),
        cause=("--friction drag",),
    ),
    "a dry liner, less rough under load": Laboratory(
        Rope((0.15,), exponent=0.3), USUAL, (0.0, 0.3), models=CAPSTAN | LOADS, right="load-dependent",
        cause=("--friction load-dependent",),
    ),
    "a laid rope that rubs more one way": Laboratory(
        Rope(asymmetry=0.2), USUAL, (0.4, 0.4), models=CAPSTAN | STROKES, right="stroke-dependent",
        cause=("--friction stroke-dependent",),
    ),
    "a bench that warms up": Laboratory(
        Rope(drift=0.3), USUAL, (0.4, 0.4), models=CAPSTAN, right="", cause=("drifted",)
    ),
    "a dead cell": Laboratory(
        Rope(), USUAL, (0.4, 0.4), spoil=_dead, models=CAPSTAN, right="", cause=("does not follow",)
    ),
    "swapped cells": Laboratory(
        Rope(), USUAL, (0.4, 0.4), strokes=(1,), spoil=lambda rows, _: rows.swapped(), models=CAPSTAN, right="",
        cause=("swapped",),
    ),
    "a position taken for a force": Laboratory(
        Rope(), USUAL, (0.4, 0.4), strokes=(1,), spoil=_position, models=CAPSTAN, right="", cause=("no force",)
    ),
    "mountings labeled 1, 2, 3 at each length": Laboratory(
        Rope((0.1, 0.2)), (30.0, 60.0, 90.0), (0.3, 0.3), MOUNTED, BELLS, ("1", "2", "3") * 6,
    ),
    "a route that is no bell": Laboratory(
        Rope((0.2, 0.1)), (30.0, 60.0, 90.0), (0.3, 0.3), MOUNTED, PLATEAU, models={"gaussian": {}, "logistic": LOGISTIC},
        right="logistic", cause=("contact.0.wrap_angle.curve=logistic",),
    ),
}  # fmt: skip
