"""Efficiencies that no rope can have, and friction that no sheath has, in sentences for the verdict."""

import numpy as np

from bowdenfit.description import PriorDefaults
from bowdenfit.kinds import find_readings
from bowdenfit.kinds.plausibility import GAIN_ERROR
from bowdenfit.kinds.term import Term
from bowdenfit.parameters.priors import LogNormal
from bowdenfit.results.record import Record
from bowdenfit.words import few, percent

_MAX_DEVIATIONS = 4.5  # of noise above what is possible, which one healthy reading of 300,000 exceeds
_LEAST, _MOST = 0.015, 1.0  # coefficients outside which a mistake is likelier than such a rope


def describe_impossible_efficiencies(fit: Record) -> str:
    """Describe efficiencies above 1 and above the prediction, beyond noise; empty where there are none."""
    impossible = []
    for term in fit.model.terms:
        called = find_readings(term.name)
        if not called.are_efficiencies:
            continue
        measured, predicted = term.observed(), _predicted(fit, term)
        above = np.log(measured / np.maximum(predicted, 1.0))  # offsets and gains of the cells may show more than 1
        beyond = np.flatnonzero(above > GAIN_ERROR + _MAX_DEVIATIONS * _noise(fit, term))
        impossible += [f"{called.one.format(term.labels[i])} {percent(measured[i])}" for i in beyond]
    if not impossible:
        return ""
    return (
        f"No rope passes on more force than goes in, but these readings say so beyond their noise: {few(impossible)}. "
        "The usual causes are swapped columns or channels, pull and return exchanged, a unit, or a channel that is no "
        "force: look at these with `bowdenfit check`."
    )


def describe_implausible_friction(fit: Record) -> str:
    """Describe coefficients outside the range of ropes in sheaths; empty where there are none.

    A coefficient of which something is stated is believed. What is too large counts by its estimate, what is too small by the
    upper end of its 90 % interval, because a contact may rub too little to be seen.
    """
    implausible, default = [], PriorDefaults().friction
    for p in fit.model.space.free:
        has_default_prior = (
            p.prior == LogNormal(default.median, default.log_sd) and p.name not in fit.dataset.description.friction
        )
        if p.role != "friction" or not has_default_prior:
            continue
        if fit.sampled is None:
            estimate = fit.least_squares.estimates[p.name]
            value, upper = (
                estimate.value,
                estimate.value + estimate.reach if np.isnan(estimate.upper) else estimate.upper,
            )
        else:
            value, upper = fit.parameter(p.name).median, fit.parameter(p.name).q95
        if value > _MOST or upper < _LEAST:
            implausible.append(f"{p.name} = {value:.2g}")
    if not implausible:
        return ""
    return (
        f"Ropes in sheaths have coefficients of {_LEAST:g} to {_MOST:g}, and these readings say {', '.join(implausible)}. The "
        "usual causes are the unit of the wrap angles (rad for deg), a contact that was left out, and a slipped decimal point "
        "in a reading; if it is right, say so: [friction.NAME] prior = { lognormal = { median = ..., log_sd = ... } }."
    )


def _predicted(fit: Record, term: Term) -> np.ndarray:
    if fit.sampled is None:
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
    elif fit.sampled is not None:
        value = float(np.median(fit.posterior.values[noise]))
    else:
        cells = np.asarray(term.data["weight"])
        value = float(np.sqrt(np.sum(term.data["scatter"]) / max(np.sum(term.data["n"]) - np.sum(cells > 0), 1.0)))
    return np.asarray(value / np.sqrt(weight))
