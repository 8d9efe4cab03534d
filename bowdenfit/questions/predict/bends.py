"""Predictions at wrap angles as rows of a table: what `bowdenfit predict --wrap-angle` and `--quantity` print."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from bowdenfit.errors import DatasetError, UsageError
from bowdenfit.inference.interval import Interval
from bowdenfit.questions.bends.answer import elastic_answers, friction_arm
from bowdenfit.questions.predict.measured_range import clip_to_tension, find_measured_range, note_outside_bends
from bowdenfit.results.record import Record
from bowdenfit.units import conversion_factor
from bowdenfit.words import listed

Row = dict[str, Any]
StatedNumber = tuple[float, str] | None  # a number and its unit

_STROKES = {"pull": 1, "return": -1}
_FORCE, _STROKE, _PRELOAD = "--input-force", "--stroke return", "--preload"
_LIMIT, _SPRING = "--friction-limit", "--spring"
_MOST_BENDS = 1000  # judged: of a quarter degree each over a turn


@dataclass(frozen=True)
class BendQuery:
    """A question at wrap angles, in internal units.

    Args:
        wrap_angles: Wrap angles [rad].
        input_force: Force at the motor side [N]; the reference force of the fit where none is stated.
        output_force: Force that is wanted at the load side [N]; None where none is.
        stated_force: Whether an input force was stated.
        preload: Preload [N] that the cable is given instead of its own; None for its own.
        friction: Free-motion friction allowed [N]; None without a limit.
        stroke: +1 pulling, -1 returning.
        spring: Stiffness of a spring in series with each rope [N/mm]; None without.
    """

    wrap_angles: np.ndarray
    input_force: float
    output_force: float | None
    stated_force: bool
    preload: float | None
    friction: float | None
    stroke: int
    spring: float | None = None


def make_query(
    fit: Record,
    wrap_angles: Sequence[tuple[float, str]] = (),
    input_force: StatedNumber = None,
    output_force: StatedNumber = None,
    preload: StatedNumber = None,
    friction_limit: StatedNumber = None,
    stroke: str = "pull",
    spring: StatedNumber = None,
) -> BendQuery:
    """Return a question at wrap angles from numbers with units; the measured angles if none is named.

    Raises:
        UsageError: A number is negative, or has a unit of another kind, or there are too many wrap angles.
    """
    if len(wrap_angles) > _MOST_BENDS:
        raise UsageError(
            f"{len(wrap_angles):,} wrap angles are asked for, and at most {_MOST_BENDS:,} are predicted at a time; ask "
            "for fewer."
        )
    angles = [_to_internal(angle, "angle", "--wrap-angle", 0.0) for angle in wrap_angles]
    limit = None
    if friction_limit is not None:
        arm, unit = friction_arm(fit)
        limit = _to_internal(friction_limit, "force" if unit == "N" else "torque", "--friction-limit", 0.0) / arm
    return BendQuery(
        np.array(angles) if angles else elastic_answers(fit).measured_bends,
        elastic_answers(fit).reference_force
        if input_force is None
        else _to_internal(input_force, "force", "--input-force", 1e-9),
        None if output_force is None else _to_internal(output_force, "force", "--output-force", 1e-9),
        input_force is not None,
        None if preload is None else _to_internal(preload, "force", "--preload", 0.0),
        limit,
        _STROKES[stroke],
        None if spring is None else _to_internal(spring, "stiffness", "--spring", 1e-9),
    )


def _to_internal(stated: tuple[float, str], dimension: str, option: str, least: float) -> float:
    """Convert a number with its unit to the internal unit."""
    try:
        value = stated[0] * conversion_factor(stated[1], dimension)
    except DatasetError as error:
        raise UsageError(f"{option}: {error}.") from None
    if value < least:
        raise UsageError(f"{option} {stated[0]:g}{stated[1]} is not positive; write it without a sign.")
    return value


def predict_at_wrap_angles(fit: Record, quantity: str, query: BendQuery) -> list[Row]:
    """Return predictions, a row for each wrap angle, or one row in all for the preload window.

    Args:
        fit: The fit.
        quantity: One of `QUANTITIES`.
        query: Query made by `make_query`.

    Raises:
        UsageError: There is no posterior, no wrap angle, or the cable has not what is asked for.
    """
    fit.draws()
    _refuse_irrelevant_options(quantity, query)
    if not len(query.wrap_angles):
        raise UsageError(
            "nothing was measured at a wrap angle of its own; name those to predict at, as --wrap-angle 90deg."
        )
    return QUANTITIES[quantity].rows(fit, query)


def _refuse_irrelevant_options(quantity: str, query: BendQuery) -> None:
    """Refuse what a quantity does not depend on, since who states it expects otherwise."""
    stated = {
        _FORCE: query.stated_force, _STROKE: query.stroke < 0, _PRELOAD: query.preload is not None,
        _LIMIT: query.friction is not None, _SPRING: query.spring is not None,
    }  # fmt: skip
    for option, is_stated in stated.items():
        if is_stated and option not in QUANTITIES[quantity].depends_on:
            remaining = [name for name, predicted in QUANTITIES.items() if option in predicted.depends_on]
            raise UsageError(
                f"--quantity {quantity} does not depend on {option}, which is asked of {listed(remaining)}; leave it out."
            )


def _interval_rows(fit: Record, query: BendQuery, columns: Mapping[str, np.ndarray], words: Sequence[str] = ()) -> list[Row]:
    """Return median, moments and interval of every quantity, one row a wrap angle; keys of the first have no prefix."""
    rows, outside = [], note_outside_bends(fit)
    of_load = find_measured_range(fit).notes(None, query.input_force) if query.stated_force else []
    for i, angle in enumerate(np.rad2deg(query.wrap_angles)):
        row: Row = {"wrap_angle_deg": float(f"{angle:.9g}")}
        for k, (name, draws) in enumerate(columns.items()):
            interval, prefix = Interval.of(draws[:, i]), "" if k == 0 else f"{name}_"
            row |= {name: interval.median, f"{prefix}mean": interval.mean, f"{prefix}sd": interval.sd}
            row |= {f"{prefix}q05": interval.q05, f"{prefix}q95": interval.q95}
        notes = [*words[i : i + 1], outside(query.wrap_angles[i]), *of_load]
        rows.append(row | {"note": "; ".join(note for note in notes if note)})
    return rows


def _predict_efficiency(fit: Record, query: BendQuery) -> list[Row]:
    """Predict the efficiency."""
    force, words = _draw_output_forces(fit, query)
    return _interval_rows(fit, query, {"efficiency": force / query.input_force}, words)


def _predict_output_force(fit: Record, query: BendQuery) -> list[Row]:
    """Predict the output force."""
    force, words = _draw_output_forces(fit, query)
    return _interval_rows(fit, query, {"output_force_N": force}, words)


def _draw_output_forces(fit: Record, query: BendQuery) -> tuple[np.ndarray, list[str]]:
    """Return output forces of every draw; where nothing is left, a rope is slack, and a loop is held by friction."""
    force = elastic_answers(fit).output_force(query.wrap_angles, query.input_force, query.stroke, query.preload)
    return clip_to_tension(force, query.input_force, "held by friction" if fit.model.cable.is_loop else "slack")


def _predict_input_force(fit: Record, query: BendQuery) -> list[Row]:
    """Predict the input force for a wanted output force; 0 where friction alone holds it."""
    assert query.output_force is not None  # the verb refuses the question without
    force = elastic_answers(fit).input_force(query.wrap_angles, query.output_force, query.stroke, query.preload)
    force, words = clip_to_tension(force, query.output_force, "held by friction alone")
    limits = find_measured_range(fit)
    notes = [limits.notes(None, load) for load in np.median(force, axis=0)]
    words = ["; ".join(note for note in (word, *note) if note) for word, note in zip(words, notes, strict=True)]
    return _interval_rows(fit, query, {"input_force_N": force}, words)


def _predict_preload(fit: Record, query: BendQuery) -> list[Row]:
    """Predict preload and slack."""
    preload, slack = elastic_answers(fit).preload(query.wrap_angles, query.preload)
    rows = _interval_rows(fit, query, {"preload_N": preload, "slack_mm": slack})
    return [row | {"slack_probability": float(np.mean(slack[:, i] > 0))} for i, row in enumerate(rows)]


def _predict_friction(fit: Record, query: BendQuery) -> list[Row]:
    """Predict the force felt in free motion."""
    friction, (arm, unit) = elastic_answers(fit).friction(query.wrap_angles, query.preload), friction_arm(fit)
    return _interval_rows(fit, query, {f"friction_{unit.replace('*', '_')}": arm * friction})


def _predict_slack_load(fit: Record, query: BendQuery) -> list[Row]:
    """Predict the input force at which the return side of a loop goes slack."""
    _require_loop(fit, "slack-load")
    return _interval_rows(fit, query, {"slack_load_N": elastic_answers(fit).slack_load(query.wrap_angles, query.preload)})


def _require_loop(fit: Record, quantity: str) -> None:
    """Refuse a cable that is not a loop."""
    if not fit.model.cable.is_loop:
        raise UsageError(
            f'--quantity {quantity} is asked of pull-pull loops; this cable has no kind = "loop" under [cable].'
        )


def _predict_position(fit: Record, query: BendQuery) -> list[Row]:
    """Predict position error and lost motion."""
    error, lost_motion = elastic_answers(fit).position(query.wrap_angles, query.input_force, query.preload)
    columns = {"position_error_mm": error, "lost_motion_mm": lost_motion}
    arm, unit = friction_arm(fit)
    if unit != "N":
        columns |= {"position_error_deg": np.rad2deg(error / arm), "lost_motion_deg": np.rad2deg(lost_motion / arm)}
    return _interval_rows(fit, query, columns)


def _predict_stiffness(fit: Record, query: BendQuery) -> list[Row]:
    """Predict the stiffness at the load side."""
    stiffness = elastic_answers(fit).stiffness(query.wrap_angles, query.input_force, query.preload, query.spring)
    columns = {"stiffness_N_per_mm": stiffness}
    arm, unit = friction_arm(fit)
    if unit != "N":
        columns["stiffness_N_m_per_rad"] = stiffness * arm**2 / 1000
    return _interval_rows(fit, query, columns)


def _predict_dynamic_range(fit: Record, query: BendQuery) -> list[Row]:
    """Predict the largest torque of the device over the friction felt in free motion."""
    _require_loop(fit, "dynamic-range")
    if not query.stated_force:
        raise UsageError("--quantity dynamic-range needs the largest force at the motor, as --input-force 100N.")
    ratio = elastic_answers(fit).dynamic_range(query.wrap_angles, query.input_force, query.preload)
    return _interval_rows(fit, query, {"dynamic_range": ratio})


def _predict_preload_window(fit: Record, query: BendQuery) -> list[Row]:
    """Predict the preload window."""
    ends = float(query.wrap_angles.min()), float(query.wrap_angles.max())
    force = query.input_force if query.stated_force else 0.0
    window = elastic_answers(fit).preload_window(ends, force, query.friction)
    row: Row = {"from_deg": window.bends[0], "to_deg": window.bends[1], "input_force_N": force}
    row |= _format_quantiles("lowest", window.lowest, "N")
    if window.highest is not None:
        row |= _format_quantiles("highest", window.highest, "N")
    row |= {"best_N": window.best} | _format_quantiles("felt", window.felt, window.friction_unit.replace("*", "_"))
    return [row | {"possible": window.possible, "in_words": window.sentence()}]


def _format_quantiles(prefix: str, interval: Interval, unit: str) -> Row:
    """Return median, moments and quantiles of draws as cells of a row."""
    return {f"{prefix}_{name}_{unit}": getattr(interval, name) for name in ("median", "q05", "q95")}


class _PredictedQuantity(NamedTuple):
    """A quantity that can be predicted at wrap angles.

    Args:
        rows: Function that returns the rows of the table.
        depends_on: Options that may be stated, besides the output force that an input force is asked for.
    """

    rows: Callable[[Record, BendQuery], list[Row]]
    depends_on: tuple[str, ...]


QUANTITIES: Mapping[str, _PredictedQuantity] = MappingProxyType(
    {
        "efficiency": _PredictedQuantity(_predict_efficiency, (_FORCE, _STROKE, _PRELOAD)),
        "output-force": _PredictedQuantity(_predict_output_force, (_FORCE, _STROKE, _PRELOAD)),
        "input-force": _PredictedQuantity(_predict_input_force, (_STROKE, _PRELOAD)),
        "preload": _PredictedQuantity(_predict_preload, (_PRELOAD,)),
        "friction": _PredictedQuantity(_predict_friction, (_PRELOAD,)),
        "slack-load": _PredictedQuantity(_predict_slack_load, (_PRELOAD,)),
        "position": _PredictedQuantity(_predict_position, (_FORCE, _PRELOAD)),
        "stiffness": _PredictedQuantity(_predict_stiffness, (_FORCE, _PRELOAD, _SPRING)),
        "dynamic-range": _PredictedQuantity(_predict_dynamic_range, (_FORCE, _PRELOAD)),
        "preload-window": _PredictedQuantity(_predict_preload_window, (_FORCE, _LIMIT)),
    }
)
