"""What follows from draws: the best length, what other lengths cost, and readings drawn anew."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from cables import CONTACTS, cable, measured
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from bowdenfit.dataset import load_dataset
from bowdenfit.inference import draws
from bowdenfit.inference.draws import compile_replicator, efficiency_at, for_each_draw, for_each_value, value_function
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.models import Model, build_model
from bowdenfit.results.along_route import make_optimizer, route_grid
from bowdenfit.results.optimal_length import find_best_window, is_at_edge, rank_choices

FINE = 20_001


def _draws(model: Model, n: int, seed: int) -> np.ndarray:
    return 0.7 * np.random.default_rng(seed).standard_normal((n, model.space.size))


def _by_brute_force(model: Model, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    lengths = np.linspace(*model.description.route.range, FINE)
    efficiency = efficiency_at(model, z, lengths)
    best = efficiency.argmax(axis=1)
    return lengths[best], efficiency[np.arange(len(z)), best]


@pytest.fixture(scope="module")
def on_body_model(on_body) -> Model:
    return build_model(load_dataset(on_body))


# The best length --------------------------------------------------------------------------------------------------


@pytest.mark.extended
@pytest.mark.parametrize("geometry", ["continuous", "published"])
def test_the_optimum_is_that_of_a_fine_grid(on_body, geometry):
    model = build_model(load_dataset(on_body, [f'geometry="{geometry}"']))
    z = _draws(model, 120, 1)
    length, efficiency = for_each_draw(make_optimizer(model), model.space.size)(z)
    brute_length, brute_efficiency = _by_brute_force(model, z)
    if geometry == "continuous":
        step = 100 / (FINE - 1)
        equally_good = np.abs(efficiency - brute_efficiency) < 1e-12  # where departures leave a range without any bend
        assert np.all((np.abs(length - brute_length) <= step + 1e-9) | equally_good)
        assert np.all(efficiency >= brute_efficiency - 1e-12)  # refined past the grid, so never worse
        assert np.sum((length > 431) & (length < 529)) > 10  # inside for many, and at an end for others
        assert np.any(is_at_edge(length, (430.0, 530.0)))
    else:  # past a jump of the paper's curves the best is a limit that neither reaches
        np.testing.assert_allclose(efficiency, brute_efficiency, atol=1e-4)
    at_optimum = [efficiency_at(model, z[i : i + 1], length[i : i + 1])[0, 0] for i in range(5)]
    np.testing.assert_allclose(at_optimum, efficiency[:5], rtol=1e-12)


def test_the_optimum_of_two_opposed_exponentials_is_where_their_slopes_balance():
    """mu_1 A_1 exp(b_1 x) + mu_2 A_2 exp(-b_2 x) is least at x = log(mu_2 A_2 b_2 / (mu_1 A_1 b_1)) / (b_1 + b_2)."""
    curves = {"free": (-0.7, 1.3, 0.0), "squeezed": (-0.9, -1.1, 0.0)}
    prior = {f"{k}_angle_{x}": {"fixed": v} for k, abc in curves.items() for x, v in zip("abc", abc, strict=True)}
    description = cable(2, prior=prior, friction={"mu_free": {"fixed": 0.1}, "mu_squeezed": {"fixed": 0.16}})
    model = build_model(measured(description, noise=False)[0])
    length, efficiency = jax.jit(make_optimizer(model))(jnp.zeros(model.space.size))
    x = np.log(0.16 * np.exp(-0.9) * 1.1 / (0.1 * np.exp(-0.7) * 1.3)) / (1.3 + 1.1)
    assert float(length) == pytest.approx(500 + 100 * x, abs=1e-4)
    loss = 0.1 * np.exp(-0.7 + 1.3 * x) + 0.16 * np.exp(-0.9 - 1.1 * x)
    assert float(efficiency) == pytest.approx(np.exp(-loss), rel=1e-12)


@pytest.mark.parametrize(("slope", "end"), [(1.0, 400.0), (-1.0, 600.0)])
def test_an_optimum_at_an_end_of_the_range_is_exactly_there_and_flagged(slope, end):
    curve = {"free_angle_a": {"fixed": -0.5}, "free_angle_b": {"fixed": slope}, "free_angle_c": {"fixed": 0.0}}
    model = build_model(measured(cable(1, prior=curve), noise=False)[0])
    length, _ = jax.jit(make_optimizer(model))(jnp.zeros(model.space.size))
    assert float(length) == end
    assert is_at_edge(np.array([float(length)]), (400.0, 600.0)).all()


def test_a_cable_without_curves_is_equally_efficient_everywhere():
    contacts = [CONTACTS[2], CONTACTS[4]]
    description = cable(2, ("forces",), contact=contacts)
    model = build_model(measured(description, noise=False)[0])
    z = _draws(model, 7, 2)
    grid = route_grid(model)
    efficiency = efficiency_at(model, z, grid)
    assert np.all(np.ptp(efficiency, axis=1) == 0.0)
    length, best = for_each_draw(make_optimizer(model), model.space.size)(z)
    assert np.all(length == grid[0])  # all are best; the first is named, and flagged as at the edge
    assert is_at_edge(length, description.route.range).all()
    np.testing.assert_allclose(best, efficiency[:, 0], rtol=1e-14)
    window = find_best_window(grid, efficiency, best)
    assert (window.start, window.stop) == (400.0, 600.0)
    choices = rank_choices(grid[:4], efficiency[:, :4])
    assert [c.probability_best for c in choices] == [0.25] * 4
    assert [c.expected_regret for c in choices] == [0.0] * 4


def test_a_length_counts_as_at_the_edge_within_a_thousandth_of_the_range():
    lengths = np.array([430.0, 430.09, 430.11, 480.0, 529.89, 529.91, 530.0])
    np.testing.assert_array_equal(is_at_edge(lengths, (430.0, 530.0)), [True, True, False, False, False, True, True])


# Lengths that can be bought ---------------------------------------------------------------------------------------


def test_choices_are_ranked_by_draws_won_and_by_mean_loss():
    efficiency = np.array([[0.80, 0.79, 0.70], [0.70, 0.75, 0.74], [0.81, 0.80, 0.60], [0.78, 0.77, 0.78]])
    short, middle, long = rank_choices(np.array([450.0, 470.0, 490.0]), efficiency)
    assert (short.length, middle.length, long.length) == (450.0, 470.0, 490.0)
    assert short.probability_best == pytest.approx((1 + 0 + 1 + 0.5) / 4)  # a tie is shared
    assert middle.probability_best == pytest.approx(1 / 4)
    assert long.probability_best == pytest.approx(0.5 / 4)
    assert short.expected_regret == pytest.approx((0 + 0.05 + 0 + 0) / 4)
    assert middle.expected_regret == pytest.approx((0.01 + 0 + 0.01 + 0.01) / 4)
    assert long.expected_regret == pytest.approx((0.10 + 0.01 + 0.21 + 0) / 4)


@settings(deadline=None, derandomize=True, max_examples=50)
@given(st.integers(1, 6), st.integers(1, 30), st.integers(0, 2**20))
def test_one_choice_is_best_in_every_draw_and_no_regret_is_negative(choices, draws, seed):
    efficiency = np.random.default_rng(seed).uniform(0.5, 0.9, (draws, choices)).round(1)  # rounded: ties
    ranked = rank_choices(np.arange(choices, dtype=float), efficiency)
    assert sum(c.probability_best for c in ranked) == pytest.approx(1.0)
    assert all(c.expected_regret >= 0 for c in ranked)
    surely = [c for c in ranked if c.probability_best == 1.0]
    assert all(c.expected_regret == 0 for c in surely)


def test_a_single_choice_is_best_without_regret():
    (only,) = rank_choices(np.array([470.0]), np.array([[0.8], [0.7]]))
    assert (only.probability_best, only.expected_regret) == (1.0, 0.0)


# The window -------------------------------------------------------------------------------------------------------

GRID = np.array([10.0, 20.0, 30.0, 40.0, 50.0])


def _good(rows: list[str]) -> np.ndarray:
    """Efficiencies that are the best (1), half a per cent (a) or two per cent (.) below the best of their draw."""
    return np.array([[{"1": 0.8, "a": 0.8 * 0.995, ".": 0.8 * 0.98}[x] for x in row] for row in rows])


@pytest.mark.parametrize(
    ("rows", "probability", "window"),
    [
        (["..1.."], 0.95, (30, 30)),
        ([".a1a."], 0.95, (20, 40)),
        (["aa1aa"], 0.95, (10, 50)),
        ([".a1a.", "..1a.", "..1.."], 0.95, (30, 30)),
        ([".a1a.", "..1a.", "..1.."], 0.6, (30, 40)),
        ([".a1a.", "..1a.", "..1.."], 0.3, (20, 40)),
        (["1....", "....1"], 0.95, (np.nan, np.nan)),
        (["1.a1a", "1..1."], 0.95, (10, 10)),  # only what is connected to the surest length
        (["..a1a", "1..1."], 0.5, (30, 50)),
    ],
)
def test_the_window_is_the_stretch_around_the_surest_length_that_is_good_enough_often_enough(rows, probability, window):
    efficiency = _good(rows)
    best_window = find_best_window(GRID, efficiency, efficiency.max(axis=1), 0.01, probability)
    np.testing.assert_equal((best_window.start, best_window.stop), tuple(float(x) for x in window))
    assert (best_window.within, best_window.probability) == (0.01, probability)


def test_every_length_of_the_window_is_within_one_per_cent_as_often_as_promised(on_body_model):
    model = on_body_model
    z = _draws(model, 400, 3) * 0.2
    grid = route_grid(model)
    efficiency = efficiency_at(model, z, grid)
    _, best = for_each_draw(make_optimizer(model), model.space.size)(z)
    window = find_best_window(grid, efficiency, best, within=0.02, probability=0.6)
    inside = (grid >= window.start) & (grid <= window.stop)
    share = (efficiency >= 0.98 * best[:, None]).mean(axis=0)
    assert 0 < inside.sum() < len(grid)
    assert np.all(share[inside] >= 0.6)
    first, last = np.flatnonzero(inside)[[0, -1]]
    assert all(share[i] < 0.6 for i in (first - 1, last + 1) if 0 <= i < len(grid))


# Every draw by itself ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("n", [1, 1023, 1024, 1025, 2500])
def test_draws_in_batches_are_the_draws_one_by_one(n):
    z = np.random.default_rng(n).standard_normal((n, 2))
    computed = for_each_draw(lambda draw: {"sum": draw.sum(), "square": draw**2}, 2)(z)
    np.testing.assert_allclose(computed["sum"], z.sum(axis=1), rtol=1e-13, atol=1e-15)
    np.testing.assert_allclose(computed["square"], z**2, rtol=1e-15)


@pytest.mark.parametrize("n", [1, 1025])
def test_functions_of_values_are_those_of_every_draw_by_itself(n):
    first, second = np.random.default_rng(n).standard_normal((2, n))
    computed = for_each_value(lambda of, by: of["first"] * by - of["second"], {"first": first, "second": second}, np.array(3.0))
    np.testing.assert_allclose(computed, 3 * first - second, rtol=1e-13, atol=1e-15)


def test_efficiency_falls_off_with_the_friction_exponent_at_each_length(on_body_model):
    model, lengths = on_body_model, np.array([430.0, 471.3, 530.0])
    z = _draws(model, 5, 4)
    values = for_each_draw(value_function(model), model.space.size)(z)
    x, angles = (lengths - 480) / 50, {}
    for column in ("free_sheath_angle", "squeezed_sheath_angle"):
        endings = ("a", "b", "c", "departure_1", "departure_2")
        a, b, c, second, third = (values[f"{column}_{ending}"][:, None] for ending in endings)
        departure = second * np.sqrt(5) * (3 * x**2 - 1) / 2 + third * np.sqrt(7) * (5 * x**3 - 3 * x) / 2
        angles[column] = np.maximum(np.exp(a + b * x - c * x**2) + np.deg2rad(departure), 0)
    exponent = (
        values["mu1"][:, None] * angles["free_sheath_angle"]
        + values["mu2"][:, None] * angles["squeezed_sheath_angle"]
        + values["mu3"][:, None] * np.deg2rad(45.0)
    )
    np.testing.assert_allclose(efficiency_at(model, z, lengths), np.exp(-exponent), rtol=1e-12)


def test_readings_drawn_anew_are_distributed_as_the_likelihood_says():
    """Kolmogorov-Smirnov over 4000 draws at one z, for each of 40 readings; rejects by chance once in a thousand seeds."""
    tables = {name: {"file": f"{name}.csv"} for name in ("angles", "efficiencies", "forces")}
    model = build_model(measured(cable(2, tables), seed=1)[0])
    posterior = LogDensity(model)
    z = np.repeat(0.3 * np.ones((1, model.space.size)), 4000, axis=0)
    draws = compile_replicator(posterior, seed=3)(z)
    values = {name: v[0] for name, v in draws["values"].items()}
    assert not np.any(draws["replicated"]["efficiency"][0] == draws["replicated"]["efficiency"][1])
    runs = model.terms[2]
    run_sd = np.sqrt(values["tau"] ** 2 + values["sigma_F"] ** 2 / runs.data.run_weight)
    p = []
    for name, scale, sd in (
        ("wrap_angle", lambda x: x, values["sigma_theta"]),
        ("efficiency", np.log, values["tau"]),
        ("run_efficiency", np.log, run_sd),
    ):
        expected, replicated = draws["expected"][name][0], draws["replicated"][name]
        standardized = (scale(replicated) - scale(expected)) / sd
        p += [stats.kstest(column, "norm").pvalue for column in standardized.T]
    assert min(p) * len(p) > 0.001


@pytest.mark.extended
def test_readings_by_another_seed_need_no_other_program(on_body_model, monkeypatch):
    compiled = []

    def program(function, *shapes, **_):
        compiled.append(jax.jit(function).lower(*shapes))
        return compiled[-1].compile()

    monkeypatch.setattr(draws, "compile_program", program)
    posterior, z = LogDensity(on_body_model), _draws(on_body_model, 2, 1)
    replicated = [compile_replicator(posterior, seed)(z)["replicated"]["efficiency"] for seed in (3, 4)]
    assert compiled[0].as_text() == compiled[1].as_text()
    assert not np.any(replicated[0] == replicated[1])
