"""Intervals narrower than the last digit of the readings allows, in sentences for the verdict."""

import numpy as np

from bowdenfit.kinds import find_kind, iterate_tables
from bowdenfit.kinds.plausibility import CoarseReadings
from bowdenfit.kinds.term import Term
from bowdenfit.results.record import Record
from bowdenfit.words import percent

_SHARE = 0.5  # of what the last digit leaves open, below which an interval is too narrow


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
    """Standard deviation of the logarithms of what is expected, on average of the readings; infinite of what has none."""
    expected = fit.posterior.expected[term.name].reshape(-1, len(term.labels))
    if not np.all(expected > 0):
        return float("inf")
    return float(np.sqrt(np.mean(np.var(np.log(expected), axis=0))))


def _coarse_sentence(coarse: CoarseReadings, term: Term) -> str:
    noise = getattr(term, "reading_noise", "")
    stated = (
        f"[prior.{noise}] fixed = {coarse.sd:.2g} in cable.toml"
        if noise
        else f"a column efficiency_sd with {coarse.sd:.2g}"
    )
    return (
        f"Whatever was read more than once in {coarse.file} is alike to the last digit, {coarse.last_digit}, and does not show "
        "how much readings scatter. Intervals take it for next to nothing, while the last digit alone leaves a reading open by "
        f"{percent(np.sqrt(3) * coarse.log_sd)} up or down. Read one more digit; or keep one of each reading and state how far "
        f"it may be off: {stated}."
    )
