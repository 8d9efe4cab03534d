"""From a fit to what its figures of stretch, preload and loops show.

Each figure has a part here: which curves it needs of a draw, and what becomes of them once they are there for many. The
curves of all parts are computed by one program.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from bowdenfit.errors import UsageError
from bowdenfit.measurements.tables import StretchTable
from bowdenfit.physics.friction import transmission_efficiency
from bowdenfit.physics.loop import free_motion_loss, loop_band, loop_output_force, slack_load
from bowdenfit.predictions.draws import BATCH, for_each_draw
from bowdenfit.predictions.elastic import Bent, knows_preload
from bowdenfit.results.elastic import Elastic, has_elastic_answers, preload_draws
from bowdenfit.results.elastic_figure_data import (
    BendingLoss,
    EfficiencyLine,
    ElasticFigures,
    LoopCurve,
    PreloadCurve,
    PreloadWindow,
    StretchCurve,
)
from bowdenfit.results.fit import Fit

_QUANTILES = (0.05, 0.5, 0.95)
_POINTS = 61
_COARSE, _FINE = 25, 401  # friction against preload is smooth, the probability of slack is not
_MOST_LOOPS = 6
_COEFFICIENTS = (0.5, 1.0, 2.0)  # times the fitted coefficients
_PRELOADS = (0.0, 0.5, 1.0, 2.0)  # times the fitted preload
_LEAST_BEND = 0.1  # rad; a figure against the wrap angle needs a range

Values = Mapping[str, Array]
Curves = dict[str, Any]


class _Part(Protocol):
    """One figure's part."""

    def curves(self, values: Values) -> Curves:
        """The curves of one draw."""
        ...

    def figure(self, draws: Curves) -> Any:
        """What the figure shows, from the curves of many draws (rows)."""
        ...


def elastic_figures(fit: Fit) -> ElasticFigures:
    """What the figures of stretch, preload and loops show; empty where the cable has none of them."""
    if not has_elastic_answers(fit):
        return ElasticFigures()
    parts = _parts(fit)
    space, posterior = fit.model.space, fit.posterior
    z = fit.least_squares.z[None]
    if posterior is not None:
        z = posterior.flat_z[np.linspace(0, len(posterior.flat_z) - 1, BATCH).astype(int)]

    def curves(one: Array) -> dict[str, Curves]:
        values = space.constrain(one)
        return {name: part.curves(values) for name, part in parts.items()}

    with jax.enable_x64(True):
        draws = for_each_draw(curves, space.size)(z)
        return ElasticFigures(**{name: part.figure(draws[name]) for name, part in parts.items()})


def _parts(fit: Fit) -> dict[str, _Part]:
    """The figures that apply."""
    elastic, tables, parts = fit.elastic, fit.dataset.measurements, dict[str, _Part]()
    if tables.stretch is not None:
        parts["stretch"] = _Stretch(fit, tables.stretch)
    if fit.dataset.description.preload_follows_stretch and knows_preload(fit.model):
        parts["preload"] = _Preload(fit)
    if fit.dataset.description.cable.kind == "loop" and knows_preload(fit.model):
        try:
            bends = elastic.measured_bends
        except UsageError:
            return parts
        parts["loops"] = _Loops(elastic, bends)
        if len(bends) and bends[-1] > _LEAST_BEND:
            parts["bending_loss"] = _BendingLoss(elastic, np.linspace(0, bends[-1], _POINTS))
            parts["window"] = _Window(elastic, (float(bends[0]), float(bends[-1])))
    return parts


def _quantiles(draws: np.ndarray) -> np.ndarray:
    """5 %, 50 % and 95 % quantiles over the draws; the one line without draws."""
    return draws if len(draws) == 1 else np.quantile(draws, _QUANTILES, axis=0)


def _median(draws: np.ndarray) -> np.ndarray:
    return np.median(draws, axis=0)


