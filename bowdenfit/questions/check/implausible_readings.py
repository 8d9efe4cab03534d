"""Readings that cannot be right, in sentences: impossible efficiencies, implausible friction, too coarse readings."""

import numpy as np

from bowdenfit.description import PriorDefaults
from bowdenfit.kinds import find_kind, find_readings, iterate_tables
from bowdenfit.kinds.plausibility import GAIN_ERROR, CoarseReadings
from bowdenfit.kinds.runs import RunsData
from bowdenfit.kinds.term import Term
from bowdenfit.parameters.priors import LogNormal
from bowdenfit.results.record import Record
from bowdenfit.words import few, percent

_MAX_DEVIATIONS = 4.5  # standard deviations of noise above what is possible; 1 healthy reading of 300,000 exceeds them
_LEAST, _MOST = 0.015, 1.0  # coefficients; a judgement: outside them a mistake is likelier than such a rope
_SHARE = 0.5  # of what the last digit leaves open, below which an interval is too narrow; a judgement


def describe_impossible_efficiencies(fit: Record) -> str:
    """Describe efficiencies above 1 and above the prediction, beyond noise; empty where there are none."""
    impossible = []
    for term in fit.model.terms:
        called = find_readings(term.name)
        if not called.are_efficiencies:
            continue
        measured, predicted = term.observed(), _predicted_readings(fit, term)
        above = np.log(measured / np.maximum(predicted, 1.0))  # offsets and gains of the cells may show more than 1
        beyond = np.flatnonzero(above > GAIN_ERROR + _MAX_DEVIATIONS * _noise_in_log(fit, term))
        impossible += [f"{called.one.format(term.labels[i])} {percent(measured[i])}" for i in beyond]
    if not impossible:
        return ""
    return (
        f"No rope transmits more force than goes in, but these readings say so beyond their noise: {few(impossible)}. "
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
            value, upper = fit.parameter_of_draws(p.name).median, fit.parameter_of_draws(p.name).q95
        if value > _MOST or upper < _LEAST:
            implausible.append(f"{p.name} = {value:.2g}")
    if not implausible:
        return ""
    return (
        f"Ropes in sheaths have friction coefficients of {_LEAST:g} to {_MOST:g}; these readings give "
        f"{', '.join(implausible)}. The usual causes are the unit of the wrap angles (rad for deg), a contact that was left "
        "out, and a slipped decimal point in a reading; if it is right, say so: "
        "[friction.NAME] prior = { lognormal = { median = ..., log_sd = ... } }."
    )


def _predicted_readings(fit: Record, term: Term) -> np.ndarray:
    """Return the expected readings of a term: medians of the draws, or least squares without draws."""
    if fit.sampled is None:
        return fit.least_squares.readings[term.name]
    return np.asarray(np.median(fit.posterior.expected[term.name], axis=(0, 1)))


def _noise_in_log(fit: Record, term: Term) -> np.ndarray | float:
    """Return what noise of the forces adds to the log of each reading; a mounting cannot take friction below none."""
    weight, noise = getattr(term.data, "run_weight", None), getattr(term, "reading_noise", "")
    if weight is None:
        return np.asarray(getattr(term.data, "log_sd", 0.0))
    fixed = {p.name: p.fixed for p in fit.model.space.fixed}
    if noise in fixed:
        value = float(fixed[noise] or 0.0)
    elif fit.sampled is not None:
        value = float(np.median(fit.posterior.values[noise]))
    else:
        runs: RunsData = term.data
        value = float(np.sqrt(np.sum(runs.scatter) / max(np.sum(runs.n) - np.sum(runs.cells.weight > 0), 1.0)))
    return np.asarray(value / np.sqrt(weight))


def describe_coarse_readings(fit: Record) -> tuple[str, ...]:
    """Describe tables whose repeated readings are equal to the last digit while intervals are narrower than that digit allows.

    The average of independent errors of rounding in so many different readings, spread over the coefficients, is what the fit
    must leave open of the readings that it expects; without draws nothing is said.
    """
    if fit.sampled is None:
        return ()
    coefficients = sum(p.role == "friction" for p in fit.model.space.free)
    sentences = []
    for kind, table in iterate_tables(fit.dataset.measurements):
        coarse = kind.coarse_readings(table)
        terms = [term for term in fit.model.terms if find_kind(term.name) is kind and term.name in fit.posterior.expected]
        if coarse is None or not terms:
            continue
        left_open = coarse.log_sd * np.sqrt(min(coefficients / coarse.different, 1.0))
        if all(_log_sd(fit, term) < _SHARE * left_open for term in terms):
            sentences.append(_coarse_sentence(coarse, terms[0]))
    return tuple(sentences)


def _log_sd(fit: Record, term: Term) -> float:
    """Return the standard deviation of log expected readings, averaged over them; infinite where logarithms do not exist."""
    expected = fit.posterior.expected[term.name].reshape(-1, len(term.labels))
    if not np.all(expected > 0):
        return float("inf")
    return float(np.sqrt(np.mean(np.var(np.log(expected), axis=0))))


def _coarse_sentence(coarse: CoarseReadings, term: Term) -> str:
    """Return the sentence about readings that are too coarse, with a remedy."""
    noise = getattr(term, "reading_noise", "")
    stated = (
        f"[prior.{noise}] fixed = {coarse.sd:.2g} in cable.toml"
        if noise
        else f"a column efficiency_sd with {coarse.sd:.2g}"
    )
    return (
        f"Repeated readings in {coarse.file} agree to the last digit, {coarse.last_digit}, so they do not show how much "
        "readings scatter. The intervals assume almost no scatter, while rounding to the last digit alone leaves a reading "
        f"uncertain by up to {percent(np.sqrt(3) * coarse.log_sd)} either way. Record one more digit; or keep one of each "
        f"reading and state its standard deviation: {stated}."
    )
