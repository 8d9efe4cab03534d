"""Efficiencies that no rope can have, in a sentence for the verdict."""

import numpy as np

from bowdenfit.kinds import readings_called
from bowdenfit.kinds.plausibility import GAIN_ERROR
from bowdenfit.kinds.term import Term
from bowdenfit.results.record import Record

_SDS = 4.5  # of noise above what is possible, which one healthy reading of 300,000 exceeds
_NAMED = 3


def impossible_efficiencies(fit: Record) -> str:
    """Efficiencies above what the fit can make of them and above 1, beyond noise, in a sentence; empty where there are none."""
    found = []
    for term in fit.model.terms:
        called = readings_called(term.name)
        if not called.are_efficiencies:
            continue
        measured, predicted = term.observed(), _predicted(fit, term)
        above = np.log(
            measured / np.maximum(predicted, 1.0)
        )  # offsets and gains of the load cells may show more than 1
        beyond = np.flatnonzero(above > GAIN_ERROR + _SDS * _noise(fit, term))
        found += [f"{called.one.format(term.labels[i])} {measured[i]:.1%}" for i in beyond]
    if not found:
        return ""
    more = f" and {len(found) - _NAMED} more" if len(found) > _NAMED else ""
    return (
        f"No rope passes on more force than goes in, but these readings say so beyond their noise: {', '.join(found[:_NAMED])}"
        f"{more}. The usual causes are swapped columns or channels, pull and return exchanged, a unit, or a channel that is no "
        "force: look at these with `bowdenfit check`."
    )


def _predicted(fit: Record, term: Term) -> np.ndarray:
    if fit.posterior is None:
        return fit.least_squares.readings[term.name]
    return np.asarray(np.median(fit.posterior.expected[term.name], axis=(0, 1)))


def _noise(fit: Record, term: Term) -> np.ndarray | float:
    """What noise of the forces adds to the log of each reading; a mounting cannot take friction below none."""
    weight, noise = term.data.get("run_weight"), getattr(term, "reading_noise", "")
    if weight is None:
        return np.asarray(term.data.get("log_sd", 0.0))
    fixed = {p.name: p.fixed for p in fit.model.space.fixed}
    if noise in fixed:
        value = float(fixed[noise] or 0.0)
    elif fit.posterior is not None:
        value = float(np.median(fit.posterior.values[noise]))
    else:
        cells = np.asarray(term.data["weight"])
        value = float(np.sqrt(np.sum(term.data["scatter"]) / max(np.sum(term.data["n"]) - np.sum(cells > 0), 1.0)))
    return np.asarray(value / np.sqrt(weight))
