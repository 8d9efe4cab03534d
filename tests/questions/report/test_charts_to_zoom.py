"""Charts of a report that are zoomed into: they hold the numbers of the figures that they stand for."""

import numpy as np
import pytest

from bowdenfit.inference.interval import Interval
from bowdenfit.questions.length import efficiency_figure
from bowdenfit.questions.length.efficiency_figure import EfficiencyPoints, make_efficiency_chart
from bowdenfit.questions.loss import ContactShare, LossByContact, make_loss_chart
from bowdenfit.questions.summary.coefficients_figure import Coefficient, make_coefficient_charts
from bowdenfit.questions.summary.pairs_figure import FILLS, Pairs, SampledQuantity, find_region_edges, make_pair_charts
from bowdenfit.questions.summary.residuals_figure import Residuals, make_residual_charts


def correlated_quantities(n=60_000):
    """Three quantities: the first two correlated by -0.8, the third by itself."""
    draws = np.random.default_rng(4).multivariate_normal([1, 5, 0], [[0.04, -0.16, 0], [-0.16, 1, 0], [0, 0, 1]], n).T
    names = ((r"$\mu_1$", r"$\mu_1$ (1)"), ("", "Efficiency at\noptimum (%)"), ("$c$", "$c$ (N)"))
    pairs = zip(names, draws, strict=True)
    return [SampledQuantity(label, row.reshape(60, -1), (-np.inf, np.inf), symbol) for (symbol, label), row in pairs]


def test_the_areas_of_two_quantities_hold_the_share_of_the_draws_that_they_name():
    across, up, _ = correlated_quantities()
    x, edges = find_region_edges(across, up)
    for share in FILLS:
        low, high = (np.interp(across.draws, x, np.nan_to_num(edge, nan=np.inf), np.nan, np.nan) for edge in edges[share])
        inside = np.mean((low <= up.draws) & (up.draws <= high))
        assert inside == pytest.approx(share, abs=0.025)


def test_the_most_correlated_pair_comes_first_and_labels_are_plain_text():
    charts = make_pair_charts(Pairs(correlated_quantities()))
    assert len(charts) == 3
    assert charts[0].name == "\u03bc1 and Efficiency at optimum (%), correlation \u22120.80"
    assert (charts[0].x_label, charts[0].y_label) == ("\u03bc1 (1)", "Efficiency at optimum (%)")


def test_a_quantity_that_never_moves_has_charts_too():
    still = SampledQuantity("$a$", np.ones((60, 50)), (0.0, np.inf), "$a$")
    assert len(make_pair_charts(Pairs([still, *correlated_quantities(3000)]))) == 6


def test_the_chart_of_a_coefficient_has_its_interval_its_median_and_least_squares():
    draws, prior = (np.random.default_rng(2).normal(0.1, sd, (10, 2000)) for sd in (0.01, 0.1))
    near, far = (Coefficient(r"$\mu_1$", "1", draws, np.abs(prior), value, 0.012, "friction") for value in (0.105, 0.9))
    with_estimate, without = (chart.spans for chart in make_coefficient_charts((near, far)))
    assert (with_estimate[0].start, with_estimate[0].stop) == tuple(np.quantile(draws, (0.05, 0.95)))
    assert with_estimate[1].start == np.median(draws)
    assert (with_estimate[2].label, with_estimate[2].start) == ("Least squares (standard error 0.012)", 0.105)
    assert len(without) == 2


@pytest.mark.parametrize("sampled", [True, False])
def test_the_charts_of_residuals_name_their_rows(sampled):
    quantiles = np.array([[0.7, 0.6], [0.72, 0.62], [0.75, 0.65], [0.78, 0.68], [0.8, 0.7]])
    points = EfficiencyPoints(
        of_runs=False, labels=("row 1", "row 2"), route=np.array([1.0, 2.0]), measured=np.array([0.76, 0.6]),
        predicted=quantiles if sampled else quantiles[2:3], inside=np.array([True, False]),
    )  # fmt: skip
    measured_chart, off = make_residual_charts(Residuals((points,)))
    assert measured_chart.to_json()["names"] == ["row 1", "row 2"]
    series = {(series.label, series.look): series.values for series in off.groups[0].series}
    assert series["Measured", "points"][0] == pytest.approx(1.0)
    assert series["Outside the range of the curves", "hollow"][1] == pytest.approx(-5.0)
    if sampled:
        assert series["Predicted, 90 % interval", "from"] == pytest.approx([-5.0, -5.0])


@pytest.mark.extended
def test_a_reading_outside_the_range_has_the_interval_of_its_prediction(quick_fit):
    (chart,) = make_efficiency_chart(efficiency_figure.data(quick_fit))
    (points,) = [group for group in chart.groups if 550.0 in group.x]
    values = {(series.label, series.look): series.values[points.x == 550.0][0] for series in points.series}
    low, high = values["Predicted there, 90 % interval", "from"], values["Predicted there, 90 % interval", "to"]
    assert 60 < low < values["Predicted there", "hollow"] < high < 76


def test_the_chart_of_the_loss_names_its_contacts():
    draws = {"edge": np.linspace(0.6, 0.7, 101), "bend": np.linspace(0.2, 0.3, 101)}
    shares = tuple(ContactShare(name, Interval.of(values), 0.5) for name, values in draws.items())
    chart = make_loss_chart(LossByContact("at 450 mm", shares))
    assert chart.place_names == ("edge", "bend")
    assert chart.groups[0].series[2].values == pytest.approx([65.0, 25.0])
