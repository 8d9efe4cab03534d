"""From a fit to what the figures of a pull-pull loop show: efficiency against bend, output against input, preload window.

Each class is one figure's part: which curves it needs of a draw, and what becomes of them once they are there for many.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import jax.numpy as jnp
import numpy as np
from jax import Array

from bowdenfit.physics.friction import transmission_efficiency
from bowdenfit.physics.loop import free_motion_loss, loop_band, loop_output_force, slack_load
from bowdenfit.questions.bends.answer import Elastic, friction_arm, some_of, typical_preload
from bowdenfit.questions.bends.equations import Bent
from bowdenfit.questions.bends.figure_data import BendingLoss, EfficiencyLine, LoopCurve, PreloadWindow
from bowdenfit.questions.recorded.loop_traces import LoopPoints, loop_points
from bowdenfit.results.record import Record

_QUANTILES = (0.05, 0.5, 0.95)
_POINTS = 61
_COARSE, _FINE = 25, 401  # friction against preload is smooth, the probability of slack is not
_MOST_LOOPS = 6
_COEFFICIENTS = (0.5, 1.0, 2.0)  # times the fitted coefficients
_PRELOADS = (0.0, 0.5, 1.0, 2.0)  # times the fitted preload

Values = Mapping[str, Array]
Curves = dict[str, Any]


def quantiles(draws: np.ndarray) -> np.ndarray:
    """5 %, 50 % and 95 % quantiles over the draws; the one line without draws."""
    return draws if len(draws) == 1 else np.quantile(draws, _QUANTILES, axis=0)


def median(draws: np.ndarray) -> np.ndarray:
    """Median over the draws."""
    return np.median(draws, axis=0)


@dataclass(frozen=True)
class BendingLossPart:
    """Efficiency against the wrap angle."""

    elastic: Elastic
    angles: np.ndarray

    @property
    def _preloads(self) -> np.ndarray:
        typical = typical_preload(self.elastic.fit)
        return np.unique([float(f"{typical * factor:.2g}") for factor in _PRELOADS])

    def curves(self, values: Values) -> Curves:
        """The curves of one draw."""
        bent, force = self.elastic.bent(self.angles), jnp.asarray(self.elastic.reference_force)
        exponent, (own, _) = bent.exponent(values), bent.preload(values)

        def efficiency(preload: Array, factor: Array | float = 1.0) -> Array:
            return loop_output_force(force, preload, factor * exponent, jnp.asarray(1.0)) / force

        return {
            "fitted": efficiency(own),
            "exponent": exponent,
            "coefficients": efficiency(own, jnp.asarray(_COEFFICIENTS)[:, None]),
            "preloads": efficiency(bent.preloads(values, jnp.asarray(self._preloads))),
        }

    def figure(self, draws: Curves) -> BendingLoss:
        """What the figure shows, from the curves of many draws."""
        exponent = median(draws["exponent"])
        coefficient = exponent[-1] / self.angles[-1]
        typical = typical_preload(self.elastic.fit)
        lines = zip(_COEFFICIENTS, np.swapaxes(draws["coefficients"], 0, 1), strict=True)
        bent = zip(self._preloads, np.swapaxes(draws["preloads"], 0, 1), strict=True)
        capstan = np.asarray(transmission_efficiency(jnp.asarray(exponent)))
        return BendingLoss(
            np.rad2deg(self.angles),
            self.elastic.reference_force,
            quantiles(draws["fitted"]),
            capstan,
            f"as fitted, preload {typical:.3g} N{_at_reference(self.elastic.fit)}",
            tuple(
                EfficiencyLine(f"coefficient {factor * coefficient:.2g}", median(line), capstan**factor)
                for factor, line in lines
            ),
            tuple(EfficiencyLine(f"preload {p:g} N", median(line), capstan) for p, line in bent),
        )


def _at_reference(fit: Record) -> str:
    """' at 0 deg' where preload depends on the wrap angle."""
    settings = fit.dataset.description.preload
    follows = fit.dataset.description.preload_follows_stretch
    return f" at {settings.wrap_angle.value:g} {settings.wrap_angle.unit}" if follows else ""


@dataclass(frozen=True)
class LoopsPart:
    """Output against input force at the wrap angles that the loop was moved at."""

    elastic: Elastic
    bends: np.ndarray

    @property
    def _angles(self) -> np.ndarray:
        """So many of the wrap angles, spread evenly."""
        moved = np.concatenate([self._points_angle, [p.wrap_angle for p in self._recorded]])
        angles = np.unique(np.round(moved, 9)) if len(moved) else self.bends
        return some_of(angles, _MOST_LOOPS)

    @property
    def _points_angle(self) -> np.ndarray:
        table = self.elastic.fit.dataset.measurements.loop
        if table is None:
            return np.zeros(0)
        column = self.elastic.fit.dataset.description.contact[self.elastic.contact].wrap_angle.column
        if column is None:
            return np.full(len(table.stroke), self.bends[0])
        return np.nan_to_num(table.own.column(column)[0])

    @cached_property
    def _recorded(self) -> tuple[LoopPoints, ...]:
        return loop_points(self.elastic.fit, self.elastic.contact)

    @property
    def _forces(self) -> np.ndarray:
        table = self.elastic.fit.dataset.measurements.loop
        read = [p.input_force for p in self._recorded] + ([table.input_force] if table is not None else [])
        forces = np.concatenate([np.zeros(1), *read]) if read else np.array([0.0, 2 * self.elastic.reference_force])
        return np.linspace(1.05 * forces.min(), 1.05 * forces.max(), _POINTS)

    def _points(self, angle: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Readings and recorded blocks at one wrap angle: input force, output force, stroke (0 of a recording)."""
        table = self.elastic.fit.dataset.measurements.loop
        blocks = [p for p in self._recorded if np.isclose(p.wrap_angle, angle)]
        parts = [(p.input_force, p.output_force, np.zeros(len(p.input_force), dtype=int)) for p in blocks]
        if table is not None:
            here = np.isclose(self._points_angle, angle)
            parts.append((table.input_force[here], table.output_force[here], table.stroke[here]))
        force_in, force_out, stroke = zip(*parts, strict=True) if parts else ((), (), ())
        nothing = np.zeros(0)
        joined = [np.concatenate([nothing, *part]) for part in (force_in, force_out, stroke)]
        return joined[0], joined[1], joined[2]

    def curves(self, values: Values) -> Curves:
        """The curves of one draw."""
        bent = self.elastic.bent(self._angles)
        exponent, (preload, _) = bent.exponent(values), bent.preload(values)
        force = jnp.broadcast_to(jnp.asarray(self._forces), (len(self._angles), _POINTS))
        forward, back = loop_band(force, preload[:, None], exponent[:, None])
        capstan = loop_band(force, jnp.zeros_like(exponent)[:, None], exponent[:, None])[0]
        return {"forward": forward, "back": back, "capstan": capstan, "slack": slack_load(preload, exponent)}

    def figure(self, draws: Curves) -> tuple[LoopCurve, ...]:
        """What the figure shows, from the curves of many draws."""
        found = []
        for i, angle in enumerate(self._angles):
            found.append(
                LoopCurve(
                    f"{np.rad2deg(angle):.4g} deg",
                    self._forces,
                    quantiles(draws["forward"][:, i]),
                    quantiles(draws["back"][:, i]),
                    median(draws["capstan"][:, i]),
                    quantiles(draws["slack"][:, i]),
                    *self._points(float(angle)),
                )
            )
        return tuple(found)


