"""The capstan experiment of `datasets/yarn-on-cylinder`: what its README prints, computed again without the package.

Every number is formatted here as the README prints it and looked up there, so that neither can change alone.
"""

import csv
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from figure_words import assert_readable
from scipy import stats
from terminal_pages import faults

import bowdenfit
from bowdenfit.dataset import Dataset
from bowdenfit.finished_fit import Fit
from bowdenfit.kinds.forces.table import ForceTable
from bowdenfit.questions.figures import collect_figure_data
from bowdenfit.questions.summary.brief import summary_text

FOLDER = Path(__file__).parents[2] / "datasets" / "yarn-on-cylinder"
NOMINAL = np.repeat([45, 90, 135, 180, 225, 270, 315], 3)
SENSOR_NOISE = 0.01  # N
SHORT_CHAIN = ["sampler.n_walkers=64", "sampler.max_steps=3000"]


@pytest.fixture(scope="module")
def readme() -> str:
    """The README, each run of white space one blank."""
    return " ".join((FOLDER / "README.md").read_text().split())


@pytest.fixture(scope="module")
def trials() -> dict[str, np.ndarray]:
    """The columns of forces.csv as numbers, read without the package."""
    lines = [line for line in (FOLDER / "forces.csv").read_text().splitlines() if not line.startswith("#")]
    rows = list(csv.DictReader(lines))
    names = {"load": "input_force_N", "held": "output_force_N", "angle": "wrap_angle_rad", "sd": "wrap_angle_sd_rad"}
    return {name: np.array([float(row[column]) for row in rows]) for name, column in names.items()}


@pytest.fixture(scope="module")
def fit() -> Fit:
    """The data set fitted with a short chain."""
    return bowdenfit.fit(FOLDER, seed=1, settings=SHORT_CHAIN)


@pytest.mark.extended
def test_the_summary_is_one_page_that_says_whether_a_trial_is_off(fit):
    """The first trial at 225 deg is at the border of it, by a short chain on this side or that."""
    page = summary_text(fit)
    assert faults(page) == []
    assert ("None of the 21 readings is an outlier." in page) == (not fit.checks.outliers)
    assert ("Next: look at how run 225 deg trial 1 was measured" in page) == bool(fit.checks.outliers)


@pytest.mark.extended
def test_its_figures_can_be_read(fit):
    shown = dict(collect_figure_data(fit))
    assert {"forces", "residuals", "coefficients", "pairs", "traces", "checks"} <= set(shown)
    assert_readable(shown, fit.name)


def through_origin(x: np.ndarray, y: np.ndarray) -> tuple[float, float, float]:
    """Slope of a straight line through the origin, its standard error, and the scatter about the line."""
    slope = x @ y / (x @ x)
    scatter = np.sqrt(np.sum((y - slope * x) ** 2) / (len(y) - 1))
    return float(slope), float(scatter / np.sqrt(x @ x)), float(scatter)


def log_ratio(trials: dict[str, np.ndarray]) -> np.ndarray:
    return np.log(trials["load"] / trials["held"])


def test_the_table_has_three_pulling_trials_at_each_of_seven_angles_each_a_run_of_its_own():
    data = bowdenfit.read(FOLDER)
    forces = data.measurements.table(ForceTable)
    assert len(forces.run_names) == len(forces.input_force) == 21
    assert np.all(forces.stroke == 1) and np.all(forces.output_force < forces.input_force)
    angle, sd = forces.own.column("wrap_angle")
    assert len(np.unique(angle)) == 7 and np.all((sd > 0.006) & (sd < 0.012))
    assert all(str(nominal) in name for nominal, name in zip(NOMINAL, forces.run_names, strict=True))


def test_a_straight_line_through_the_origin_gives_the_printed_coefficient(trials, readme):
    y, angle = log_ratio(trials), trials["angle"]
    mu, error, scatter = through_origin(angle, y)
    explained = 1 - np.sum((y - mu * angle) ** 2) / np.sum((y - y.mean()) ** 2)
    assert f"mu = {mu:.4f} +- {error:.4f}, R2 {explained:.3f}, scatter {100 * scatter:.1f} %" in readme
    rms = np.sqrt(np.mean((trials["held"] - trials["load"] * np.exp(-mu * angle)) ** 2))
    assert f"| {rms:.3f} N |" in readme


