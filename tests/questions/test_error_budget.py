"""The error budget: slopes of the answers by errors of the bench agree with fits of tables that have these errors."""

from dataclasses import replace

import numpy as np
import pytest

import bowdenfit as bf
from bowdenfit.description.defaults import BenchErrors
from bowdenfit.inference.degrees_of_freedom import fit_t_distribution
from bowdenfit.inference.interval import Interval
from bowdenfit.kinds.bench_error import BenchError
from bowdenfit.kinds.rows import OwnAngles
from bowdenfit.questions.error_budget import ErrorBudget
from bowdenfit.questions.length import efficiency_figure
from bowdenfit.questions.summary import coefficients_figure, pairs_figure

MU, BENDS, LOADS = 0.12, (90.0, 90.0, 180.0, 180.0, 270.0, 270.0), (20.0, 50.0, 100.0)


def bench(path, scale=1.0, hysteresis=0.0, noise=0.005, angles=True):
    """Write a table of six mountings, whose angles are read a factor too large, or whose output cell has hysteresis."""
    rng, rows = np.random.default_rng(3), ["run,stroke,input_force_N,output_force_N" + ",wrap_angle_deg" * angles]
    for number, bend in enumerate(BENDS if angles else (180.0,) * 6):
        mounting = rng.normal(0, 0.02 if noise > 1e-3 else 0.001)
        for stroke in (1, -1):
            for load in LOADS:
                exponent = MU * np.radians(bend) + mounting
                output = load * np.exp(-stroke * exponent) * (1 + rng.normal(0, noise)) * (1 - hysteresis * stroke / 2)
                row = f"r{number},{'pull' if stroke > 0 else 'return'},{load},{output:.6f}"
                rows.append(row + f",{bend * scale:.4f}" * angles)
    path.write_text("\n".join(rows) + "\n")
    return path


@pytest.fixture(scope="module")
def fit(tmp_path_factory):
    return bf.fit(bench(tmp_path_factory.mktemp("bench") / "table.csv"), seed=1)


def budget_of(fit) -> ErrorBudget:
    assert fit.error_budget is not None
    return fit.error_budget


@pytest.mark.parametrize(
    ("error", "limit", "source"), [({"scale": 1.03}, 0.03, "wrap angles"), ({"hysteresis": 0.015}, 0.015, "hysteresis")]
)
def test_a_slope_is_the_shift_of_a_fit_with_that_error(fit, tmp_path, error, limit, source):
    shifted = bf.fit(bench(tmp_path / "table.csv", **error), seed=1)
    row = budget_of(fit).row("mu")
    moved = abs(shifted.parameter_of_draws("mu").mean - fit.parameter_of_draws("mu").mean)
    cells = np.sqrt(2) if source == "hysteresis" else 1.0  # two load cells have an error each
    assert row.shifts[source] * np.sqrt(3) / cells == pytest.approx(moved, abs=0.15 * row.readings.sd), limit


def test_uncertainties_add_as_in_the_gum(fit):
    """Sources are not independent once readings reveal something of their sum, which is little here."""
    row = budget_of(fit).row("mu")
    added = np.sqrt(sum(shift**2 for shift in row.shifts.values()))
    assert row.bench.sd == pytest.approx(np.hypot(row.readings.sd, added), rel=0.1)
    assert row.coverage_factor == pytest.approx(1.6, abs=0.15)
    assert row.degrees_of_freedom > fit_t_distribution(fit.draws().values["mu"].ravel())[1]  # limits have infinitely many
    assert row.bench.q05 < row.readings.q05 < row.readings.median < row.readings.q95 < row.bench.q95


def test_a_constant_angle_has_its_error_too(tmp_path):
    fit = bf.fit(bench(tmp_path / "table.csv", angles=False), seed=1, wrap_angle="180deg")
    row = budget_of(fit).row("mu")
    assert row.shifts["wrap angles"] == pytest.approx(row.readings.median * np.hypot(0.03, 3 / 180) / np.sqrt(3), rel=0.1)


def test_the_first_page_of_a_precise_bench_has_the_interval_with_bench_errors_and_says_so(tmp_path):
    fit = bf.fit(bench(tmp_path / "table.csv", noise=5e-4), seed=1)
    page, row = " ".join(str(fit).split()), budget_of(fit).row("mu")
    assert row.is_notable
    assert f"coefficient of friction {row.bench}." in page
    assert "These intervals include bench errors, mainly wrap angles known to 3 deg and 3 % ([errors] in cable.toml);" in page
    assert f"readings alone say {row.readings.range_text(row.readings.digits)} for mu." in page
    assert fit.summary()["error_budget"]["rows"][0]["bench"]["q05"] < fit.parameter_of_draws("mu").q05
    assert fit.parameter("mu") == row.bench


