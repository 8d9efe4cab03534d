"""What runs and whole recordings say of the parameters, against the same densities integrated numerically."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from cables import cable
from raw_recordings import to_raw
from scipy import integrate, stats

from bowdenfit.cable.cable import CableContacts
from bowdenfit.dataset import Dataset
from bowdenfit.description import Preparation
from bowdenfit.inference.least_squares import LeastSquares, find_maximum_posterior, fit_least_squares
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.inference.objective import make_objective
from bowdenfit.kinds import runs as runs_of_model
from bowdenfit.kinds.recordings.blocks import group_starts
from bowdenfit.kinds.recordings.reader import angles_of_recordings
from bowdenfit.kinds.recordings.whole_recordings import WholeRecordingsTerm, stack_rope_recordings
from bowdenfit.kinds.row_angles import RowAngles, collect_row_angles
from bowdenfit.kinds.runs import RunsTerm, sum_runs
from bowdenfit.kinds.sliding_rows import SlidingRows
from bowdenfit.kinds.tables import Measurements
from bowdenfit.kinds.terms import make_measured_cable
from bowdenfit.models import Model, build_model
from bowdenfit.physics.friction import rate_factor
from bowdenfit.questions.simulate.bench import (
    BenchFriction,
    BenchSettings,
    LoadCellFaults,
    MotorProfile,
    simulate_recording,
)
from bowdenfit.recordings.preparation import prepare
from bowdenfit.recordings.preparation.hysteresis import play
from bowdenfit.recordings.recording import Recording, Recordings
from bowdenfit.recordings.strokes import find_strokes

MU, REFERENCE = 0.15, 50.0
VALUES = {"mu": MU, "tau": 0.02, "sigma_F": 0.3}
CONTACT = {
    "name": "sheath",
    "friction": "mu",
    "wrap_angle": {"column": "angle", "nominal": {"value": 90, "unit": "deg"}},
}
REFERENCE_FORCE = {"value": REFERENCE, "unit": "N"}


def _named(values) -> dict:
    return {name: jnp.asarray(value) for name, value in values.items()}


def _of_term(term, case: str, values, *extra):
    return np.asarray(jax.jit(getattr(term, case))(_named(values), term.data, *extra))


def _at_each(term, points) -> np.ndarray:
    """Log likelihood of a term's only run at several points, compiled once."""
    program = jax.jit(term.log_likelihood)
    return np.array([float(program(_named(values), term.data)[0]) for values in points])


# Runs: the mounting effect integrates out -------------------------------------------------------------------------


def _cable(**more) -> CableContacts:
    """A cable of one contact, whose wrap angle comes with the readings."""
    tables = {"recordings": {"files": "*.csv"}}
    description = cable(1, tables, contact=[CONTACT], reference_force=REFERENCE_FORCE, **more)
    return make_measured_cable(description.model_copy(update={"route": None}), Measurements())


def _law(rows: SlidingRows, values, m):
    """Log ratio that the load cells show at a mounting effect m, written out plainly; m may be complex."""
    value = {"gain_error": 0, "delay_error": 0, "input_offset": 0, "output_offset": 0, "drag": 0, "load_exponent": 0}
    value |= {"stribeck": 0, "stribeck_speed": 1, "viscous": 0} | values
    p, drag = value["load_exponent"], value["drag"]
    speed = np.nan_to_num(rows.velocity)
    rate = 1 + value["stribeck"] * np.exp(-((speed / value["stribeck_speed"]) ** 2)) + value["viscous"] * np.abs(speed)
    rate = rate / (1 + value["stribeck"])  # without measurements coefficients are stated for standstill
    shift = rows.stroke * (value["mu"] * rows.angles.own[:, 0] * rate + m)
    u = (rows.input_force - value["input_offset"] + drag) / REFERENCE
    u_out = (u**p - p * shift) ** (1 / p) if p else u * np.exp(-shift)
    shown = (REFERENCE * u_out - drag) * np.exp(-value["gain_error"]) + value["output_offset"]
    return rows.stroke * np.log(rows.input_force / shown) + value["delay_error"] * rows.drift


