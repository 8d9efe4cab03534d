"""The coefficients of a fit as a table of LaTeX, to be put into a paper."""

from bowdenfit.questions.summary.brief import key_quantities
from bowdenfit.results.record import Record

_ESCAPED = {
    "\\": r"\textbackslash{}", "&": r"\&", "%": r"\%", "$": r"\$", "#": r"\#", "_": r"\_", "{": r"\{", "}": r"\}",
    "~": r"\textasciitilde{}", "^": r"\textasciicircum{}", "<": r"\textless{}", ">": r"\textgreater{}",
}  # fmt: skip


def latex_table(fit: Record) -> str:
    """The coefficients of a fit, as the first page of the summary shows them, as a `tabular` of LaTeX with booktabs' rules.

    Args:
        fit: The fit.
    """
    rows = [(q.name, q.value, q.interval, q.unit, q.description) for q in key_quantities(fit)]
    lines = [" & ".join(escape_latex(cell) for cell in row) + r" \\" for row in rows]
    heads = r"coefficient & value & 90\,\% interval & unit & \\"
    return "\n".join([r"\begin{tabular}{lrlll}", r"\toprule", heads, r"\midrule", *lines, r"\bottomrule", r"\end{tabular}", ""])


def escape_latex(text: str) -> str:
    """A text in which nothing is a command of LaTeX.

    Args:
        text: The text.
    """
    return "".join(_ESCAPED.get(character, character) for character in text)