@dataclass(frozen=True)
class _Stretch:
    """Stretch against load at each wrap angle."""

    fit: Fit
    table: StretchTable

    @property
    def _angles(self) -> np.ndarray:
        return np.unique(self.table.wrap_angle)

    @property
    def _loads(self) -> np.ndarray:
        return np.linspace(0.0, self.table.load.max(), _POINTS)

    def curves(self, values: Values) -> Curves:
        elastic, load = self.fit.model.cable.elasticity, jnp.asarray(self._loads)
        angles, peak = jnp.asarray(self._angles)[:, None], load[-1]
        both = jnp.broadcast_to(load, (len(self._angles), len(self._loads)))
        angle = jnp.broadcast_to(angles, both.shape)
        return {
            "loading": elastic.stretch(values, both, angle, both),
            "unloading": elastic.stretch(values, both, angle, jnp.broadcast_to(peak, both.shape)),
        }

    def figure(self, draws: Curves) -> tuple[StretchCurve, ...]:
        loading, unloading = _quantiles(draws["loading"]), _quantiles(draws["unloading"])
        found = []
        for i, angle in enumerate(self._angles):
            rows = self.table.wrap_angle == angle
            down = self.table.unloading[rows]
            back = unloading[:, i] if down.any() else None
            points = self.table.load[rows], self.table.stretch[rows], down
            found.append(StretchCurve(float(np.rad2deg(angle)), self._loads, loading[:, i], back, *points))
        return tuple(found)


@dataclass(frozen=True)
class _Preload:
    """Preload against the wrap angle."""

    fit: Fit

    @property
    def _angles(self) -> np.ndarray:
        tables = self.fit.dataset.measurements
        found = [t.wrap_angle for t in (tables.preload, tables.stretch) if t is not None]
        if tables.loop is not None:
            found.append(np.nansum(np.nan_to_num(tables.loop.own.angle), axis=1))
        return np.linspace(0.0, max([float(a.max()) for a in found], default=np.pi), _POINTS)

    def curves(self, values: Values) -> Curves:
        preload, slack = self.fit.model.cable.elasticity.preload(values, jnp.asarray(self._angles))
        return {"preload": preload, "slack": slack}

    def figure(self, draws: Curves) -> PreloadCurve:
        table = self.fit.dataset.measurements.preload
        nothing = np.zeros(0)
        points = (nothing, nothing) if table is None else (np.rad2deg(table.wrap_angle), table.preload)
        slack = draws["slack"]
        return PreloadCurve(
            np.rad2deg(self._angles),
            _quantiles(draws["preload"]),
            _quantiles(slack),
            np.mean(slack > 0, axis=0),
            *points,
        )


@dataclass(frozen=True)
class _BendingLoss:
    """Efficiency against the wrap angle."""

    elastic: Elastic
    angles: np.ndarray

    @property
    def _preloads(self) -> np.ndarray:
        typical = float(np.median(preload_draws(self.elastic.fit)))
        return np.unique([float(f"{typical * factor:.2g}") for factor in _PRELOADS])

    def curves(self, values: Values) -> Curves:
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
        exponent = _median(draws["exponent"])
        coefficient = exponent[-1] / self.angles[-1]
        typical = float(np.median(preload_draws(self.elastic.fit)))
        lines = zip(_COEFFICIENTS, np.swapaxes(draws["coefficients"], 0, 1), strict=True)
        bent = zip(self._preloads, np.swapaxes(draws["preloads"], 0, 1), strict=True)
        capstan = np.asarray(transmission_efficiency(jnp.asarray(exponent)))
        return BendingLoss(
            np.rad2deg(self.angles),
            self.elastic.reference_force,
            _quantiles(draws["fitted"]),
            capstan,
            f"as fitted, preload {typical:.3g} N{_at_reference(self.elastic.fit)}",
            tuple(
                EfficiencyLine(f"coefficient {factor * coefficient:.2g}", _median(line), capstan**factor)
                for factor, line in lines
            ),
            tuple(EfficiencyLine(f"preload {p:g} N", _median(line), capstan) for p, line in bent),
        )


def _at_reference(fit: Fit) -> str:
    """' at 0 deg' where preload depends on the wrap angle."""
    settings = fit.dataset.description.preload
    follows = fit.dataset.description.preload_follows_stretch
    return f" at {settings.wrap_angle.value:g} {settings.wrap_angle.unit}" if follows else ""


