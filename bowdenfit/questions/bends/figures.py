"""From a fit to what its figures of stretch, preload and loops show.

Each figure has a part here: which curves it needs of a draw, and what becomes of them once they are there for many. The
curves of all parts are computed by one program.
"""

from dataclasses import dataclass
from typing import Any, Protocol

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from bowdenfit.errors import UsageError
from bowdenfit.inference.draws import BATCH, for_each_draw
from bowdenfit.kinds.tables import StretchTable
from bowdenfit.questions.bends.answer import elastic_answers, has_elastic_answers
from bowdenfit.questions.bends.equations import knows_preload
from bowdenfit.questions.bends.figure_data import ElasticFigures, PreloadCurve, StretchCurve
from bowdenfit.questions.bends.loop_figures import BendingLossPart, Curves, LoopsPart, Values, WindowPart, quantiles
from bowdenfit.results.record import Record

_POINTS = 61
_LEAST_BEND = 0.1  # rad; a figure against the wrap angle needs a range


class Part(Protocol):
    """One figure's part."""

    def curves(self, values: Values) -> Curves:
        """The curves of one draw."""
        ...

    def figure(self, draws: Curves) -> Any:
        """What the figure shows, from the curves of many draws (rows)."""
        ...


def elastic_figures(fit: Record) -> ElasticFigures:
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
        draws = for_each_draw(curves, space.size, run_once=True)(z)
        return ElasticFigures(**{name: part.figure(draws[name]) for name, part in parts.items()})


def _parts(fit: Record) -> dict[str, Part]:
    """The figures that apply."""
    elastic, tables, parts = elastic_answers(fit), fit.dataset.measurements, dict[str, Part]()
    if tables.stretch is not None:
        parts["stretch"] = _Stretch(fit, tables.stretch)
    if fit.dataset.description.preload_follows_stretch and knows_preload(fit.model):
        parts["preload"] = _Preload(fit)
    if fit.model.cable.is_loop and knows_preload(fit.model):
        try:
            bends = elastic.measured_bends
        except UsageError:
            return parts
        parts["loops"] = LoopsPart(elastic, bends)
        if len(bends) and bends[-1] > _LEAST_BEND:
            parts["bending_loss"] = BendingLossPart(elastic, np.linspace(0, bends[-1], _POINTS))
            parts["window"] = WindowPart(elastic, (float(bends[0]), float(bends[-1])))
    return parts


@dataclass(frozen=True)
class _Stretch:
    """Stretch against load at each wrap angle."""

    fit: Record
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
        loading, unloading = quantiles(draws["loading"]), quantiles(draws["unloading"])
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

    fit: Record

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
            quantiles(draws["preload"]),
            quantiles(slack),
            np.mean(slack > 0, axis=0),
            *points,
        )