def _first_order(rows: SlidingRows, values):
    """The same to first order in m, the derivative by a complex step."""
    mean, slope = _law(rows, values, 0.0), np.imag(_law(rows, values, 1e-30j)) / 1e-30
    return lambda m: mean + slope * m


def _integrated(rows: SlidingRows, expected, values) -> float:
    """Log likelihood of one run: every reading's own Gaussian, the run's effect integrated by quadrature."""
    spread = values["sigma_F"] * np.sqrt(1 / rows.input_force**2 + 1 / rows.output_force**2)
    tau = values["tau"]

    def log_joint(m):
        terms = stats.norm.logpdf(rows.log_ratio, expected(m), spread)
        return np.sum(rows.n_effective * terms) + stats.norm.logpdf(m, 0.0, tau)

    grid = np.linspace(-6 * tau, 6 * tau, 241)
    peak = grid[np.argmax([log_joint(m) for m in grid])]
    width = 12 / np.sqrt(np.sum(rows.n_effective / spread**2) / 4 + 1 / tau**2) + 0.1 * tau
    top = log_joint(peak)
    area, _ = integrate.quad(
        lambda m: np.exp(log_joint(m) - top), peak - width, peak + width, epsabs=0, epsrel=1e-12, limit=400
    )
    return float(top + np.log(area))