def test_the_least_squares_of_the_fit_is_that_straight_line(trials, fit, readme):
    """Weights differ a little from row to row (sensor noise and angle errors), hence not the last digit."""
    mu, error, _ = through_origin(trials["angle"], log_ratio(trials))
    estimate = fit.least_squares.estimates["mu"]
    assert estimate.identified
    assert estimate.value == pytest.approx(mu, abs=1e-4)
    assert estimate.standard_error == pytest.approx(error, rel=0.01)
    assert f"| {estimate.value:.4f} +- {estimate.standard_error:.4f} | 0.1769 to 0.1847 |" in readme


def test_a_short_chain_gives_the_printed_intervals(fit, readme):
    """Tolerances are four Monte Carlo errors of 1000 effective draws; seeded, so it never fails by chance."""
    assert fit.converged, fit.reasons
    mu, alone, tau = fit.parameter("mu"), fit.parameter_of_draws("mu"), fit.parameter("tau")
    assert "| 0.1808 (0.1757 to 0.1860) |" in readme and "| 0.1808 (0.1769 to 0.1847) |" in readme
    assert [mu.median, mu.q05, mu.q95] == pytest.approx([0.1808, 0.1757, 0.1860], abs=8e-4)
    assert "| 0.0373 (0.0293 to 0.0494) of" in readme
    assert [alone.median, alone.q05, alone.q95] == pytest.approx([0.1808, 0.1769, 0.1847], abs=6e-4)
    assert [tau.median, tau.q05, tau.q95] == pytest.approx([0.0373, 0.0293, 0.0494], abs=15e-4)


def with_samples(data: Dataset, n_samples: int, independent: bool) -> Dataset:
    """Each trial drawn out to its window of samples, sensor noise added; each sample a run if independent."""
    forces = data.measurements.table(ForceTable)
    rows = np.repeat(np.arange(21), n_samples)
    noise = np.random.default_rng(1).normal(0.0, SENSOR_NOISE, (21, n_samples))
    held = forces.output_force[:, None] + noise - noise.mean(axis=1, keepdims=True)
    run = np.arange(len(rows)) if independent else rows
    columns = {name: column[rows] for name, column in vars(forces).items() if isinstance(column, np.ndarray)}
    columns |= {"output_force": held.ravel(), "run": run}
    own_angles = replace(forces.own, angle=forces.own.angle[rows], sd=forces.own.sd[rows])
    origin = replace(forces.origin, file=forces.origin.file[rows], row=forces.origin.row[rows])
    names = tuple(str(i) for i in range(run.max() + 1))
    drawn_out = replace(forces, **columns, run_names=names, own=own_angles, origin=origin)
    return replace(data, measurements=data.measurements.with_tables(drawn_out))


def test_501_samples_a_trial_taken_as_independent_claim_the_printed_error(trials, readme):
    """By hand, 10 s at 50 Hz. Seeded, so it never fails by chance; sensor noise hardly matters beside the trials' scatter."""
    _, ours, _ = through_origin(trials["angle"], log_ratio(trials))
    held = trials["held"] + np.random.default_rng(1).normal(0.0, SENSOR_NOISE, (501, 21))
    angles = np.broadcast_to(trials["angle"], held.shape)
    mu, claimed, _ = through_origin(angles.ravel(), np.log(trials["load"] / held).ravel())
    assert ours / claimed > 20
    assert f"an error {ours / claimed:.0f} times smaller" in readme
    assert claimed == pytest.approx(0.0001, abs=5e-6) and "taken as independent | 0.1808 +- 0.0001 |" in readme


@pytest.mark.extended
def test_fitted_as_independent_49_samples_a_trial_make_the_error_seven_times_smaller(fit):
    """The negative control of the run effect, in the package. Seeded, so it never fails by chance."""
    claimed = bowdenfit.fit(with_samples(fit.dataset, 49, independent=True), mcmc=False, seed=1)
    ours = fit.least_squares.estimates["mu"].standard_error
    assert ours / claimed.least_squares.estimates["mu"].standard_error > 6.8


def test_samples_that_name_their_run_leave_the_answer_as_it_is(fit):
    """Seeded, so it never fails by chance."""
    long = bowdenfit.fit(with_samples(fit.dataset, 501, independent=False), mcmc=False, seed=1)
    estimate, ours = long.least_squares.estimates["mu"], fit.least_squares.estimates["mu"]
    assert estimate.value == pytest.approx(ours.value, abs=1e-4)
    assert estimate.standard_error == pytest.approx(ours.standard_error, rel=0.01)


