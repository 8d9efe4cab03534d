"""Answers about stretch, preload and loops at wrap angles, with intervals: what `bowdenfit predict --quantity` prints."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from bowdenfit.cable.elasticity import PRELOAD
from bowdenfit.display import Display, Rows
from bowdenfit.errors import UsageError
from bowdenfit.inference.draws import for_each_value
from bowdenfit.inference.interval import Interval
from bowdenfit.inference.scalar_priors import value_at
from bowdenfit.kinds import iterate_tables
from bowdenfit.kinds.kind import FrictionKind, RopeKind
from bowdenfit.physics.loop import dynamic_range
from bowdenfit.physics.stretch import stiffness_with_springs
from bowdenfit.questions.bends.bent_cable import BentCable, find_bent_contact, has_preload, has_stretch
from bowdenfit.questions.bends.preload_window import TAUT, PreloadWindow
from bowdenfit.results.record import Record, cached_per_fit, parameter_values

_WINDOW_BENDS = (
    25  # wrap angles across a range of bends on which extremes are searched; between them answers are smooth
)
_MAX_BENDS = 5  # wrap angles shown in a summary
_QUANTILES = 0.5, 0.05, 0.95  # in the order of the columns
_UNITS = {
    "preload": "N", "friction": "N", "slack_load": "N", "efficiency": "1", "position_error": "mm", "lost_motion": "mm",
    "stiffness": "N/mm",
}  # fmt: skip


@dataclass(frozen=True, repr=False)
class ElasticAnswers(Display):
    """Answers of one fit about stretch, preload and loops. Angles are in rad, forces in N, lengths in mm."""

    fit: Record

    def _table(self) -> Rows:
        """Return a table of the answers at the measured wrap angles."""
        bends, draws, _ = self.usual
        names = [f"{name}{of}" for name in draws for of in ("", "_q05", "_q95")]
        values = [q for values in draws.values() for q in np.quantile(values, _QUANTILES, axis=0)]
        return {"wrap_angle": np.rad2deg(bends)} | dict(zip(names, values, strict=True)), {"wrap_angle": "deg"} | {
            name: _UNITS[name.removesuffix("_q05").removesuffix("_q95")] for name in names
        }

    @cached_property
    def contact(self) -> int:
        """Number of the contact that a wrap angle refers to."""
        return find_bent_contact(self.fit.model)

    def bend_to(self, wrap_angles: Sequence[float] | np.ndarray) -> BentCable:
        """Return the cable bent to wrap angles [rad].

        Raises:
            UsageError: A wrap angle does not say which of several contacts is bent.
        """
        with jax.enable_x64(True):
            return BentCable(self.fit.model, self.contact, jnp.asarray(np.atleast_1d(wrap_angles), dtype=float))

    def bend_rope_to(self, wrap_angles: Sequence[float] | np.ndarray) -> BentCable:
        """Return the cable bent to total wrap angles [rad], on which the stretch of a single rope depends."""
        model = self.fit.model
        if model.cable.is_loop or len(model.description.contact) == 1:
            return self.bend_to(wrap_angles)
        with jax.enable_x64(True):
            return BentCable(model, None, jnp.asarray(np.atleast_1d(wrap_angles), dtype=float))

    def evaluate(self, function: Callable[..., Any], *data: Any) -> Any:
        """Evaluate a function of named values (and of shared data) for every draw, or for the least-squares values."""
        with jax.enable_x64(True):
            return for_each_value(function, parameter_values(self.fit), *data)

    @cached_property
    def measured_bends(self) -> np.ndarray:
        """Distinct wrap angles at which anything was measured [rad]."""
        contact = self.fit.dataset.description.contact[self.contact]
        column, angles_by_table = contact.wrap_angle.column, []
        for kind, table in iterate_tables(self.fit.dataset.measurements):
            if isinstance(kind, FrictionKind):
                angles_by_table += [] if column is None else [kind.conditions(table).own.column(column)[0]]
            elif isinstance(kind, RopeKind):
                angles_by_table.append(kind.bends(table))
        if contact.wrap_angle.constant is not None:
            angles_by_table.append(np.array([contact.wrap_angle.constant.to("angle")]))
        angles = np.concatenate(angles_by_table) if angles_by_table else np.zeros(0)
        return np.unique(np.round(angles[np.isfinite(angles)], 9))

    @property
    def reference_force(self) -> float:
        """Input force that answers are given for where none is stated [N]."""
        return self.fit.model.cable.friction.conditions.reference_force

    @property
    def window_force(self) -> float:
        """Force up to which a preload window asks for a taut return side: none where bending alone can make it slack [N]."""
        return 0.0 if self.fit.dataset.description.preload_follows_stretch else self.reference_force

    def efficiency(
        self, wrap_angles: np.ndarray, input_force: float | None = None, preload: float | None = None
    ) -> np.ndarray:
        """Return the efficiency [1] of every draw (rows) at wrap angles (columns)."""
        force = self.reference_force if input_force is None else input_force
        return self.output_force(wrap_angles, force, 1, preload) / force

    def output_force(
        self, wrap_angles: np.ndarray, input_force: float, stroke: int = 1, preload: float | None = None
    ) -> np.ndarray:
        """Return the output force [N] of every draw (rows) at wrap angles (columns)."""
        bent, force = self.bend_to(wrap_angles), float(input_force)
        return self.evaluate(lambda values: bent.output_force(values, jnp.asarray(force), float(stroke), preload))

    def input_force(
        self, wrap_angles: np.ndarray, output_force: float, stroke: int = 1, preload: float | None = None
    ) -> np.ndarray:
        """Return the input force [N] that gives an output force, of every draw (rows) at wrap angles (columns)."""
        bent, force = self.bend_to(wrap_angles), float(output_force)
        return self.evaluate(lambda values: bent.input_force(values, jnp.asarray(force), float(stroke), preload))

    def friction(self, wrap_angles: np.ndarray, preload: float | None = None) -> np.ndarray:
        """Return the force felt in free motion [N], draws by wrap angles.

        Raises:
            UsageError: The cable has no preload, and none is stated.
        """
        self._require_preload(preload)
        bent = self.bend_to(wrap_angles)
        return self.evaluate(lambda values: bent.friction(values, preload))

    def preload(self, wrap_angles: np.ndarray, preload: float | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Return preload [N] and slack [mm], draws by wrap angles.

        Raises:
            UsageError: The cable has no preload, and none is stated.
        """
        self._require_preload(preload)
        bent = self.bend_to(wrap_angles)
        return self.evaluate(lambda values: bent.preload(values, preload))

    def slack_load(self, wrap_angles: np.ndarray, preload: float | None = None) -> np.ndarray:
        """Return the input force at which the return side of a loop goes slack [N], draws by wrap angles.

        Raises:
            UsageError: The cable has no preload, and none is stated.
        """
        self._require_preload(preload)
        bent = self.bend_to(wrap_angles)
        return self.evaluate(lambda values: bent.slack_load(values, preload))

    def position(
        self, wrap_angles: np.ndarray, input_force: float, preload: float | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return position error and lost motion at the load side [mm], stated backlash included, draws by wrap angles.

        Raises:
            UsageError: Nothing says how the rope stretches.
        """
        self._require_stretch()
        bent = self.bend_rope_to(wrap_angles)
        error, lost = self.evaluate(lambda values: bent.position(values, float(input_force), preload))
        return error + self._backlash, lost + self._backlash

    def tension(self, extensions: np.ndarray) -> np.ndarray:
        """Return the tension [N] of the rope from its extension [mm], draws by extensions; 0 where it is slack.

        Raises:
            UsageError: Nothing says how the rope stretches.
        """
        self._require_stretch()
        extended, elastic = np.atleast_1d(np.asarray(extensions, dtype=float)), self.fit.model.cable.elasticity
        return self.evaluate(lambda values: elastic.tension(values, jnp.asarray(extended)))

    def stiffness(
        self, wrap_angles: np.ndarray, load: float, preload: float | None = None, spring: float | None = None
    ) -> np.ndarray:
        """Return the stiffness seen at the load side [N/mm], draws by wrap angles.

        Args:
            wrap_angles: Wrap angles [rad].
            load: Input force [N].
            preload: Preload that the cable is given instead of its own [N].
            spring: Stiffness of a spring in series with each rope [N/mm]; None for none.

        Raises:
            UsageError: Nothing says how the rope stretches.
        """
        self._require_stretch()
        bent, is_loop = self.bend_rope_to(wrap_angles), self.fit.model.cable.is_loop

        def answer(values: Mapping[str, Any]) -> Any:
            stiffness = bent.stiffness(values, float(load), preload)
            if spring is None:
                return stiffness
            one, both = (stiffness_with_springs(stiffness, jnp.asarray(spring), sides) for sides in (1, 2))
            return jnp.where(bent.slack_load(values, preload) > load, both, one) if is_loop else one

        return self.evaluate(answer)

    def dynamic_range(self, wrap_angles: np.ndarray, largest_force: float, preload: float | None = None) -> np.ndarray:
        """Return the largest force over what moving the unloaded loop takes [1], draws by wrap angles.

        Raises:
            UsageError: The cable has no preload, and none is stated.
        """
        self._require_preload(preload)
        bent, force = self.bend_to(wrap_angles), jnp.asarray(float(largest_force))
        return self.evaluate(
            lambda values: dynamic_range(force, bent.preload(values, preload)[0], bent.exponent(values))
        )

    def preload_window(
        self, bends: tuple[float, float], input_force: float = 0.0, friction: float | None = None
    ) -> PreloadWindow:
        """Return the lowest preload without slack over a range of bends, the highest for a given friction, and the best.

        Args:
            bends: Lowest and highest wrap angle [rad].
            input_force: Force up to which both sides must stay taut [N].
            friction: Free-motion friction allowed [N]; no limit if omitted.

        Raises:
            UsageError: The cable has no preload.
        """
        self._require_preload(None)
        bent = self.bend_to(np.linspace(*bends, _WINDOW_BENDS))
        limit = np.inf if friction is None else friction

        def answers(values: Mapping[str, Any]) -> tuple[Any, Any, Any]:
            lowest = bent.lowest_preload(values, input_force)
            friction_felt = jnp.max(bent.friction(values, lowest))
            return lowest, bent.highest_preload(values, min(limit, 1e9)), friction_felt <= limit * (1 + 1e-9)

        return self._window(bends, input_force, limit, *self.evaluate(answers))

    def _window(
        self,
        bends: tuple[float, float],
        input_force: float,
        limit: float,
        lowest: np.ndarray,
        highest: np.ndarray,
        possible: np.ndarray,
    ) -> PreloadWindow:
        """Return the preload window from draws of the lowest and highest preload and of whether the lowest suffices.

        With an infinite limit there is no highest.
        """
        bent, best = self.bend_to(np.linspace(*bends, _WINDOW_BENDS)), float(np.quantile(lowest, TAUT))
        friction_felt = self.evaluate(lambda values, preload: jnp.max(bent.friction(values, preload)), np.array(best))
        follows, limited = self.fit.dataset.description.preload_follows_stretch, np.isfinite(limit)
        low, high = np.rad2deg(bends)
        arm, unit = friction_arm(self.fit)
        return PreloadWindow(
            (float(low), float(high)),
            float(np.rad2deg(self.fit.model.cable.elasticity.reference_angle)) if follows else float("nan"),
            input_force,
            arm * limit,
            unit,
            Interval.of(lowest),
            Interval.of(highest) if limited else None,
            best,
            Interval.of(friction_felt).times(arm),
            float(np.mean(possible)) if limited else 1.0,
        )

    @cached_property
    def usual(self) -> tuple[np.ndarray, dict[str, np.ndarray], PreloadWindow | None]:
        """What a summary shows, computed by one program: wrap angles [rad], draws by wrap angles, and the preload window.

        The draws are of preload [N], friction [N], slack load [N], efficiency [1], position error and lost motion [mm],
        stiffness [N/mm], as far as the cable has them.
        """
        bends, model, force = self.measured_bends, self.fit.model, self.reference_force
        if not len(bends):
            return bends, {}, None
        angles = pick_evenly(bends, _MAX_BENDS)
        preloaded, stretches, ends = has_preload(model), has_stretch(model), (float(bends[0]), float(bends[-1]))
        bent, window_bends = self.bend_to(angles), self.bend_to(np.linspace(*ends, _WINDOW_BENDS))
        window_force = self.window_force

        def answers(values: Mapping[str, Any]) -> dict[str, Any]:
            answers = {"efficiency": bent.output_force(values, jnp.asarray(force)) / force}
            if preloaded:
                answers |= {"preload": bent.preload(values)[0], "friction": bent.friction(values)}
                answers["lowest"] = window_bends.lowest_preload(values, window_force)
            if preloaded and model.cable.is_loop:
                answers["slack_load"] = bent.slack_load(values)
            if stretches:
                answers["position_error"], answers["lost_motion"] = bent.position(values, force)
                answers["stiffness"] = bent.stiffness(values, force)
            return answers

        draws = self.evaluate(answers)
        lowest = draws.pop("lowest", None)
        if lowest is None or len(bends) == 1:
            return angles, self._add_backlash(draws), None
        return angles, self._add_backlash(draws), self._window(ends, window_force, np.inf, lowest, lowest, lowest)

    def _add_backlash(self, draws: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
        """Add the stated backlash to position error and lost motion."""
        shifted = {name: draws[name] + self._backlash for name in ("position_error", "lost_motion") if name in draws}
        return draws | shifted

    @property
    def _backlash(self) -> float:
        """Stated backlash [mm]; 0 without one."""
        stated = self.fit.dataset.description.cable.backlash
        return stated.to("length") if stated is not None else 0.0

    def _require_preload(self, stated: float | None) -> None:
        """Refuse a cable without preload where none is stated."""
        if stated is None and not has_preload(self.fit.model):
            raise UsageError(
                "nothing measured on this cable says what its preload is; state one with --preload 20N, or add a table of "
                "preload, or of the loop, to cable.toml."
            )

    def _require_stretch(self) -> None:
        """Refuse a cable of which nothing says how its rope stretches."""
        if not has_stretch(self.fit.model):
            raise UsageError(
                "nothing measured on this cable says how its rope stretches; add a table of stretch under load to cable.toml."
            )


@cached_per_fit
def elastic_answers(fit: Record) -> ElasticAnswers:
    """Return the elastic answers of a fit; of a copy, so that what is kept for a record does not keep the record itself."""
    return ElasticAnswers(replace(fit))


def has_elastic_answers(fit: Record) -> bool:
    """Return whether a fit says anything of stretch or preload."""
    return has_stretch(fit.model) or has_preload(fit.model)


def pick_evenly(values: np.ndarray, most: int) -> np.ndarray:
    """Return at most so many of the values, evenly from the first to the last."""
    return values[np.unique(np.linspace(0, len(values) - 1, most).round().astype(int))] if len(values) else values


def friction_arm(fit: Record) -> tuple[float, str]:
    """Return the radius that turns friction into what is felt [mm] and the unit of that; 1 and N without a radius."""
    radius = fit.dataset.description.cable.output_pulley_radius
    return (radius.to("length"), "N*mm") if radius is not None else (1.0, "N")


def typical_preload(fit: Record) -> float:
    """Return the preload [N]: its median, or least squares without draws, or the median of its prior as a last resort."""
    if fit.sampled is not None and PRELOAD in fit.sampled.values:
        return fit.parameter_of_draws(PRELOAD).median
    estimate = fit.least_squares.estimates[PRELOAD].value
    if np.isfinite(estimate):
        return float(estimate)
    prior = next(p.prior for p in fit.model.space.free if p.name == PRELOAD)
    return value_at(prior, 0.0)
