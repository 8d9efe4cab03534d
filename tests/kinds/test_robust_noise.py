"""Student-t noise: its functions against SciPy's, one model for likelihood and residuals, and what a bad reading does."""

import shutil
from dataclasses import replace
from functools import cache
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from cables import cable
from scipy import stats

import bowdenfit as bf
from bowdenfit.cable.sensors import NormalNoise, StudentNoise, noise_law, scatter
from bowdenfit.dataset import Dataset, load_dataset
from bowdenfit.inference.compilation import compile_program
from bowdenfit.inference.least_squares import find_maximum_posterior
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.inference.objective import make_objective
from bowdenfit.kinds.forces.table import ForceTable
from bowdenfit.kinds.rows import OwnAngles, RowOrigin
from bowdenfit.kinds.tables import Measurements, PreloadTable
from bowdenfit.models import Model, build_model
from bowdenfit.physics.distributions import (
    log_student_cdf,
    log_student_density,
    student_bound_residual,
    student_residual,
)
from fits import NO_DEPARTURES

pytestmark = pytest.mark.extended

MU_NAMES = ("mu1", "mu2", "mu3")
ROOT = Path(__file__).parents[2]
FREEDOMS = pytest.mark.parametrize("freedom", [2, 4, 10, 100])
FAR = np.concatenate([[0.0], *(s * np.geomspace(1e-9, 1e30, 200) for s in (-1, 1))])


def _at(function, x, freedom: int):
    """A function of one deviation and its derivative, at many."""
    both = jax.value_and_grad(lambda value: function(value, freedom))
    return jax.tree.map(np.asarray, compile_program(jax.vmap(both), x, run_once=True)(x))


# The distribution -------------------------------------------------------------------------------------------------


@FREEDOMS
def test_the_logarithm_of_the_distribution_function_keeps_its_digits_far_out_in_both_tails(freedom):
    value, _ = _at(log_student_cdf, FAR, freedom)
    tail = stats.t.sf(np.abs(FAR), freedom)
    usable = tail > 1e-290
    expected = np.where(FAR > 0, np.log1p(-tail), np.log(np.where(usable, tail, 1.0)))
    np.testing.assert_allclose(value[usable], expected[usable], rtol=3e-12)
    assert np.all(np.isfinite(value))
    assert np.all(np.diff(value[np.argsort(FAR)]) >= 0)


def test_beyond_the_smallest_number_the_tail_goes_on_as_a_power():
    value, slope = _at(log_student_cdf, np.array([-1e100, -1e120]), 4)
    assert value[1] - value[0] == pytest.approx(-4 * 20 * np.log(10), rel=1e-12)
    np.testing.assert_allclose(slope * [1e100, 1e120], 4.0)


@FREEDOMS
def test_the_derivative_of_the_distribution_function_is_the_density_over_it(freedom):
    value, slope = _at(log_student_cdf, FAR, freedom)
    expected = stats.t.logpdf(FAR, freedom) - value
    usable = expected > -600  # else the derivative is about the smallest number
    np.testing.assert_allclose(np.log(slope[usable]), expected[usable], rtol=1e-11, atol=1e-11)
    assert np.all(np.isfinite(slope))


@FREEDOMS
def test_the_density_is_scipy_s(freedom):
    x = FAR[np.abs(FAR) < 1e15]
    value, slope = _at(log_student_density, x, freedom)
    np.testing.assert_allclose(value, stats.t.logpdf(x, freedom), rtol=1e-12)
    np.testing.assert_allclose(slope, -(freedom + 1) * x / (freedom + x**2), rtol=1e-12, atol=1e-300)


@FREEDOMS
def test_half_the_squared_residual_is_minus_the_log_density_with_a_derivative_also_at_zero(freedom):
    residual, slope = _at(student_residual, FAR, freedom)
    np.testing.assert_allclose(residual**2, (freedom + 1) * np.log1p(FAR**2 / freedom), rtol=1e-13)
    assert np.all(np.sign(residual) == np.sign(FAR))
    assert np.all(slope > 0)
    assert slope[0] == pytest.approx(np.sqrt((freedom + 1) / freedom), rel=1e-14)
    with_value = residual != 0
    far_value = FAR[with_value]
    np.testing.assert_allclose(
        slope[with_value] * residual[with_value], (freedom + 1) * far_value / (freedom + far_value**2), rtol=1e-12
    )


