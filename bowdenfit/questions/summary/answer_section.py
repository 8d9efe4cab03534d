"""The answer and whether to trust it, at the top of the report."""

from pathlib import Path

from bowdenfit.pages.section import Section, Table
from bowdenfit.questions.summary.answer import answer
from bowdenfit.questions.summary.trust_words import assumed, reasons, trust, warning
from bowdenfit.questions.summary.verdict import verdict
from bowdenfit.results.record import Record


def section(fit: Record) -> Section:
    """What to do or what the coefficients are; of a fit that is not to be trusted that first, and why."""
    found, (first, *others) = verdict(fit), answer(fit)
    choices: tuple[Table, ...] = ()
    if fit.sampled is not None and fit.dataset.description.route is not None:
        best = fit.optimal_length()
        choices = (Table(best.heads, tuple(best.rows), "Lengths that can be bought"),) if best.choices else ()
    context = {
        "trusted": found.trusted,
        "doubtful": bool(found.doubts) or not found.sampled,
        "first": first,
        "others": others,
        "warning": warning(found),
        "why": [each for each in (*trust(fit), assumed(fit)) if each] if found.trusted else reasons(found),
        "choices": choices,
    }
    return Section("The answer", Path(__file__).with_name("answer.html"), context)
