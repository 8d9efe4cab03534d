"""Tendons in sheaths on the computer, by a method that shares nothing with the package: friction at every place of a rope.

The rope is cut into many short pieces. Friction lets the logarithm of the tension differ between the motor and a piece by at
most the friction exponent of the sheath between the two; inside that a piece keeps the tension it had. The force at the motor
that gives a displacement is found by bisection, and the motor moves in small steps.
"""

from dataclasses import dataclass

import numpy as np

PIECES = 400


@dataclass(frozen=True)
class Catheter:
    """A rope in its sheath: friction exponent, stiffness of the spring (inf of a stop) and of the rope [N/mm]."""

    exponent: float
    spring: float
    rope: float
    zero: float = 0.0

    def pulled(self, displacements, steps=8, start=None):
        """Force at the motor [N] at each displacement [mm], coming from `start` (or the first of them), from a slack rope."""
        places = (np.arange(PIECES) + 0.5) / PIECES
        band = np.append(self.exponent * places, self.exponent)  # the last is the far end
        held, forces, last = np.full(PIECES + 1, -40.0), [], self.zero if start is None else start
        for displacement in displacements:
            for x in np.linspace(last, displacement, steps + 1)[1:]:
                log_force = self._log_force(x, held, band)
                held = np.clip(held, log_force - band, log_force + band)
            last = displacement
            forces.append(np.exp(log_force))
        return np.array(forces)

    def _log_force(self, x, held, band):
        low, high = -40.0, 25.0
        for _ in range(60):
            middle = (low + high) / 2
            tension = np.exp(np.clip(held, middle - band, middle + band))
            stretch = tension[-1] / self.spring + tension[:-1].mean() / self.rope
            low, high = (middle, high) if stretch < x - self.zero else (low, middle)
        return (low + high) / 2


def cycles(low, high, n, times=1):
    """Displacements up and down again, n readings a stroke."""
    up = np.linspace(low, high, n)
    return np.concatenate([np.concatenate([up, up[-2:0:-1]]) for _ in range(times)] + [[low]])


TRUTH = {"mu": 0.11, "end_spring": 0.6, "rope_stiffness": 9.0, "force_noise_N": 0.05, "displacement_noise_mm": 0.005}
BENDS = {180: 0.4, 360: 0.9, 540: 1.5}  # wrap angle [deg], and displacement at which the tip begins to feel force [mm]


def bench(seed: int) -> str:
    """The table of datasets/synthetic-catheter: a loop and a half at each of three bends, read in order."""
    generator, rows = np.random.default_rng(seed), ["wrap_angle_deg,displacement_mm,force_N"]
    motion = np.append(cycles(2.0, 24.0, 17), np.linspace(2.0, 24.0, 17)[1:])
    for bend, zero in BENDS.items():
        catheter = Catheter(TRUTH["mu"] * np.deg2rad(bend), TRUTH["end_spring"], TRUTH["rope_stiffness"], zero)
        force = catheter.pulled(motion) + TRUTH["force_noise_N"] * generator.standard_normal(len(motion))
        displacement = motion + TRUTH["displacement_noise_mm"] * generator.standard_normal(len(motion))
        rows += [f"{bend},{x:.3f},{f:.3f}" for x, f in zip(displacement, force, strict=True)]
    return "\n".join(rows) + "\n"