@dataclass(frozen=True)
class WindowPart:
    """What a preload costs and what it buys."""

    elastic: Elastic
    bends: tuple[float, float]

    @property
    def _preloads(self) -> np.ndarray:
        typical = typical_preload(self.elastic.fit)
        return np.linspace(0.0, max(2.5 * typical, 1.0), _COARSE)

    @property
    def _bent(self) -> Bent:
        return self.elastic.bent(np.linspace(*self.bends, _COARSE))

    def curves(self, values: Values) -> Curves:
        """The curves of one draw."""
        bent = self._bent
        friction = free_motion_loss(bent.preloads(values, jnp.asarray(self._preloads)), bent.exponent(values))
        lowest = bent.lowest_preload(values, self.elastic.window_force)
        return {"friction": jnp.max(friction, axis=-1), "lowest": lowest}

    def figure(self, draws: Curves) -> PreloadWindow:
        """What the figure shows, from the curves of many draws."""
        fit, coarse = self.elastic.fit, self._preloads
        preloads = np.linspace(coarse[0], coarse[-1], _FINE)
        friction = np.stack([np.interp(preloads, coarse, line) for line in quantiles(draws["friction"])])
        arm, unit = friction_arm(fit)
        taut = np.mean(draws["lowest"][:, None] <= preloads, axis=0)
        low, high = np.rad2deg(self.bends)
        return PreloadWindow(
            preloads,
            _at_reference(fit).strip(),
            arm * friction,
            unit,
            taut,
            np.quantile(draws["lowest"], _QUANTILES),
            (float(low), float(high)),
            self.elastic.window_force,
        )
