"""What each table says of the parameters, against the same densities written out plainly or integrated numerically."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from cables import cable
from densities import draws, over_rows
from scipy import integrate, stats

from bowdenfit.dataset import Dataset, load_dataset, read_dataset
from bowdenfit.kinds.descriptions import load_description
from bowdenfit.kinds.efficiencies.kind import EfficiencyTable
from bowdenfit.kinds.forces.table import ForceTable
from bowdenfit.kinds.forces.term import HeldForcesTerm, make_sliding_rows
from bowdenfit.kinds.row_angles import collect_row_angles
from bowdenfit.kinds.rows import OwnAngles, RowOrigin
from bowdenfit.kinds.runs import RunsTerm
from bowdenfit.kinds.sliding_rows import SlidingRows
from bowdenfit.kinds.tables import Measurements
from bowdenfit.models import Model, build_model

VALUES = {"mu": 0.15, "tau": 0.03, "sigma_F": 0.7}


def _force_table(runs, names=(), angle=None, sd=None) -> ForceTable:
    """Rows (run, stroke, input force, output force), with wrap angles of their own if given [rad]."""
    run, stroke, force_in, force_out = (np.array(column) for column in zip(*runs, strict=True))
    n = len(run)
    own_angles = OwnAngles(
        tuple(names),
        np.full((n, len(names)), np.nan) if angle is None else np.asarray(angle, dtype=float).reshape(n, -1),
        np.full((n, len(names)), np.nan) if sd is None else np.asarray(sd, dtype=float).reshape(n, -1),
    )
    origin = RowOrigin(("forces.csv",), np.zeros(n, dtype=int), np.arange(2, n + 2))
    labels = tuple(str(i) for i in range(int(run.max()) + 1))
    velocity = np.full(n, np.nan)
    return ForceTable(np.full(n, np.nan), force_in * 1.0, force_out * 1.0, run, labels, stroke, own_angles, origin, velocity)


def _single_contact(wrap_angle, table: ForceTable, **more) -> Model:
    contact = {"name": "sheath", "friction": "mu", "wrap_angle": wrap_angle}
    description = cable(1, ("forces",), contact=[contact], **more)
    return build_model(Dataset(description.model_copy(update={"route": None}), Measurements((table,)), {}))


def _of_term(model: Model, term, case: str, values: dict[str, float]) -> np.ndarray:
    """A function of a term at named values; those not named are at their prior medians or where they are fixed."""
    named = model.space.constrain(jnp.zeros(model.space.size)) | {k: jnp.asarray(v) for k, v in values.items()}
    return np.asarray(jax.jit(getattr(term, case))(named, term.data))


def _readings(seed: int, n: int, run: int = 0, strokes=(1, -1)) -> list[tuple[int, int, float, float]]:
    generator = np.random.default_rng(seed)
    rows = []
    for i in range(n):
        stroke, force = strokes[i % len(strokes)], generator.uniform(15.0, 90.0)
        rows.append((run, stroke, force, force * np.exp(-stroke * 0.4 + 0.02 * generator.standard_normal())))
    return rows


def _as_read(model: Model, table: ForceTable) -> SlidingRows:
    """Rows with the forces that they together say there were; `test_expected_forces.py` is about those."""
    angles = collect_row_angles(model.description, table, None)
    return make_sliding_rows(model.description, table, angles, np.arange(len(table.run)))


def _integrated(read: SlidingRows, exponents, tau: float, sigma: float, gain: float = 0.0, run: int = 0) -> float:
    """Log likelihood of one run: every sample's own Gaussian, the run's effect integrated by quadrature."""
    mask = read.run == run
    ratio, exponents = (read.log_ratio - read.stroke * gain)[mask], exponents[mask]
    spread = sigma * np.sqrt(1 / read.input_force**2 + 1 / read.output_force**2)[mask]

    def log_joint(m):
        return stats.norm.logpdf(ratio, exponents + m, spread).sum() + stats.norm.logpdf(m, 0.0, tau)

    weight = 1 / spread**2
    peak = np.sum(weight * (ratio - exponents)) / (weight.sum() + 1 / tau**2)
    width, top = 1 / np.sqrt(weight.sum() + 1 / tau**2), log_joint(peak)
    area, _ = integrate.quad(
        lambda m: np.exp(log_joint(m) - top), peak - 12 * width, peak + 12 * width, epsabs=0, epsrel=1e-12, limit=200
    )
    return float(top + np.log(area))


@pytest.mark.parametrize("gain", [0.0, 0.013])
@pytest.mark.parametrize("n", [1, 2, 30])
def test_four_numbers_of_a_run_say_what_all_its_samples_say_with_the_mounting_integrated_out(n, gain):
    rows = _readings(1, n)
    sensors = {"sensors": {"input_gain_error_sd": 0, "output_gain_error_sd": 0.01}} if gain else {}
    table = _force_table(rows)
    model = _single_contact({"value": 150, "unit": "deg"}, table, **sensors)
    values = VALUES | ({"gain_error": gain} if gain else {})
    (term,) = model.terms
    log_likelihood = _of_term(model, term, "log_likelihood", values)
    exponents = np.full(n, VALUES["mu"] * np.deg2rad(150))
    expected = _integrated(_as_read(model, table), exponents, VALUES["tau"], VALUES["sigma_F"], gain)
    np.testing.assert_allclose(log_likelihood, [expected], rtol=0, atol=1e-8)


def test_the_same_holds_for_several_runs_each_with_several_angles_of_its_own():
    rows = _readings(1, 12, run=0) + _readings(2, 7, run=1, strokes=(1,)) + _readings(3, 9, run=2, strokes=(-1, 1))
    angles = np.array([2.0, 2.0, 3.0, 3.0] * 7)  # two angles a run: with both strokes, up to four cells
    order = np.random.default_rng(4).permutation(len(rows))
    table = _force_table([rows[i] for i in order], ("angle",), angles[order], np.zeros(len(rows)))
    model = _single_contact({"column": "angle"}, table)
    (term,) = model.terms
    assert isinstance(term, RunsTerm)
    assert np.sum(term.data.cells.weight > 0) == 10
    log_likelihood = _of_term(model, term, "log_likelihood", VALUES)
    read, exponents = _as_read(model, table), VALUES["mu"] * angles[order]
    for run in range(3):
        expected = _integrated(read, exponents, VALUES["tau"], VALUES["sigma_F"], run=run)
        assert log_likelihood[run] == pytest.approx(expected, abs=1e-8)


def test_the_error_of_a_run_s_own_angle_widens_its_mounting_effect():
    """One angle, read once for the whole run, is off by the same amount in every sample, as the mounting is."""
    rows, angle, sd = _readings(5, 20), 2.6, 0.05
    table = _force_table(rows, ("angle",), np.full(20, angle), np.full(20, sd))
    model = _single_contact({"column": "angle"}, table)
    log_likelihood = _of_term(model, model.terms[0], "log_likelihood", VALUES)
    tau = np.hypot(VALUES["tau"], VALUES["mu"] * sd)
    expected = _integrated(_as_read(model, table), np.full(20, VALUES["mu"] * angle), tau, VALUES["sigma_F"])
    assert log_likelihood[0] == pytest.approx(expected, abs=1e-8)


def test_the_cost_does_not_grow_with_the_length_of_a_recording():
    def shapes(n):
        rows = _readings(1, n, run=0) + _readings(2, n, run=1)
        model = _single_contact({"value": 150, "unit": "deg"}, _force_table(rows))
        return jax.tree.map(np.shape, model.terms[0].data)

    assert shapes(10) == shapes(5000)


def test_samples_of_one_run_tell_the_coefficient_once():
    """However many samples a run has, it cannot pin the friction exponent better than the mounting scatters."""
    rows = _readings(1, 4000)
    model = _single_contact({"value": 150, "unit": "deg"}, _force_table(rows))
    theta = np.deg2rad(150)
    (term,) = model.terms
    curvature = jax.grad(jax.grad(lambda mu: term.log_likelihood(
        {k: jnp.asarray(v) for k, v in VALUES.items()} | {"mu": mu}, jax.tree.map(jnp.asarray, term.data)).sum()))  # fmt: skip
    sd = 1 / np.sqrt(-float(curvature(jnp.asarray(0.15))))
    assert sd == pytest.approx(VALUES["tau"] / theta, rel=1e-3)


# Held readings ----------------------------------------------------------------------------------------------------

HELD = [(0, 0, 50.0, 50.0), (0, 0, 50.0, 40.0), (0, 0, 40.0, 50.0), (0, 0, 50.0, 20.0), (0, 0, 90.0, 0.1)]


def _held(values: dict[str, float]) -> np.ndarray:
    model = _single_contact({"value": 150, "unit": "deg"}, _force_table(HELD))
    (term,) = model.terms
    assert isinstance(term, HeldForcesTerm)
    return _of_term(model, term, "log_likelihood", values)


def test_a_held_reading_has_the_probability_of_the_friction_band():
    _, _, force_in, force_out = (np.array(column) for column in zip(*HELD, strict=True))
    ratio, limit = np.log(force_in / force_out), VALUES["mu"] * np.deg2rad(150)
    sd = np.sqrt(VALUES["tau"] ** 2 + VALUES["sigma_F"] ** 2 * (1 / force_in**2 + 1 / force_out**2))
    side = np.where(ratio > 0, -1.0, 1.0)  # from the nearer tail, where scipy's difference keeps its digits
    band = stats.norm.cdf((side * ratio + limit) / sd) - stats.norm.cdf((side * ratio - limit) / sd)
    usable = band > 1e-280
    assert usable[:4].all()
    np.testing.assert_allclose(_held(VALUES)[usable], np.log(band[usable]), rtol=1e-9, atol=1e-12)


def test_more_friction_makes_every_held_reading_more_likely():
    by_friction = np.array([_held(VALUES | {"mu": mu}) for mu in (1e-6, 0.01, 0.1, 0.3, 1.0, 3.0)])
    assert np.all(np.diff(by_friction, axis=0) >= 0)
    assert np.all(by_friction <= 0)


@pytest.mark.parametrize(
    "values",
    [
        {"mu": 1e-300, "tau": 1e-9, "sigma_F": 1e-9},
        {"mu": 0.0},
        {"mu": 1e3},
        {"tau": 1e-12, "sigma_F": 1e-12},
        {"tau": 1e6},
    ],
)
def test_a_held_reading_has_a_finite_likelihood_and_gradient_however_absurd_the_parameters(values):
    model = _single_contact({"value": 150, "unit": "deg"}, _force_table(HELD))
    (term,) = model.terms
    data = jax.tree.map(jnp.asarray, term.data)
    named = {k: jnp.asarray(float(v)) for k, v in (VALUES | values).items()}
    value, slope = jax.value_and_grad(lambda v: term.log_likelihood(v, data).sum())(named)
    assert np.isfinite(value)
    assert all(np.isfinite(x) for x in slope.values())
    assert np.all(np.isfinite(_of_term(model, term, "residuals", VALUES | values)))


def test_held_readings_alone_bound_the_coefficient_from_below_and_leave_the_rest_to_the_prior():
    """Friction is at least what holds the load; above that, twice as much friction is as likely as ten times."""
    values = [float(_held(VALUES | {"mu": mu})[1]) for mu in (0.02, 0.05, 0.2, 0.5, 1.0)]
    assert values[0] < values[1] < values[2] - 1.0
    assert values[2] == pytest.approx(0.0, abs=1e-6)
    assert values[3] == pytest.approx(values[4], abs=1e-9)


# Angles -----------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def on_body_model(on_body) -> Model:
    return build_model(load_dataset(on_body))


def test_undetected_angles_have_the_probability_of_lying_below_the_limit(on_body_model):
    model = on_body_model
    term = model.terms[0]

    def evaluate(z, data):
        values = model.space.constrain(z)
        return term.expected(values, data), term.log_likelihood(values, data), values["sigma_theta"]

    expected, computed, sigma = over_rows(evaluate, draws(model, 50, 1), term.data)
    n, theta, sigma = len(term.data.angle), np.deg2rad(expected), sigma[:, None]
    np.testing.assert_allclose(
        computed[:, n:], stats.norm.logcdf((np.deg2rad(10.0) - theta[:, n:]) / sigma), rtol=1e-9, atol=1e-15
    )
    np.testing.assert_allclose(computed[:, :n], stats.norm.logpdf(term.data.angle, theta[:, :n], sigma), rtol=1e-9)


@pytest.mark.parametrize(("how", "detected", "undetected"), [("censored", 17, 5), ("zero", 22, 0), ("dropped", 17, 0)])
def test_undetected_angles_enter_as_the_description_says(on_body, how, detected, undetected):
    term = build_model(load_dataset(on_body, [f'tables.angles.undetected="{how}"'])).terms[0]
    assert len(term.data.angle) == detected
    assert len(term.data.limit) == undetected
    assert np.count_nonzero(term.data.angle == 0) == (5 if how == "zero" else 0)
    assert len(term.labels) == detected + undetected


# Rows outside the curves ------------------------------------------------------------------------------------------


def test_a_row_outside_the_curves_takes_the_angle_table_s_row_with_its_error(on_body_model):
    model = on_body_model
    term = model.terms[1]
    assert term.labels[3] == "550 mm"
    np.testing.assert_array_equal(term.data.angles.is_own[:, :2].any(axis=1), [False, False, False, True])
    np.testing.assert_allclose(term.data.angles.own[3, :2], np.deg2rad([100.0, 37.0]))
    values = {"mu1": 0.09, "mu2": 0.11, "mu3": 0.2, "sigma_theta": 0.05, "tau": 0.007}
    mean = 0.09 * np.deg2rad(100) + 0.11 * np.deg2rad(37) + 0.2 * np.deg2rad(45)
    sd = np.sqrt(0.007**2 + (0.09**2 + 0.11**2) * 0.05**2)
    log_likelihood = _of_term(model, term, "log_likelihood", values)
    assert log_likelihood[3] == pytest.approx(stats.norm.logpdf(-np.log(0.678), mean, sd), rel=1e-12)
    inside = stats.norm.logpdf(-np.log(0.77), -np.log(_of_term(model, term, "expected", values)[0]), 0.007)
    assert log_likelihood[0] == pytest.approx(inside, rel=1e-9)


def test_an_undetected_angle_outside_the_curves_counts_as_half_the_limit_give_or_take(on_body):
    description = load_description(on_body / "cable.toml", ["route.range=[460, 530]", "route.choices=[]"])
    term = build_model(read_dataset(description, on_body, {})).terms[1]  # 440 mm is now outside: squeezed 45, free < 10
    np.testing.assert_allclose(term.data.angles.own[0, :2], np.deg2rad([5.0, 45.0]))
    np.testing.assert_allclose(term.data.angles.known_variance[0, :2], [np.deg2rad(10.0) ** 2 / 12, 0.0])
    np.testing.assert_array_equal(term.data.angles.noisy[0, :2], [False, True])


def test_a_row_s_own_angle_comes_before_the_curve_with_its_stated_error_or_none(on_body):
    dataset = load_dataset(on_body)
    table: EfficiencyTable = dataset.measurements.table(EfficiencyTable)
    own_angles = OwnAngles(
        ("free_sheath_angle", "squeezed_sheath_angle"),
        np.array([[np.nan, 0.7], [np.nan] * 2, [np.nan] * 2, [1.0, 0.5]]),
        np.array([[np.nan, 0.02], [np.nan] * 2, [np.nan] * 2, [np.nan, 0.03]]),
    )
    changed = dataset.measurements.with_tables(replace(table, own=own_angles))
    data = build_model(replace(dataset, measurements=changed)).terms[1].data
    np.testing.assert_array_equal(data.angles.is_own[:, :2], [[False, True], [False] * 2, [False] * 2, [True, True]])
    np.testing.assert_allclose(data.angles.known_variance[:, 1], [0.02**2, 0, 0, 0.03**2])
    np.testing.assert_array_equal(data.angles.noisy[3, :2], [True, False])  # without a stated error: the angle table's
