"""Predictions at wrap angles as rows of a table: what `bowdenfit predict --wrap-angle` and `--quantity` print."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from bowdenfit.errors import DatasetError, UsageError
from bowdenfit.inference.interval import Interval
from bowdenfit.questions.bends.answer import elastic_answers, friction_arm
from bowdenfit.questions.predict.outside import bends_note, measured, pulled
from bowdenfit.results.record import Record
from bowdenfit.units import conversion_factor
from bowdenfit.words import listed

Row = dict[str, Any]
Stated = tuple[float, str] | None  # a number and its unit

_STROKES = {"pull": 1, "return": -1}
_FORCE, _STROKE, _PRELOAD = "--input-force", "--stroke return", "--preload"
_LIMIT, _SPRING = "--friction-limit", "--spring"


@dataclass(frozen=True)
class Question:
    """What is asked at wrap angles, in internal units.

    Args:
        wrap_angles: Wrap angles [rad].
        input_force: Force at the motor side [N]; the reference force of the fit where none is stated.
        output_force: Force that is wanted at the load side [N]; None where none is.
        stated_force: Whether an input force was stated.
        preload: Preload [N] that the cable is given instead of its own; None for its own.
        friction: What may be felt in free motion [N]; None without a limit.
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


def question(
    fit: Record,
    wrap_angles: Sequence[tuple[float, str]] = (),
    input_force: Stated = None,
    output_force: Stated = None,
    preload: Stated = None,
    friction_limit: Stated = None,
    stroke: str = "pull",
    spring: Stated = None,
) -> Question:
    """A question from numbers with units; wrap angles are those measured at if none is named.

    Raises:
        UsageError: A number is negative, or has a unit of another kind.
    """
    angles = [_internal(angle, "angle", "--wrap-angle", 0.0) for angle in wrap_angles]
    limit = None
    if friction_limit is not None:
        arm, unit = friction_arm(fit)
        limit = _internal(friction_limit, "force" if unit == "N" else "torque", "--friction-limit", 0.0) / arm
    return Question(
        np.array(angles) if angles else elastic_answers(fit).measured_bends,
        elastic_answers(fit).reference_force
        if input_force is None
        else _internal(input_force, "force", "--input-force", 1e-9),
        None if output_force is None else _internal(output_force, "force", "--output-force", 1e-9),
        input_force is not None,
        None if preload is None else _internal(preload, "force", "--preload", 0.0),
        limit,
        _STROKES[stroke],
        None if spring is None else _internal(spring, "stiffness", "--spring", 1e-9),
    )


def _internal(stated: tuple[float, str], dimension: str, option: str, least: float) -> float:
    try:
        value = stated[0] * conversion_factor(stated[1], dimension)
    except DatasetError as error:
        raise UsageError(f"{option}: {error}.") from None
    if value < least:
        raise UsageError(f"{option} {stated[0]:g}{stated[1]} is not positive; write it without a sign.")
    return value


def predict_at_bends(fit: Record, quantity: str, asked: Question) -> list[Row]:
    """One row a wrap angle, or one row in all for the preload window.

    Args:
        fit: The fit.
        quantity: One of `QUANTITIES`.
        asked: The question.

    Raises:
        UsageError: There is no posterior, no wrap angle, or the cable has not what is asked for.
    """
    fit.draws()
    _refuse_what_changes_nothing(quantity, asked)
    if not len(asked.wrap_angles):
        raise UsageError(
            "nothing was measured at a wrap angle of its own; name those to predict at, as --wrap-angle 90deg."
        )
    return QUANTITIES[quantity].rows(fit, asked)


def _refuse_what_changes_nothing(quantity: str, asked: Question) -> None:
    """Refuse what a quantity does not depend on, since who states it expects otherwise."""
    stated = {
        _FORCE: asked.stated_force, _STROKE: asked.stroke < 0, _PRELOAD: asked.preload is not None,
        _LIMIT: asked.friction is not None, _SPRING: asked.spring is not None,
    }  # fmt: skip
    for option, is_stated in stated.items():
        if is_stated and option not in QUANTITIES[quantity].depends_on:
            others = [name for name, predicted in QUANTITIES.items() if option in predicted.depends_on]
            raise UsageError(
                f"--quantity {quantity} does not depend on {option}, which is asked of {listed(others)}; leave it out."
            )


def _rows(fit: Record, asked: Question, columns: Mapping[str, np.ndarray], words: Sequence[str] = ()) -> list[Row]:
    """Median, moments and interval of the first quantity, the others with their names before; what `words` and ranges say."""
    rows, outside = [], bends_note(fit)
    of_load = measured(fit).notes(None, asked.input_force) if asked.stated_force else []
    for i, angle in enumerate(np.rad2deg(asked.wrap_angles)):
        row: Row = {"wrap_angle_deg": float(f"{angle:.9g}")}
        for k, (name, draws) in enumerate(columns.items()):
            found, before = Interval.of(draws[:, i]), "" if k == 0 else f"{name}_"
            row |= {name: found.median, f"{before}mean": found.mean, f"{before}sd": found.sd}
            row |= {f"{before}q05": found.q05, f"{before}q95": found.q95}
        notes = [*words[i : i + 1], outside(asked.wrap_angles[i]), *of_load]
        rows.append(row | {"note": "; ".join(note for note in notes if note)})
    return rows


def _efficiency(fit: Record, asked: Question) -> list[Row]:
    force, words = _force(fit, asked)
    return _rows(fit, asked, {"efficiency": force / asked.input_force}, words)


def _output_force(fit: Record, asked: Question) -> list[Row]:
    force, words = _force(fit, asked)
    return _rows(fit, asked, {"output_force_N": force}, words)


