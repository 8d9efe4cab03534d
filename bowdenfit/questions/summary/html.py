"""How a fit shows itself in a notebook: small tables without styling of their own."""

from html import escape
from typing import Any

from bowdenfit.questions.summary.page import summarize
from bowdenfit.results.record import Record
from bowdenfit.words import decimals, html_table


def fit_page(fit: Record) -> str:
    """Verdict, friction coefficients and design answer of a fit."""
    page = summarize(fit)
    if fit.posterior is None:
        verdict = "Least squares only: no posterior."
    else:
        verdict = "Converged." if fit.converged else "NOT converged: " + "; ".join(fit.reasons) + "."
    rows = [_parameter_row(name, p) for name, p in page["parameters"].items()]
    heads = ("Parameter", "Unit", "Median (90 % interval)", "Least squares (90 % profile interval)", "Prior", "Meaning")
    optimum = fit.posterior is not None and fit.dataset.description.route is not None
    answer = fit.optimal_length()._repr_html_() if optimum else ""
    return f"<h4>{escape(fit.name)}</h4><p>{escape(verdict)}</p>{html_table(heads, rows)}{answer}"


def _parameter_row(name: str, p: dict[str, Any]) -> tuple[str, ...]:
    drawn, squares = "", ""
    if "median" in p:
        digits = decimals(p["sd"])
        drawn = f"{p['median']:.{digits}f} ({p['q05']:.{digits}f} to {p['q95']:.{digits}f})"
    estimate = p.get("least_squares")
    if estimate is not None:
        squares = _least_squares(estimate)
    return name, "" if p["unit"] == "1" else p["unit"], drawn, squares, p["prior"], p["meaning"]


def _least_squares(estimate: dict[str, Any]) -> str:
    """Least-squares estimate with its profile interval."""
    if not estimate["identified"]:
        return "at bound" if estimate["at_bound"] else "not identified"
    value, lower, upper = (estimate[key] for key in ("value", "lower", "upper"))
    if lower is None or upper is None:
        return f"{value:.4g}"
    digits = decimals(estimate["standard_error"] or abs(value) / 1000)
    return f"{value:.{digits}f} ({lower:.{digits}f} to {upper:.{digits}f})"