@FREEDOMS
def test_the_residual_of_a_bound_is_finite_with_its_derivative_however_far_the_bound_is(freedom):
    residual, slope = _at(student_bound_residual, FAR, freedom)
    value, of_value = _at(log_student_cdf, FAR, freedom)
    assert np.all(np.isfinite(residual) & np.isfinite(slope))
    is_impossible = value < -1e-250
    np.testing.assert_allclose(residual[is_impossible] ** 2, -2 * value[is_impossible], rtol=1e-12)
    np.testing.assert_allclose(slope[is_impossible] * residual[is_impossible], -of_value[is_impossible], rtol=1e-10)


def _extrapolated(function) -> np.ndarray:
    """The limit of many degrees of freedom: differences from it fall as 1/nu."""
    return 2 * np.asarray(function(100)) - np.asarray(function(50))


def test_many_degrees_of_freedom_are_a_normal():
    u = jnp.linspace(-1.5, 1.5, 7)
    for name in ("log_density", "log_cdf", "residual", "bound_residual"):
        normal, of_four = (np.asarray(getattr(law, name)(u)) for law in (NormalNoise(), StudentNoise(4)))
        computed = _extrapolated(lambda freedom, name=name: getattr(StudentNoise(freedom), name)(u))
        np.testing.assert_allclose(computed, normal, rtol=0, atol=1e-3)
        assert np.abs(of_four - normal).max() > 0.03


# The tables -------------------------------------------------------------------------------------------------------

MU, WRAP_ANGLE, FORCE_NOISE = 0.12, np.deg2rad(150), 0.4
RUNS, FORCES = 8, (20.0, 35.0, 50.0, 65.0, 80.0)
SETS = {"on-body": "on-body-exoskeleton", "loop": "synthetic-haptic-loop"}


def _force_table(seed: int, tau: float = 0.01, strokes=(1, -1), outlier: float = 0.0) -> ForceTable:
    """Runs of one contact, of which the first is an outlier in its friction exponent if that is wanted."""
    generator, per_run = np.random.default_rng(seed), len(strokes) * len(FORCES)
    run = np.repeat(np.arange(RUNS), per_run)
    stroke, force = np.tile(np.repeat(strokes, len(FORCES)), RUNS), np.tile(FORCES, len(strokes) * RUNS)
    mounting = tau * generator.standard_normal(RUNS) + outlier * (np.arange(RUNS) == 0)
    force_out = force * np.exp(-stroke * (MU * WRAP_ANGLE + mounting[run]))
    noise, n = FORCE_NOISE * generator.standard_normal((2, len(run))), len(run)
    own_angles = OwnAngles((), np.zeros((n, 0)), np.zeros((n, 0)))
    origin = RowOrigin(("forces.csv",), np.zeros(n, dtype=int), np.arange(2, n + 2))
    unknown, names = np.full(n, np.nan), tuple(str(i) for i in range(RUNS))
    return ForceTable(unknown, force + noise[0], force_out + noise[1], run, names, stroke, own_angles, origin, unknown)


def _forces(noise: str, table: ForceTable) -> Model:
    """A cable of which only mu and tau are unknown."""
    contact = {"name": "sheath", "friction": "mu", "wrap_angle": {"value": 150, "unit": "deg"}}
    sensors = {"force_noise": {"value": FORCE_NOISE, "unit": "N"}}
    description = cable(1, ("forces",), contact=[contact], sensors=sensors, noise=noise)
    return build_model(Dataset(description.model_copy(update={"route": None}), Measurements((table,)), {}))


def _with_a_slack_row(dataset: Dataset) -> Dataset:
    """The data set, with a preload table whose first row reads 0."""
    table = dataset.measurements.table(PreloadTable)
    slack = replace(table, preload=np.where(np.arange(len(table.preload)) == 0, 0.0, table.preload))
    return replace(dataset, measurements=dataset.measurements.with_tables(slack))


@cache
def _model(case: str, noise: str) -> Model:
    if case in SETS:
        dataset = load_dataset(ROOT / "datasets" / SETS[case], [f'noise="{noise}"'])
        return build_model(_with_a_slack_row(dataset) if case == "loop" else dataset)
    return _forces(noise, _force_table(1, strokes=(0,) if case == "held" else (1, -1)))


def _of(model: Model, z: np.ndarray):
    """Log likelihoods, residuals and expected readings of every table, and the values, at many z."""
    posterior = LogDensity(model)

    def evaluate(z, data):
        values = model.space.constrain(z)
        expected = {t.name: t.expected(values, d) for t, d in zip(model.terms, data, strict=True)}
        return posterior.log_likelihoods(z, data), posterior.residuals(z, data), expected, values

    program = compile_program(jax.vmap(evaluate, in_axes=(0, None)), z, posterior.data, run_once=True)
    return jax.tree.map(np.asarray, program(z, posterior.data))


