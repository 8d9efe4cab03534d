"""Which predictions lie outside what was measured, in words, and where a rope would have to push."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from bowdenfit.kinds import iterate_tables
from bowdenfit.kinds.kind import FrictionKind
from bowdenfit.questions.bends.answer import elastic_answers
from bowdenfit.results.record import Record
from bowdenfit.words import percent

_ROUNDING = 1e-6  # share of an end of a range by which a number may miss it, above rounding of units
_SURELY, _HARDLY = 0.995, 0.005  # shares of the draws beyond which a percentage would round to 100 or 0
Range = tuple[float, float] | None


@dataclass(frozen=True)
class MeasuredRange:
    """Ranges that a cable was measured in, from the lowest to the highest; None where it was not.

    Args:
        lengths: Route values of wrap angles and of friction.
        loads: Forces that friction acted on [N].
        unit: Unit of the route.
    """

    lengths: Range
    loads: Range
    unit: str

    def notes(self, length: float | None, input_force: float | None) -> list[str]:
        """Describe what lies outside.

        Args:
            length: Route value; None without a route.
            input_force: Force that was asked for [N]; None where the fit's own counts.
        """
        notes = [_note_outside(length, self.lengths, "lengths", self.unit)]
        if input_force is not None:
            notes.append(_note_outside(input_force, self.loads, "loads", "N") if self.loads else "no table says at which loads")
        return [note for note in notes if note]


def find_measured_range(fit: Record) -> MeasuredRange:
    """Return the ranges in which a fit's tables were measured."""
    measurements, route = fit.dataset.measurements, fit.dataset.description.route
    tables = list(iterate_tables(measurements))
    friction = [(kind, table) for kind, table in tables if isinstance(kind, FrictionKind)]
    lengths = [np.ravel(getattr(table, "route", ())) for kind, table in tables if not isinstance(kind, FrictionKind)]
    lengths += [kind.conditions(table).route for kind, table in friction]
    loads = [np.abs(kind.forces(table)) for kind, table in friction]
    return MeasuredRange(_finite_range(lengths), _finite_range(loads), route.unit if route else "")


def note_outside_bends(fit: Record) -> Callable[[float], str]:
    """Return a function of a wrap angle [rad] that notes where nothing was measured; its note is empty elsewhere."""
    span = _finite_range([np.rad2deg(elastic_answers(fit).measured_bends)])
    return lambda angle: _note_outside(float(np.rad2deg(angle)), span, "wrap angles", "deg")


def clip_to_tension(
    force: np.ndarray, input_force: float | np.ndarray, slack_word: str = "slack"
) -> tuple[np.ndarray, list[str]]:
    """Return forces of a rope, which pulls or is slack but never pushes, and a note for each column.

    Args:
        force: Forces by draws (rows), negative where nothing is left [N].
        input_force: What they are left of [N].
        slack_word: What a rope is that does not pull.
    """
    share = np.mean(force <= _ROUNDING * input_force, axis=0)
    words = [
        slack_word if s > _SURELY else f"{slack_word} with {percent(s, 0)} probability" if s > _HARDLY else ""
        for s in share
    ]
    return np.maximum(force, 0.0), words


def _finite_range(parts: list[np.ndarray]) -> Range:
    """Return the lowest and highest finite value; None without any."""
    values = np.concatenate([np.asarray(part, dtype=float) for part in parts]) if parts else np.zeros(0)
    finite = values[np.isfinite(values)]
    return (float(np.min(finite)), float(np.max(finite))) if len(finite) else None


def _note_outside(value: float | None, span: Range, what: str, unit: str) -> str:
    """Note that a value lies outside a range; empty where it does not."""
    if value is None or span is None:
        return ""
    slack = _ROUNDING * max(abs(span[0]), abs(span[1]))
    if span[0] - slack <= value <= span[1] + slack:
        return ""
    return f"outside the {what} measured, {span[0]:.4g} to {span[1]:.4g} {unit}"