def test_the_first_page_of_a_scattering_bench_has_that_interval_too(fit):
    row = budget_of(fit).row("mu")
    assert "bench" not in str(fit)
    assert row.bench.range_text(row.bench.digits) in str(fit)
    assert "add less than half to each interval" in budget_of(fit).sentences()[0]


def test_without_errors_of_the_bench_the_first_page_has_the_interval_of_the_readings(tmp_path):
    fit = bf.fit(bench(tmp_path / "table.csv", noise=5e-4), seed=1, errors="none")
    interval = fit.parameter("mu")
    assert fit.error_budget is None
    assert interval.range_text(interval.digits) in str(fit)


def test_the_best_length_includes_them_and_stays_within_its_range(quick_fit):
    best, budget = quick_fit.optimal_length(), budget_of(quick_fit)
    length, efficiency = (budget.row(f"optimal_{name}") for name in ("length", "efficiency"))
    assert (best.length, best.efficiency) == (length.bench, efficiency.bench)
    assert best.length != length.readings  # by less than the Monte Carlo error of its width
    assert best.efficiency.sd > 1.2 * efficiency.readings.sd
    description = quick_fit.dataset.description
    wrong = description.model_copy(update={"errors": BenchErrors(angle_scale=50, gain=9)})
    wide = replace(quick_fit, dataset=replace(quick_fit.dataset, description=wrong)).optimal_length()
    low, high = description.route.range
    assert low <= wide.length.q05 < best.length.q05 and best.length.q95 < wide.length.q95 <= high
    assert wide.efficiency.q95 <= 1


def test_stated_errors_replace_the_usual_ones_or_leave_the_budget(tmp_path):
    path = bench(tmp_path / "table.csv", noise=5e-4)
    settings = ["errors.angle_scale=0", "errors.angle={value=0,unit='deg'}", "errors.hysteresis=0.001"]
    settings += ["errors.wear=0", "errors.load_exponent=0", "errors.compression=0", "errors.zero=0"]
    settings += ["sensors.input_gain_error_sd=0.001", "sensors.output_gain_error_sd=0.001"]
    row = budget_of(bf.fit(path, seed=1, settings=settings)).row("mu")
    assert set(row.shifts) == {"hysteresis"}
    assert not row.is_notable


@pytest.mark.parametrize(
    ("setting", "message"), [("errors.angle={value=3,unit='N'}", "N"), ("errors.gain=-0.1", "gain"), ("errors.gains=1", "gain")]
)
def test_an_error_that_cannot_be_is_refused(tmp_path, setting, message):
    with pytest.raises(bf.BowdenfitError, match=message):
        bf.read(bench(tmp_path / "table.csv"), settings=[setting])


def test_an_error_moves_forces_and_angles_as_a_bench_shows_them():
    error = BenchError(gain=0.01, hysteresis=0.02, angle_scale=0.03, angle_offset=0.1)
    assert error.apply_to_force(np.array([100.0, 100.0]), np.array([1, -1])) == pytest.approx([99.99, 102.01])
    angles = OwnAngles(("bend",), np.array([[1.0], [1.0], [0.0], [np.nan]]), np.array([[np.nan], [0.1], [np.nan], [np.nan]]))
    assert error.apply_to_rows(angles).angle.ravel() == pytest.approx([1.13, 1.0, 0.0, np.nan], nan_ok=True)


def test_every_place_that_shows_an_answer_shows_the_same_interval(quick_fit):
    mu, best = quick_fit.parameter("mu3"), quick_fit.optimal_length()
    assert mu == budget_of(quick_fit).row("mu3").bench != quick_fit.parameter_of_draws("mu3")
    row = quick_fit.summary()["parameters"]["mu3"]
    assert (row["median"], row["q05"], row["q95"]) == (mu.median, mu.q05, mu.q95)
    assert Interval.of(coefficients_figure.data(quick_fit)[2].draws) == mu
    assert [Interval.of(q.draws) for q in pairs_figure.data(quick_fit).quantities[:3]] == [
        quick_fit.parameter(name) for name in ("mu1", "mu2", "mu3")
    ]
    along = efficiency_figure.data(quick_fit)
    assert Interval.of(along.optimal_length) == best.length
    shown = [np.interp(470.0, along.efficiency.route, along.efficiency.quantiles[i]) for i in (0, 2, 4)]
    (there,) = quick_fit.efficiency(470.0)
    assert shown == pytest.approx([there.q05, there.median, there.q95], abs=1e-3)
    assert quick_fit.summary()["loss"]["at"] == f"at {best.length.median:.0f} mm"