@pytest.mark.parametrize("case", ["on-body", "loop", "runs"])
def test_student_noise_exchanges_the_law_of_the_standardized_deviations_and_nothing_else(case):
    """Of each reading, of each run's mean deviation; samples within a run keep their normal scatter."""
    z = 0.7 * np.random.default_rng(1).standard_normal((12, _model(case, "normal").space.size))
    student, of_student, _, _ = _of(_model(case, "student"), z)
    normal, u, expected, values = _of(_model(case, "normal"), z)
    for term in _model(case, "student").terms:
        n, name = len(term.labels), term.name
        read = slice(0, n - len(_bounds(term)))
        deviation, within = u[name][:, read], slice(n, None)
        changed = stats.t.logpdf(deviation, 4) - stats.norm.logpdf(deviation)
        scale = 1 + np.abs(normal[name][:, read])
        assert np.all(np.abs(student[name][:, read] - normal[name][:, read] - changed) < 1e-11 * scale)
        np.testing.assert_allclose(of_student[name][:, read] ** 2, 5 * np.log1p(deviation**2 / 4), rtol=1e-9)
        assert np.all(np.sign(of_student[name][:, read]) == np.sign(deviation))
        np.testing.assert_array_equal(of_student[name][:, within], u[name][:, within])
        beyond, shown = slice(read.stop, n), np.deg2rad(1) if term.unit == "deg" else 1.0
        limits = (_bounds(term) - expected[name][:, beyond] * shown) / values[term.noise][:, None]
        log_probability = stats.t.logcdf(limits, 4)
        np.testing.assert_allclose(student[name][:, beyond], log_probability, rtol=1e-9)
        np.testing.assert_allclose(of_student[name][:, beyond] ** 2, -2 * log_probability, rtol=1e-9)


def _bounds(term) -> np.ndarray:
    """Upper limits of the readings of which no more is known."""
    return np.asarray(getattr(term.data, "limit", getattr(term.data, "at_most", [])))


def test_the_data_sets_above_have_readings_of_which_only_a_bound_is_known():
    assert [len(_bounds(term)) for term in _model("on-body", "student").terms] == [5, 0]
    assert [len(_bounds(term)) for term in _model("loop", "student").terms] == [0, 1, 0]


def test_a_held_reading_has_the_probability_of_the_band_by_the_student_law():
    model = _model("held", "student")
    likelihood, residual, _, values = _of(model, np.random.default_rng(2).standard_normal((12, 2)))
    data = model.terms[0].data
    force_in, force_out = data.input_force, data.output_force
    ratio, limit = np.abs(np.log(force_in / force_out)), values["mu"][:, None] * WRAP_ANGLE
    sd = np.sqrt(values["tau"][:, None] ** 2 + FORCE_NOISE**2 * (1 / force_in**2 + 1 / force_out**2))
    band = stats.t.sf((ratio - limit) / sd, 4) - stats.t.sf((ratio + limit) / sd, 4)
    np.testing.assert_allclose(likelihood["held_ratio"], np.log(band), rtol=1e-9)
    np.testing.assert_allclose(residual["held_ratio"] ** 2, -2 * np.log(band), rtol=1e-9)


def _standardized(model: Model, name: str, draws: int) -> np.ndarray:
    """Readings of a table drawn many times, in units of their scale about what is expected of them."""
    term = next(t for t in model.terms if t.name == name)

    def evaluate(keys, data):
        values = model.space.constrain(jnp.zeros(model.space.size))
        scale = values[term.noise]
        if name in ("efficiency", "loop_output_force"):
            scale = term._mean_and_sd(values, data, values)[1]
        if name == "run_efficiency":
            scale = term._deviations(values, data, values).sd
        return jax.vmap(lambda key: term.simulate(values, data, key))(keys), term.expected(values, data), scale

    keys = jax.random.split(jax.random.key(5), draws)
    sample, expected, scale = compile_program(evaluate, keys, term.data, run_once=True)(keys, term.data)
    if term.unit == "1":
        return np.asarray((jnp.log(expected) - jnp.log(sample)) / scale).ravel()
    if term.unit == "deg":
        scale = jnp.rad2deg(scale)
    return np.asarray((sample - expected) / scale).ravel()


SIMULATED = [
    ("on-body", "wrap_angle"),
    ("on-body", "efficiency"),
    ("runs", "run_efficiency"),
    ("loop", "stretch"),
    ("loop", "loop_output_force"),
]


