"""The table of coefficients for a paper."""

import pytest

import bowdenfit as bf
from bowdenfit.questions.summary.brief import key_quantities
from bowdenfit.questions.summary.latex import escape_latex, latex_table


@pytest.fixture(scope="module")
def fit():
    """A fit without draws."""
    outputs = [15.2, 30.1, 45.6, 15.0, 30.9, 46.0]
    forces = {"input_force_N": [20, 40, 60] * 2, "output_force_N": outputs, "run": [1] * 3 + [2] * 3}
    pandas = pytest.importorskip("pandas")
    return bf.fit(pandas.DataFrame(forces), wrap_angle="180deg", mcmc=False)


def test_each_coefficient_is_a_row_with_the_numbers_of_the_summary(fit):
    table = fit.to_latex()
    rows = [line for line in table.splitlines() if line.endswith(r"\\")][1:]
    assert table == latex_table(fit) and len(rows) == len(key_quantities(fit)) > 0
    for row, quantity in zip(rows, key_quantities(fit), strict=True):
        cells = row.removesuffix(r" \\").split(" & ")
        assert cells[:2] == [escape_latex(quantity.name), escape_latex(quantity.value)]
    assert table.startswith(r"\begin{tabular}") and table.endswith("\\end{tabular}\n")


def test_nothing_in_a_name_is_a_command():
    assert escape_latex(r"mu_1 & 5 % \input{x} $a^2$ #~") == (
        r"mu\_1 \& 5 \% \textbackslash{}input\{x\} \$a\textasciicircum{}2\$ \#\textasciitilde{}"
    )
