"""How a fit shows itself in a notebook: small tables without styling of their own."""

from html import escape

from bowdenfit.questions.summary.parameter_words import drawn_intervals, parameter_cells
from bowdenfit.results.record import Record
from bowdenfit.words import html_table


def fit_page(fit: Record) -> str:
    """Verdict, friction coefficients and design answer of a fit."""
    drawn, estimates = drawn_intervals(fit), fit.least_squares.estimates
    if fit.sampled is None:
        verdict = "Least squares only: no posterior."
    else:
        verdict = "Converged." if fit.converged else "NOT converged: " + "; ".join(fit.reasons) + "."
    rows = [parameter_cells(p, drawn.get(p.name), estimates.get(p.name)) for p in fit.model.space.parameters]
    heads = ("Parameter", "Unit", "Median (90 % interval)", "Least squares (90 % profile interval)", "Prior", "Meaning")
    optimum = fit.sampled is not None and fit.dataset.description.route is not None
    answer = fit.optimal_length()._repr_html_() if optimum else ""
    return f"<h4>{escape(fit.name)}</h4><p>{escape(verdict)}</p>{html_table(heads, rows)}{answer}"
