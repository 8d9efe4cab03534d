"""How results show themselves in a notebook: small tables without styling of their own."""

from collections.abc import Sequence
from html import escape
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from bowdenfit.results.answers import OptimalLength
    from bowdenfit.results.fit import Fit


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
        verdict = "Least squares only: no intervals."
    else:
        verdict = "Converged." if fit.converged else "NOT converged: " + "; ".join(fit.reasons) + "."
    rows = []
    for name, p in page["parameters"].items():
        drawn = f"{p['median']:.4g} ({p['q05']:.4g} to {p['q95']:.4g})" if "median" in p else ""
        squares = p.get("least_squares", {}).get("value")
        rows.append((name, p["unit"], drawn, f"{squares:.4g}" if squares is not None else "", p["prior"], p["meaning"]))
    heads = ("Parameter", "Unit", "Median (90 % interval)", "Least squares", "Prior", "Meaning")
    optimum = fit.posterior is not None and fit.dataset.description.route is not None
    answer = design_answer(fit.optimal_length()) if optimum else ""
    return f"<h4>{escape(fit.name)}</h4><p>{escape(verdict)}</p>{table(heads, rows)}{answer}"


def table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """An HTML table."""
    head = "".join(f"<th>{escape(cell)}</th>" for cell in heads)
    body = "".join("<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in rows)
    return f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"