def test_coefficients_and_residuals_of_the_single_trials_are_as_printed(trials, readme):
    y, angle = log_ratio(trials), trials["angle"]
    mu, _, _ = through_origin(angle, y)
    for nominal in np.unique(NOMINAL):
        mask = nominal == NOMINAL
        theta = angle[mask][0]
        cells = [f"{nominal}", f"{np.rad2deg(theta):.1f}", *(f"{x:.4f}" for x in y[mask] / theta)]
        cells += [f"{np.mean(y[mask] - mu * theta):+.4f}", f"{np.std(y[mask], ddof=1):.4f}"]
        assert f"| {' | '.join(cells)} |" in readme


def test_residuals_have_no_trend_but_scatter_more_above_half_a_turn(trials, readme):
    y, angle = log_ratio(trials), trials["angle"]
    line = stats.linregress(angle, y)
    assert f"intercept {line.intercept:.3f} +- {line.intercept_stderr:.3f}" in readme
    assert f"slope {line.slope:.3f} +- {line.stderr:.3f}" in readme
    variance = np.var(y.reshape(7, 3), axis=1, ddof=1)
    below, above = variance[:4].mean(), variance[4:].mean()
    assert f"repeat to {100 * np.sqrt(below):.1f} % of the force, above to {100 * np.sqrt(above):.1f} %" in readme
    assert f"(p = {stats.f.sf(above / below, 6, 8):.0e})".replace("e-0", "e-") in readme


def test_other_ways_to_read_the_experiment_give_what_is_printed(trials, readme):
    y, angle = log_ratio(trials), trials["angle"]
    mean_angle, mean = angle.reshape(7, 3).mean(axis=1), y.reshape(7, 3).mean(axis=1)
    mu, error, _ = through_origin(mean_angle, mean)
    assert f"angle means alone give {mu:.4f} +- {error:.4f}" in readme
    lack_of_fit = 3 * np.sum((mean - mu * mean_angle) ** 2) / 6 / np.var(y.reshape(7, 3), axis=1, ddof=1).mean()
    assert f"(p = {stats.f.sf(lack_of_fit, 6, 14):.2f})" in readme
    mu, error, scatter = through_origin(np.deg2rad(NOMINAL), y)
    assert f"nominal ones mu is {mu:.4f} +- {error:.4f}" in readme and f"to {100 * scatter:.1f} %" in readme
    for nominal, words in ((225, "without 225 deg mu is {:.4f}"), (270, "without 270 deg {:.4f}")):
        others_mask = nominal != NOMINAL
        assert words.format(through_origin(angle[others_mask], y[others_mask])[0]) in readme
    lighter, _, _ = through_origin(angle, np.log(0.8 * 9.81 / trials["held"]))
    assert f"with that load mu would be {lighter:.4f}" in readme


def held_posterior(trials: dict[str, np.ndarray]) -> np.ndarray:
    """5, 50 and 95 % quantiles of mu where every row only bounds friction, on a grid of mu and tau under default priors."""
    z = np.linspace(-1.0, 5.0, 3001)
    mu, tau = 0.12 * np.exp(0.7 * z)[:, None], 0.025 * np.tan(np.pi / 2 * (np.arange(400) + 0.5) / 400)  # half-Cauchy
    log_density = -(z[:, None] ** 2) / 2 + np.zeros_like(tau)
    for load, held, angle, sd in zip(*(trials[name] for name in ("load", "held", "angle", "sd")), strict=True):
        spread = np.sqrt(tau**2 + (mu * sd) ** 2 + SENSOR_NOISE**2 * (1 / load**2 + 1 / held**2))
        ratio = np.log(load / held)
        log_density = log_density + np.log(
            np.maximum(
                stats.norm.cdf((mu * angle - ratio) / spread) - stats.norm.cdf((-mu * angle - ratio) / spread), 1e-300
            )
        )
    below = np.cumsum(np.exp(log_density - log_density.max()).sum(axis=1))
    return np.interp([0.05, 0.5, 0.95], below / below[-1], mu[:, 0])


@pytest.mark.extended
def test_taken_as_held_the_readings_only_bound_the_coefficient_from_below(fit, trials, readme):
    low, median, high = held_posterior(trials)
    assert f"the posterior is {median:.2f} ({low:.3f} to {high:.2f})" in readme
    forces = fit.dataset.measurements.table(ForceTable)
    held = replace(forces, stroke=np.zeros_like(forces.stroke))
    as_held = replace(fit.dataset, measurements=fit.dataset.measurements.with_tables(held))
    assert not bowdenfit.fit(as_held, mcmc=False, seed=1).least_squares.estimates["mu"].identified