@dataclass(frozen=True)
class _Loops:
    """Output against input force at the wrap angles that the loop was moved at."""

    elastic: Elastic
    bends: np.ndarray

    @property
    def _angles(self) -> np.ndarray:
        """So many of the wrap angles, spread evenly."""
        moved = self._points_angle
        angles = np.unique(np.round(moved, 9)) if len(moved) else self.bends
        return (
            angles[np.unique(np.linspace(0, len(angles) - 1, _MOST_LOOPS).round().astype(int))]
            if len(angles)
            else angles
        )

    @property
    def _points_angle(self) -> np.ndarray:
        table = self.elastic.fit.dataset.measurements.loop
        if table is None:
            return np.zeros(0)
        column = self.elastic.fit.dataset.description.contact[self.elastic.contact].wrap_angle.column
        if column is None:
            return np.full(len(table.stroke), self.bends[0])
        return np.nan_to_num(table.own.column(column)[0])

    @property
    def _forces(self) -> np.ndarray:
        table = self.elastic.fit.dataset.measurements.loop
        largest = 2 * self.elastic.reference_force if table is None else float(np.abs(table.input_force).max())
        lowest = 0.0 if table is None else min(0.0, float(table.input_force.min()))
        return np.linspace(1.05 * lowest, 1.05 * largest, _POINTS)

    def curves(self, values: Values) -> Curves:
        bent = self.elastic.bent(self._angles)
        exponent, (preload, _) = bent.exponent(values), bent.preload(values)
        force = jnp.broadcast_to(jnp.asarray(self._forces), (len(self._angles), _POINTS))
        forward, back = loop_band(force, preload[:, None], exponent[:, None])
        capstan = loop_band(force, jnp.zeros_like(exponent)[:, None], exponent[:, None])[0]
        return {"forward": forward, "back": back, "capstan": capstan, "slack": slack_load(preload, exponent)}

    def figure(self, draws: Curves) -> tuple[LoopCurve, ...]:
        table, of_point = self.elastic.fit.dataset.measurements.loop, self._points_angle
        nothing, found = np.zeros(0), []
        for i, angle in enumerate(self._angles):
            here = np.isclose(of_point, angle)
            points = (nothing, nothing, nothing.astype(int))
            if table is not None:
                points = table.input_force[here], table.output_force[here], table.stroke[here]
            found.append(
                LoopCurve(
                    f"{np.rad2deg(angle):.4g} deg",
                    self._forces,
                    _quantiles(draws["forward"][:, i]),
                    _quantiles(draws["back"][:, i]),
                    _median(draws["capstan"][:, i]),
                    _quantiles(draws["slack"][:, i]),
                    *points,
                )
            )
        return tuple(found)


@dataclass(frozen=True)
class _Window:
    """What a preload costs and what it buys."""

    elastic: Elastic
    bends: tuple[float, float]

    @property
    def _preloads(self) -> np.ndarray:
        typical = float(np.median(preload_draws(self.elastic.fit)))
        return np.linspace(0.0, max(2.5 * typical, 1.0), _COARSE)

    @property
    def _bent(self) -> Bent:
        return self.elastic.bent(np.linspace(*self.bends, _COARSE))

    def curves(self, values: Values) -> Curves:
        bent = self._bent
        friction = free_motion_loss(bent.preloads(values, jnp.asarray(self._preloads)), bent.exponent(values))
        return {"friction": jnp.max(friction, axis=-1), "lowest": bent.lowest_preload(values, self.input_force)}

    @property
    def input_force(self) -> float:
        """Force up to which the return side must stay taut: none where bending alone can make it slack."""
        follows = self.elastic.fit.dataset.description.preload_follows_stretch
        return 0.0 if follows else self.elastic.reference_force

    def figure(self, draws: Curves) -> PreloadWindow:
        fit, coarse = self.elastic.fit, self._preloads
        preloads = np.linspace(coarse[0], coarse[-1], _FINE)
        friction = np.stack([np.interp(preloads, coarse, line) for line in _quantiles(draws["friction"])])
        radius = fit.dataset.description.cable.output_pulley_radius
        arm, unit = (radius.to("length"), "N*mm") if radius is not None else (1.0, "N")
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
            self.input_force,
        )