@pytest.mark.parametrize(("case", "name"), SIMULATED)
def test_simulated_readings_scatter_by_the_law_of_the_likelihood(case, name):
    """By Kolmogorov and Smirnov; one false alarm in ten thousand for each table, were the seed not fixed."""
    draws = _standardized(_model(case, "student"), name, 2000)
    assert stats.kstest(draws, stats.t(4).cdf).pvalue > 1e-4
    assert stats.kstest(draws, stats.norm.cdf).pvalue < 1e-10


def test_normal_noise_scatters_by_the_normal_law_with_the_draws_it_always_had():
    description, key = _model("runs", "normal").description, jax.random.key(1)
    np.testing.assert_array_equal(scatter(key, (50,), description), jax.random.normal(key, (50,)))
    expected = np.random.default_rng(1).standard_normal(50)
    np.testing.assert_array_equal(noise_law(description).draw_with(np.random.default_rng(1), 50), expected)


def test_effects_of_new_mountings_in_predictions_scatter_by_the_student_law():
    """By Kolmogorov and Smirnov; one false alarm in ten thousand, were the seed not fixed."""
    draws = StudentNoise(4).draw_with(np.random.default_rng(1), 20_000)
    assert stats.kstest(draws, stats.t(4).cdf).pvalue > 1e-4


# What it is for ---------------------------------------------------------------------------------------------------

_Z_MU, _Z_TAU = np.linspace(-1.2, 1.2, 161), np.linspace(-4.0, 7.0, 89)


@cache
def _posteriors(outlier: float, tau: float = 0.01, seeds: int = 20) -> dict[str, np.ndarray]:
    """Posterior mean and sd of mu on simulated cables, integrated on a grid over mu and tau, by noise law."""
    results = {}
    for noise in ("normal", "student"):
        models = [_forces(noise, _force_table(seed, tau, outlier=outlier)) for seed in range(seeds)]
        posterior, data = LogDensity(models[0]), [LogDensity(model).data for model in models]
        z = np.stack(np.meshgrid(_Z_MU, _Z_TAU, indexing="ij"), axis=-1).reshape(-1, 2)
        stacked = jax.tree.map(lambda *item: np.stack(item), *data)
        over = jax.vmap(jax.vmap(posterior.log_density, in_axes=(0, None)), in_axes=(None, 0))
        density = np.asarray(compile_program(over, z, stacked, run_once=True)(z, stacked))
        weight = np.exp(density - density.max(axis=1, keepdims=True))
        weight /= weight.sum(axis=1, keepdims=True)
        mu = np.asarray(posterior.model.space.parameters[0].prior.constrain(jnp.asarray(z[:, 0])))
        mean = weight @ mu
        results[noise] = np.stack([mean, np.sqrt(weight @ mu**2 - mean**2)])
    return results


def test_one_bad_mounting_pulls_a_normal_fit_far_and_a_student_fit_hardly():
    """A run whose friction exponent is off by 0.25, twenty-five times the scatter; on twenty cables with fixed seeds."""
    healthy, outlier = _posteriors(0.0), _posteriors(0.25)
    sd = healthy["normal"][1]
    assert np.all(outlier["normal"][0] - healthy["normal"][0] > 3.5 * sd)
    assert np.all(np.abs(outlier["student"][0] - healthy["student"][0]) < sd)
    assert np.all(outlier["student"][1] < 0.6 * outlier["normal"][1])


def test_the_farther_off_a_bad_mounting_is_the_less_it_pulls_a_student_fit():
    healthy = _posteriors(0.0)["student"][0]
    pull = [np.mean(np.abs(_posteriors(outlier)["student"][0] - healthy)) for outlier in (0.1, 0.25, 0.5)]
    assert pull[0] > pull[1] > pull[2]


def test_of_healthy_measurements_student_noise_says_what_normal_noise_says():
    """On twenty cables; the answers differ by 0.2 of the posterior sd typically, so by 0.8 once in a thousand such tests."""
    estimates = _posteriors(0.0)
    difference = (estimates["student"][0] - estimates["normal"][0]) / estimates["normal"][1]
    assert np.all(np.abs(difference) < 0.8)
    ratio = estimates["student"][1] / estimates["normal"][1]
    assert 0.9 < np.median(ratio) < 1.1
    assert np.all((ratio > 0.7) & (ratio < 1.4))


def _mistyped(on_body: Path, folder: Path) -> Path:
    """The on-body data with two digits of one wrap angle swapped: 82 deg in place of 28."""
    shutil.copytree(on_body, folder)
    table = (folder / "angles.csv").read_text(encoding="utf-8")
    assert "480,17,28\n" in table
    (folder / "angles.csv").write_text(table.replace("480,17,28\n", "480,17,82\n"), encoding="utf-8")
    return folder


