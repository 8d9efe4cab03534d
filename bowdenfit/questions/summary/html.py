"""How results show themselves in a notebook: small tables without styling of their own."""

from collections.abc import Sequence
from html import escape
from typing import TYPE_CHECKING, Any

from bowdenfit.words import decimals

if TYPE_CHECKING:
    from bowdenfit.results.length import OptimalLength
    from bowdenfit.results.record import Fit


def design_answer(answer: "OptimalLength") -> str:
    """The optimal length with its choices."""
    sentences = [line for line in answer.lines() if line and "P(best)" not in line]
    sentences = sentences[: len(sentences) - len(answer.choices)] if answer.choices else sentences
    text = "".join(f"<p>{escape(line)}</p>" for line in sentences)
    rows = [
        (f"{c.length:g}", f"{c.probability_best:.1%}", f"{100 * c.expected_regret:.2f} points") for c in answer.choices
    ]
    heads = (
        f"{answer.variable.replace('_', ' ').capitalize()} ({answer.unit})",
        "P(best)",
        "Expected loss of efficiency",
    )
    return text + (table(heads, rows) if rows else "")


def fit_page(fit: "Fit") -> str:
    """Verdict, friction coefficients and design answer of a fit."""
    page = fit.summary()
    if fit.posterior is None:
        verdict = "Least squares only: no posterior."
    else:
        verdict = "Converged." if fit.converged else "NOT converged: " + "; ".join(fit.reasons) + "."
    rows = [_parameter_row(name, p) for name, p in page["parameters"].items()]
    heads = ("Parameter", "Unit", "Median (90 % interval)", "Least squares (90 % profile interval)", "Prior", "Meaning")
    optimum = fit.posterior is not None and fit.dataset.description.route is not None
    answer = design_answer(fit.optimal_length()) if optimum else ""
    return f"<h4>{escape(fit.name)}</h4><p>{escape(verdict)}</p>{table(heads, rows)}{answer}"


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


def table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """An HTML table."""
    head = "".join(f"<th>{escape(cell)}</th>" for cell in heads)
    body = "".join(
        "<tr>" + "".join(f'<td style="white-space:nowrap">{escape(cell)}</td>' for cell in row) + "</tr>"
        for row in rows
    )
    return f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"