def _force(fit: Record, asked: Question) -> tuple[np.ndarray, list[str]]:
    """Output forces of every draw: a rope is slack, and a loop is held by friction, where nothing is left."""
    force = elastic_answers(fit).output_force(asked.wrap_angles, asked.input_force, asked.stroke, asked.preload)
    return pulled(force, asked.input_force, "held by friction" if fit.model.cable.is_loop else "slack")


def _input_force(fit: Record, asked: Question) -> list[Row]:
    """Input force for the output force that is wanted: friction alone holds it where none is needed."""
    assert asked.output_force is not None  # the verb refuses the question without
    force = elastic_answers(fit).input_force(asked.wrap_angles, asked.output_force, asked.stroke, asked.preload)
    force, words = pulled(force, asked.output_force, "held by friction alone")
    limits = measured(fit)
    notes = [limits.notes(None, load) for load in np.median(force, axis=0)]
    words = ["; ".join(note for note in (word, *note) if note) for word, note in zip(words, notes, strict=True)]
    return _rows(fit, asked, {"input_force_N": force}, words)


def _preload(fit: Record, asked: Question) -> list[Row]:
    preload, slack = elastic_answers(fit).preload(asked.wrap_angles, asked.preload)
    rows = _rows(fit, asked, {"preload_N": preload, "slack_mm": slack})
    return [row | {"slack_probability": float(np.mean(slack[:, i] > 0))} for i, row in enumerate(rows)]


def _friction(fit: Record, asked: Question) -> list[Row]:
    felt, (arm, unit) = elastic_answers(fit).friction(asked.wrap_angles, asked.preload), friction_arm(fit)
    return _rows(fit, asked, {f"friction_{unit.replace('*', '_')}": arm * felt})


def _slack_load(fit: Record, asked: Question) -> list[Row]:
    _needs_loop(fit, "slack-load")
    return _rows(fit, asked, {"slack_load_N": elastic_answers(fit).slack_load(asked.wrap_angles, asked.preload)})


def _needs_loop(fit: Record, quantity: str) -> None:
    if not fit.model.cable.is_loop:
        raise UsageError(
            f'--quantity {quantity} is asked of pull-pull loops; this cable has no kind = "loop" under [cable].'
        )


def _position(fit: Record, asked: Question) -> list[Row]:
    error, lost = elastic_answers(fit).position(asked.wrap_angles, asked.input_force, asked.preload)
    columns = {"position_error_mm": error, "lost_motion_mm": lost}
    arm, unit = friction_arm(fit)
    if unit != "N":
        columns |= {"position_error_deg": np.rad2deg(error / arm), "lost_motion_deg": np.rad2deg(lost / arm)}
    return _rows(fit, asked, columns)


def _stiffness(fit: Record, asked: Question) -> list[Row]:
    stiffness = elastic_answers(fit).stiffness(asked.wrap_angles, asked.input_force, asked.preload, asked.spring)
    columns = {"stiffness_N_per_mm": stiffness}
    arm, unit = friction_arm(fit)
    if unit != "N":
        columns["stiffness_N_m_per_rad"] = stiffness * arm**2 / 1000
    return _rows(fit, asked, columns)


def _dynamic_range(fit: Record, asked: Question) -> list[Row]:
    """Largest torque of the device over the friction felt in free motion."""
    _needs_loop(fit, "dynamic-range")
    if not asked.stated_force:
        raise UsageError("--quantity dynamic-range needs the largest force at the motor, as --input-force 100N.")
    drawn = elastic_answers(fit).dynamic_range(asked.wrap_angles, asked.input_force, asked.preload)
    return _rows(fit, asked, {"dynamic_range": drawn})


def _window(fit: Record, asked: Question) -> list[Row]:
    ends = float(asked.wrap_angles.min()), float(asked.wrap_angles.max())
    force = asked.input_force if asked.stated_force else 0.0
    found = elastic_answers(fit).preload_window(ends, force, asked.friction)
    row: Row = {"from_deg": found.bends[0], "to_deg": found.bends[1], "input_force_N": force}
    row |= _quantiles("lowest", found.lowest, "N")
    if found.highest is not None:
        row |= _quantiles("highest", found.highest, "N")
    row |= {"best_N": found.best} | _quantiles("felt", found.felt, found.friction_unit.replace("*", "_"))
    return [row | {"possible": found.possible, "in_words": found.sentence()}]


def _quantiles(what: str, known: Interval, unit: str) -> Row:
    return {f"{what}_{name}_{unit}": getattr(known, name) for name in ("median", "q05", "q95")}


class _Predicted(NamedTuple):
    """A quantity.

    Args:
        rows: Of the table.
        depends_on: What may be stated, besides the output force that an input force is asked for.
    """

    rows: Callable[[Record, Question], list[Row]]
    depends_on: tuple[str, ...]


QUANTITIES: Mapping[str, _Predicted] = MappingProxyType(
    {
        "efficiency": _Predicted(_efficiency, (_FORCE, _STROKE, _PRELOAD)),
        "output-force": _Predicted(_output_force, (_FORCE, _STROKE, _PRELOAD)),
        "input-force": _Predicted(_input_force, (_STROKE, _PRELOAD)),
        "preload": _Predicted(_preload, (_PRELOAD,)),
        "friction": _Predicted(_friction, (_PRELOAD,)),
        "slack-load": _Predicted(_slack_load, (_PRELOAD,)),
        "position": _Predicted(_position, (_FORCE, _PRELOAD)),
        "stiffness": _Predicted(_stiffness, (_FORCE, _PRELOAD, _SPRING)),
        "dynamic-range": _Predicted(_dynamic_range, (_FORCE, _PRELOAD)),
        "preload-window": _Predicted(_window, (_FORCE, _LIMIT)),
    }
)