def _best_fits(noise: str, folders: tuple[Path, Path]) -> list[dict[str, float]]:
    """Values of the parameters at the maximum of the posterior of each data set, as the first one's priors have it."""
    posteriors = [LogDensity(build_model(load_dataset(folder, [f'noise="{noise}"', *NO_DEPARTURES]))) for folder in folders]
    space, objective = posteriors[0].model.space, make_objective(posteriors[0])
    z = [find_maximum_posterior(posterior, objective).z for posterior in posteriors]
    return [{name: float(value) for name, value in space.constrain(jnp.asarray(point)).items()} for point in z]


def test_two_swapped_digits_spoil_a_normal_fit_and_not_a_student_fit(on_body, tmp_path):
    folders = on_body, _mistyped(on_body, tmp_path / "mistyped")
    (right, normal), (_, student) = _best_fits("normal", folders), _best_fits("student", folders)
    errors = {
        "free_sheath_angle_a": 0.027,
        "free_sheath_angle_b": 0.081,
        "mu1": 0.0052,
        "mu3": 0.011,
    }  # of the right data
    for name, error in errors.items():
        assert abs(student[name] - right[name]) < 0.5 * error
        assert abs(normal[name] - right[name]) > error
    assert abs(normal["free_sheath_angle_a"] - right["free_sheath_angle_a"]) > 0.2  # 20 % of the angle


@pytest.mark.slow
def test_a_sampled_student_fit_answers_as_if_two_digits_had_not_been_swapped(on_body, tmp_path):
    """On the very data it differs from the normal fit by less than a quarter of the posterior sd, too."""
    folder = _mistyped(on_body, tmp_path / "mistyped")
    answers = {}
    for name, data, noise in (
        ("right", on_body, "normal"),
        ("robust", on_body, "student"),
        ("typo", folder, "student"),
    ):
        fit = bf.fit(data, seed=1, noise=noise)
        assert fit.converged
        answers[name] = np.concatenate([np.asarray(fit.posterior.values[p]).reshape(-1, 1) for p in MU_NAMES], axis=1)
    center, sd = np.median(answers["right"], axis=0), answers["right"].std(axis=0)
    for name in ("robust", "typo"):
        assert np.all(np.abs(np.median(answers[name], axis=0) - center) < 0.25 * sd)


# Saying it --------------------------------------------------------------------------------------------------------


def test_no_scale_of_a_student_law_is_called_a_standard_deviation():
    for case in ("on-body", "loop", "runs"):
        for p in _model(case, "student").space.parameters:
            if p.role != "noise" or (case, p.name) == ("runs", "sigma_F"):
                continue
            assert "standard deviation" not in p.meaning
            assert p.meaning.startswith("scale of ")
            assert p.meaning.endswith(", Student-t with 4 degrees of freedom")
    meanings = {p.name: p.meaning for p in _model("runs", "student").space.parameters}
    assert meanings["sigma_F"] == "standard deviation of a force reading"  # within a run readings are normal
    assert all("Student" not in p.meaning for p in _model("on-body", "normal").space.parameters)


def test_noise_is_chosen_on_the_command_line_and_named_in_the_summary(run, on_body, tmp_path):
    code, _, err = run("fit", on_body, "--no-mcmc", "--no-figures", "--noise", "student", "-o", tmp_path / "fit")
    assert code in {0, 3}, err
    assert "Student-t noise with 4 degrees of freedom" in " ".join(run("summary", tmp_path / "fit", "--full")[1].split())
    assert bf.load(tmp_path / "fit").dataset.description.noise == "student"


@pytest.mark.parametrize(
    ("settings", "case"),
    [
        (['noise="gauss"'], "cable.toml, noise: input should be 'normal' or 'student' (found 'gauss')."),
        (
            ['noise="student"', "student_degrees_of_freedom=5"],
            "student_degrees_of_freedom: input should be a multiple of 2",
        ),
        (
            ['noise="student"', "student_degrees_of_freedom=0"],
            "student_degrees_of_freedom: input should be greater than",
        ),
        (["student_degrees_of_freedom=6"], 'student_degrees_of_freedom belongs to noise = "student"'),
    ],
)
def test_noise_that_does_not_exist_is_refused_in_a_sentence(run, on_body, settings, case):
    code, _, err = run("check", on_body, *(part for setting in settings for part in ("--set", setting)))
    assert code == 2
    assert case in err


def test_degrees_of_freedom_can_be_chosen(on_body):
    description = bf.read(on_body, settings=["student_degrees_of_freedom=6"], noise="student").description
    assert noise_law(description) == StudentNoise(6)
    assert noise_law(bf.read(on_body).description) == NormalNoise()
    assert type(description).model_validate(description.to_json()) == description