def _rows(seed: int, n: int, values, strokes=(1, -1), angles=(2.5,), m: float = 0.015) -> SlidingRows:
    """Readings of one run that obey the law, with noise, at forces between 20 and 90 N."""
    generator = np.random.default_rng(seed)
    stroke = np.array([strokes[i % len(strokes)] for i in range(n)])
    force_in, velocity = generator.uniform(20.0, 90.0, n), generator.choice([5.0, 15.0, 40.0], n)
    own_angles = np.array([[angles[(i // 2) % len(angles)]] for i in range(n)])
    drift = stroke * generator.uniform(0.0, 1.5, n) if "delay_error" in values else np.zeros(n)
    of_rows = RowAngles(
        route=np.zeros(n), own=own_angles, is_own=np.ones((n, 1), dtype=bool), known_variance=np.zeros((n, 1)),
        noisy=np.zeros((n, 1), dtype=bool), group=np.zeros(n, dtype=int),
    )  # fmt: skip
    rows = SlidingRows(
        force_in, force_in, np.zeros(n), stroke, np.zeros(n, dtype=int), velocity, drift, np.ones(n), of_rows
    )
    clean = force_in * np.exp(-stroke * _law(rows, values, m))
    ratio = stroke * np.log(force_in / clean) + values["sigma_F"] * generator.standard_normal(n) / clean
    return replace(rows, output_force=force_in * np.exp(-stroke * ratio), log_ratio=ratio)


def _runs_term(cable: CableContacts, rows: SlidingRows) -> RunsTerm:
    return RunsTerm(cable, sum_runs(cable, rows), tuple(str(run) for run in np.unique(rows.run)))


GAIN, OFFSET = {"input_gain_error_sd": 0, "output_gain_error_sd": 0.01}, {"offset_sd": {"value": 1, "unit": "N"}}
LAWS = {
    "gain error": ({"sensors": GAIN}, {"gain_error": 0.013}),
    "delay": ({}, {"delay_error": 0.004}),
    "drag": ({"friction_model": "drag"}, {"drag": 4.0}),
    "load exponent": ({"friction_model": "load-dependent"}, {"load_exponent": 0.4}),
    "offsets": ({"sensors": OFFSET}, {"input_offset": 0.7, "output_offset": -0.4}),
    "all at once": (
        {"friction_model": "drag+load-dependent+rate-dependent", "sensors": GAIN | OFFSET},
        {"drag": 2.0, "load_exponent": 0.3, "stribeck": 0.3, "stribeck_speed": 15.0, "viscous": -0.002, "gain_error": 0.01,
         "delay_error": 0.003, "input_offset": 0.5, "output_offset": -0.3},
    ),
}  # fmt: skip


@pytest.mark.parametrize("strokes", [(1, -1), (1,)], ids=["both strokes", "pulling"])
@pytest.mark.parametrize("name", LAWS)
def test_a_run_says_what_its_readings_say_with_the_mounting_integrated_out(name, strokes):
    """Exactly for the gain error and the delay; to first order in the mounting effect, taken as the model, for the others."""
    more, extra = LAWS[name]
    values = VALUES | extra
    rows = _rows(1, 6 * len(strokes), values, strokes, angles=(2.5, 3.1))  # few enough for cells of their own
    term = _runs_term(_cable(**more), rows)
    log_likelihood = _of_term(term, "log_likelihood", values)
    expected = _integrated(rows, _first_order(rows, values), values)
    np.testing.assert_allclose(log_likelihood, [expected], rtol=0, atol=1e-8)
    exact = _integrated(rows, lambda m: _law(rows, values, m), values)
    assert abs(exact - log_likelihood[0]) < (1e-8 if name in {"gain error", "delay"} else 0.05)


@pytest.mark.extended
def test_on_a_realistic_run_the_first_order_in_the_mounting_effect_is_enough():
    """40 readings good to 0.05 N, drag and offsets, tau = 0.02: second order adds up to 0.07 within tau, 0.32 at twice that."""
    values = VALUES | {"drag": 4.0, "input_offset": 0.5, "output_offset": -0.3, "sigma_F": 0.05}
    loaded_cable, program = _cable(friction_model="drag", sensors=OFFSET), None
    for m, most in ((-0.04, 0.4), (-0.02, 0.1), (0.0, 1e-3), (0.02, 0.1), (0.04, 0.4)):
        rows = _rows(2, 40, values, m=m)
        term = _runs_term(loaded_cable, rows)
        program = program or jax.jit(term.log_likelihood)
        computed = float(program(_named(values), term.data)[0])
        assert abs(_integrated(rows, lambda m, rows=rows: _law(rows, values, m), values) - computed) < most


def test_a_reading_worth_three_is_three_readings():
    values = VALUES | {"gain_error": 0.01}
    rows = _rows(3, 12, values)
    worth = np.random.default_rng(4).integers(1, 4, 12).astype(float)
    copied = np.repeat(np.arange(12), worth.astype(int))
    several = SlidingRows(*(getattr(rows, name)[copied] for name in
        ("input_force", "output_force", "log_ratio", "stroke", "run", "velocity", "drift", "n_effective")),
        rows.angles.select(copied))  # fmt: skip
    loaded_cable = _cable(sensors=GAIN)
    weighted = _of_term(_runs_term(loaded_cable, replace(rows, n_effective=worth)), "log_likelihood", values)
    np.testing.assert_allclose(
        weighted, _of_term(_runs_term(loaded_cable, several), "log_likelihood", values), rtol=0, atol=1e-8
    )


def test_up_to_a_constant_of_the_data_a_reading_s_worth_is_its_power_in_the_likelihood():
    """Also fractions of a reading, as blocks have whose deviations stay alike; and whatever the parameters."""
    rows = _rows(5, 15, VALUES)
    rows = replace(rows, n_effective=np.random.default_rng(6).uniform(0.1, 2.5, 15))
    term, apart = _runs_term(_cable(), rows), []
    for values in (VALUES, VALUES | {"mu": 0.13}, VALUES | {"tau": 0.1}, VALUES | {"sigma_F": 1.0}):
        log_likelihood = _of_term(term, "log_likelihood", values)[0]
        apart.append(log_likelihood - _integrated(rows, _first_order(rows, values), values))
    np.testing.assert_allclose(apart, apart[0], rtol=0, atol=1e-8)


@pytest.fixture(scope="module", params=["drag", "load exponent"])
def binned_and_alone(request):
    """Log likelihood of 2000 readings in bins of the load and each by itself: at the truth and 5 % to each side of it."""
    more, extra = LAWS[request.param]
    values = VALUES | extra | {"sigma_F": 0.05}
    rows, loaded_cable = _rows(7, 2000, values), _cable(**more)
    points = [values | {name: value * factor for name, value in extra.items()} for factor in (0.95, 1.0, 1.05)]
    binned = _runs_term(loaded_cable, rows)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(runs_of_model, "_LOAD_BINS", 10**6)
        alone = _runs_term(loaded_cable, rows)
    assert len(binned.data.cells.mean) < 1000 and len(alone.data.cells.mean) == 2000
    return _at_each(binned, points), _at_each(alone, points)


@pytest.mark.extended
def test_bins_of_the_load_leave_the_load_dependence_where_each_reading_by_itself_puts_it(binned_and_alone):
    """The top of the parabola through three points, in units of the 5 % between them."""
    tops = [(low - high) / (2 * (low - 2 * middle + high)) for low, middle, high in binned_and_alone]
    assert abs(tops[0] - tops[1]) < 0.02  # 0.1 % of the parameter


def test_bins_of_the_load_do_not_take_the_change_of_friction_within_a_bin_for_noise(binned_and_alone):
    """What a bin hides adds to the scatter: the noise comes out too large by this share of the log likelihood a reading."""
    binned, alone = binned_and_alone
    assert np.abs(alone - binned).max() / 2000 < 0.025


# Whole recordings -------------------------------------------------------------------------------------------------

AS_READ = Preparation(delay="none", saturation="kept", dropouts=False, spikes=False, block="none")
SHORT = MotorProfile(speed=2.0, lead_in=0.5, cycles=1)
CAPSTAN, NO_FAULTS = BenchFriction(), LoadCellFaults()


def _recorded(
    angle: float, friction=CAPSTAN, faults=NO_FAULTS, seed=1, profile=SHORT, rate=80.0, m=0.0, settings=AS_READ
) -> Recording:
    """A recording of the simulated bench, prepared and cut into strokes."""
    bench, generator = BenchSettings(rate=rate), np.random.default_rng(seed)
    simulated = simulate_recording(MU * angle, friction, profile, bench, faults, generator, m)
    name = f"{angle:g} rad, {seed}"
    blocks, account = prepare(to_raw(simulated, name, f"{name}.csv"), settings)
    strokes = find_strokes(blocks, f"{name}.csv", name)
    own_angles = np.array([angle]), np.array([np.nan])
    return Recording(name, f"{name}.csv", name, float("nan"), *own_angles, blocks, strokes, account)


def _model(recordings, likelihood="whole", saturation="left out", **more) -> Model:
    table = {"files": "*.csv", "likelihood": likelihood, "prepare": {"saturation": saturation}}
    more = {"reference_force": REFERENCE_FORCE} | more
    description = cable(1, {"recordings": table}, contact=[CONTACT], **more).model_copy(update={"route": None})
    of_all = Recordings(("angle",), tuple(recordings), "mm/s")
    return build_model(Dataset(description, Measurements((of_all,)), {}))


def _whole(model: Model, recordings, censored=False) -> WholeRecordingsTerm:
    """The play operator run at every evaluation, also where sums would do."""
    of_all = Recordings(("angle",), tuple(recordings), "mm/s")
    angles = collect_row_angles(model.description, angles_of_recordings(of_all), None)
    return WholeRecordingsTerm(model.cable, stack_rope_recordings(of_all, angles, censored, 1.0), of_all.runs)


NOISY = LoadCellFaults(input_noise=0.2, output_noise=0.2)
BLOCK = {"mu": MU, "tau": 0.02, "sigma_block": 0.1}


def test_without_anything_that_changes_the_scale_whole_recordings_are_sums_over_runs():
    """Both of capstan friction: their log likelihoods as functions of the coefficient, and of the noise."""
    recordings = [
        _recorded(angle, faults=NOISY, seed=seed, m=m) for angle, seed, m in ((1.5, 1, 0.01), (3.0, 2, -0.02))
    ]
    model = _model(recordings)
    (sums,) = model.terms
    assert isinstance(sums, RunsTerm)
    whole = _whole(model, recordings)
    points = [BLOCK | change for change in ({}, {"mu": 0.14}, {"mu": 0.16}, {"tau": 0.05}, {"sigma_block": 0.2})]
    results = []
    for term in (sums, whole):
        program = jax.jit(term.log_likelihood)
        results.append([np.asarray(program(_named(v), term.data)) for v in points])
    by_sums, by_operator = np.array(results)
    apart = by_operator - by_sums
    np.testing.assert_allclose(apart[1:4], np.tile(apart[0], (3, 1)), rtol=0, atol=1e-6)
    np.testing.assert_allclose(whole.data.n, sums.data.n, rtol=0.02)  # blocks before the first slide


@pytest.mark.parametrize("likelihood", ["runs", "whole"])
@pytest.mark.parametrize("late", [-0.004, 0.004])
def test_an_output_that_comes_later_than_it_was_shifted_back_by_has_a_positive_error_of_its_delay(likelihood, late):
    """The bench shifts the whole output in time; forces that change by 2 to 300 % a second tell 4 ms to a tenth."""
    recording = _recorded(1.5, faults=LoadCellFaults(delay=late), profile=SHORT, rate=200.0)
    recordings = Recordings(("angle",), (recording,), "mm/s", delay_sd=0.01)
    model = _model([recording], likelihood)
    (term,) = model.terms if likelihood == "runs" else (_whole(model, recordings.items),)
    grid = np.linspace(-0.008, 0.008, 33)
    log_likelihood = jax.jit(jax.vmap(lambda d: term.log_likelihood(_named(BLOCK) | {"delay_error": d}, term.data)[0]))(grid)
    assert grid[int(np.argmax(log_likelihood))] == pytest.approx(late, abs=0.0006)


ALL = "drag+load-dependent+rate-dependent"
FULL = BLOCK | {"drag": 3.0, "load_exponent": 0.2, "stribeck": 0.2, "stribeck_speed": 15.0, "viscous": 0.002}
FULL |= {"input_offset": 0.4, "output_offset": -0.3, "gain_error": 0.01, "delay_error": 0.002}


@pytest.fixture(scope="module")
def gradients():
    """Derivatives of a log likelihood by all its parameters: by jax.grad, and by central differences."""
    friction = BenchFriction(0.2, REFERENCE, 3.0, 0.2, 15.0, 0.002)
    faults = replace(NOISY, gain_error=0.01, input_offset=0.4, output_offset=-0.3)
    recordings = [_recorded(1.5, friction, faults, 1), _recorded(3.0, friction, faults, 2)]
    model = _model(recordings, friction_model=ALL, sensors=GAIN | OFFSET)
    (term,) = model.terms
    assert isinstance(term, WholeRecordingsTerm)
    total = jax.jit(jax.value_and_grad(lambda values, data: term.log_likelihood(values, data).sum()))
    _, slope = total(_named(FULL), term.data)
    results = {}
    for name, value in FULL.items():
        h = 1e-6 * max(abs(value), 0.1)
        there, back = (float(total(_named(FULL | {name: value + sign * h}), term.data)[0]) for sign in (1, -1))
        results[name] = float(slope[name]), (there - back) / (2 * h)
    return results


@pytest.mark.extended
@pytest.mark.parametrize("name", FULL)
def test_gradients_of_whole_recordings_agree_with_finite_differences_in_every_parameter(gradients, name):
    slope, difference = gradients[name]
    assert slope == pytest.approx(difference, rel=1e-5, abs=1e-5)


@pytest.mark.parametrize("name", ["capstan", "drag and sensors"])
def test_the_mounting_effect_of_a_whole_recording_integrates_out(name):
    """Against quadrature over the operator itself, which is linear in m but for changes of contact and the bent scale."""
    drag, gain, of_input, of_output = (0.0, 0.0, 0.0, 0.0) if name == "capstan" else (3.0, 0.01, 0.4, -0.3)
    faults = LoadCellFaults(0.2, 0.2, None, gain, of_input, of_output)
    recording = _recorded(2.5, BenchFriction(drag=drag), faults, 3, m=0.02)
    more = {} if name == "capstan" else {"friction_model": "drag", "sensors": GAIN | OFFSET}
    model = _model([recording], **more)
    term = _whole(model, [recording])
    values = BLOCK | {} if name == "capstan" else BLOCK | {"drag": drag, "gain_error": gain,
        "input_offset": of_input, "output_offset": of_output}  # fmt: skip
    data = jax.tree.map(lambda array: np.asarray(array)[..., 0], term.data)
    x, passed = (np.log(data.likely_force + more - of_input + drag) for more in (0, data.input_noise))
    start = np.log((data.output_force[0] - of_output) * np.exp(gain) + drag)
    noise, tau = values["sigma_block"], values["tau"]

    def log_joint(m):
        y = play(x, MU * 2.5 + m, float(start))[0] + passed - x
        shown = (np.exp(y) - drag) * np.exp(-gain) + of_output
        squares = np.sum(data.weight * (data.reading - np.log(shown)) ** 2)
        return float(-squares / (2 * noise**2) + stats.norm.logpdf(m, 0.0, tau))

    constant = data.log_weights / 2 - data.n * np.log(noise * np.sqrt(2 * np.pi))
    grid = np.linspace(-0.01, 0.05, 601)
    index = np.array([log_joint(m) for m in grid])
    log_likelihood = _of_term(term, "log_likelihood", values)[0]
    exact = index.max() + np.log(integrate.trapezoid(np.exp(index - index.max()), grid)) + constant
    assert log_likelihood == pytest.approx(exact, abs=1e-8 if name == "capstan" else 1e-4)


FLAGGING = AS_READ.model_copy(update={"saturation": "left out"})


def test_a_saturated_block_speaks_against_whatever_would_have_shown_less():
    """The higher the force that is predicted where the output is at the end of its range, the likelier it is to be there."""
    recording = _recorded(2.5, faults=replace(NOISY, output_range=(-500.0, 70.0)), settings=FLAGGING)
    assert recording.blocks.saturated.sum() > 50
    model = _model([recording], saturation="censored", sensors=GAIN)
    term = model.terms[0]
    assert isinstance(term, WholeRecordingsTerm)
    assert np.count_nonzero(term.data.censored) == recording.blocks.saturated.sum()
    without = WholeRecordingsTerm(term.cable, replace(term.data, censored=0 * term.data.censored), term.labels)
    points = [BLOCK | {"gain_error": gain} for gain in (-0.1, 0.0, 0.1, 0.2, 0.3)]
    of_censored = _at_each(term, points) - _at_each(without, points)
    assert np.all(of_censored <= 0) and np.all(np.diff(of_censored) < 0)
    assert of_censored[0] > -1.0 and of_censored[-1] < -100.0  # left out they say nothing; censored they do


@pytest.mark.extended
@pytest.mark.parametrize(("likelihood", "model"), [("runs", "capstan"), ("whole", "capstan"), ("whole", "drag")])
@pytest.mark.parametrize("cell", ["output", "input"])
def test_saturated_blocks_that_are_left_out_do_not_pull_the_coefficient(cell, likelihood, model):
    """Whichever load cell was at the end of its range: the operator must not remember an input that the cell did not show."""
    limits = {f"{cell}_range": (-500.0, 75.0)}
    faults = LoadCellFaults(input_noise=0.02, output_noise=0.02, **limits)
    recordings = [_recorded(angle, BenchFriction(drag=4.0 * (model == "drag")), faults, int(angle), settings=FLAGGING)
                  for angle in (1.0, 2.0, 3.0)]  # fmt: skip
    assert all(r.blocks.saturated.sum() > 40 for r in recordings)
    solution = _fitted(_model(recordings, likelihood, friction_model=model)).estimates["mu"]
    assert solution.value == pytest.approx(MU, rel=2e-3 if model == "capstan" else 1e-2)


# Known truth ------------------------------------------------------------------------------------------------------


def _fitted(model: Model) -> LeastSquares:
    posterior = LogDensity(model)
    objective = make_objective(posterior)
    return fit_least_squares(posterior, objective, find_maximum_posterior(posterior, objective).z)


RATE = {"stribeck": 0.3, "stribeck_speed": 15.0, "viscous": 0.002}
TRUTHS = {
    "capstan": {},
    "drag": {"drag": 4.0},
    "load-dependent": {"load_exponent": 0.4},
    "drag+load-dependent+rate-dependent": {"drag": 3.0, "load_exponent": 0.2} | RATE,
}


@pytest.mark.extended
@pytest.mark.parametrize(
    ("options", "likelihood"),
    [
        *((options, "runs") for options in TRUTHS),
        ("drag", "whole"),
        *(pytest.param(options, "whole", marks=pytest.mark.slow) for options in TRUTHS if options != "drag"),
    ],
)
def test_least_squares_of_faultless_recordings_returns_what_they_were_made_with(options, likelihood):
    """To the last digits, but for the bins of the load, and turns between two samples where friction depends on speed."""
    truth = TRUTHS[options]
    friction = BenchFriction(reference_force=REFERENCE, **truth)
    speeds = (0.5, 1.0, 2.0, 3.0) if "stribeck" in truth else (2.0,) * 4
    recordings = [_recorded(angle, friction, profile=replace(SHORT, speed=speed))
                  for angle, speed in zip((1.0, 2.0, 3.0, 4.0), speeds, strict=True)]  # fmt: skip
    model = _model(recordings, likelihood, friction_model=options)
    estimates = _fitted(model).estimates
    stated_at = model.cable.friction.conditions.reference_speed
    mu = MU * (
        float(rate_factor(jnp.asarray(stated_at), *map(jnp.asarray, RATE.values()))) if "stribeck" in truth else 1.0
    )
    by_bins = 2e-3 if "stribeck" in truth else 5e-4  # two dozen bins of the load, and of the speed
    limit = by_bins if likelihood == "runs" else 2e-4 if "stribeck" in truth else 1e-10
    for name, value in ({"mu": mu} | truth).items():
        assert estimates[name].identified
        assert estimates[name].value == pytest.approx(value, rel=limit)


def test_joining_the_blocks_of_a_long_recording_keeps_the_ends_of_its_phases():
    state = np.repeat([0, 1, 0, -1, 0, 1], [3, 50, 2, 41, 1, 30])
    starts = group_starts(state, 30)
    groups = np.split(np.arange(len(state)), starts[1:])
    assert all(len(set(state[group])) == 1 for group in groups)
    edges = np.flatnonzero(np.diff(state) != 0)
    for end in (*edges, *(edges + 1)):
        assert [end] in [list(group) for group in groups]
    assert len(groups) < 60
    np.testing.assert_array_equal(group_starts(state, len(state)), np.arange(len(state)))


@pytest.mark.extended
def test_a_joined_recording_gives_the_same_coefficient(monkeypatch):
    recordings = [_recorded(angle, faults=NOISY) for angle in (1.0, 2.0, 3.0)]
    whole = _fitted(_model(recordings, "whole", friction_model="drag")).estimates["mu"]
    monkeypatch.setattr("bowdenfit.kinds.recordings.blocks.MOST_BLOCKS", 80)
    group_starts = _fitted(_model(recordings, "whole", friction_model="drag")).estimates["mu"]
    assert group_starts.value == pytest.approx(whole.value, abs=0.3 * whole.standard_error)
