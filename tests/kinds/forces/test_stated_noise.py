"""Standard deviations stated with each force: how they are read and used, and whether intervals hold."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy import stats

import bowdenfit as bf
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.kinds.forces.next_run import typical_run
from bowdenfit.kinds.forces.stated_noise import STATED_NOISE, log_ratio_variance
from bowdenfit.kinds.forces.table import ForceTable
from bowdenfit.kinds.runs import RunsTerm
from bowdenfit.kinds.term import Truth
from bowdenfit.kinds.terms import TERMS
from bowdenfit.models import build_model

HEAD = "wrap_angle_deg,run,stroke,input_force_N,output_force_N"
SDS = ",input_force_sd_N,output_force_sd_N"
ANGLES, LOADS = (45.0, 90.0, 135.0, 180.0), (20.0, 40.0, 60.0)
TOML = """schema = 1
name = "bench"
[friction.mu]
prior = { lognormal = { median = 0.12, log_sd = 0.3 } }
[prior.tau]
prior = { half_normal = { sd = 0.005 } }
PRIOR
[[contact]]
name = "sheath"
friction = "mu"
wrap_angle = { column = "wrap_angle" }
[tables]
forces = { file = "t.csv" }
"""
OF_NOISE = "[prior.sigma_F]\nprior = { half_normal = { sd = 2 } }"


def bench(generator, mu, tau, sd=0.15, runs=6):
    """Rows of a bench whose second half of each run is ten times as noisy; NumPy alone."""
    rows = []
    for run in range(runs):
        angle, mounting = ANGLES[run % 4], tau * generator.standard_normal()
        for i in range(8):
            stroke, force, noise = (1, -1)[i % 2], LOADS[i % 3], sd * (10 if i >= 4 else 1)
            out = force * np.exp(-stroke * (mu * np.deg2rad(angle) + mounting))
            read = np.array([force, out]) + noise * generator.standard_normal(2)
            rows.append([angle, run + 1, "pull" if stroke > 0 else "return", *read, noise, noise])
    return rows


def write(folder, rows, stated_value=True, toml=True):
    folder.mkdir(exist_ok=True)
    lines = [",".join(map(str, row[: 7 if stated_value else 5])) for row in rows]
    (folder / "t.csv").write_text("\n".join([HEAD + (SDS if stated_value else ""), *lines]) + "\n")
    if toml:
        (folder / "cable.toml").write_text(TOML.replace("PRIOR", "" if stated_value else OF_NOISE))
    return folder


def table_of(folder):
    return bf.read(folder).measurements.table(ForceTable)


def read(tmp_path, head, rows, **keywords):
    (tmp_path / "t.csv").write_text("\n".join([head, *rows]) + "\n", encoding="utf-8")
    return bf.read(tmp_path / "t.csv", wrap_angle="180deg", **keywords)


@pytest.mark.parametrize(
    ("head", "row"),
    [
        ("input_force_N,input_force_sd_N,output_force_N,output_force_sd_N", "20,0.1,15,0.2"),
        ("Input force (N),Input force SD (N),Output force (N),Output force (N) SD", "20,0.1,15,0.2"),
        ("F_in [N],sd F_in [N],F_out [N],F_out ± [N]", "20,0.1,15,0.2"),
        ("Kraft Eingang (N),Standardabweichung Kraft Eingang (N),Kraft Ausgang (N),Kraft Ausgang Stabw (N)", "20,0.1,15,0.2"),
        ("input_force_N,input_force_sd [mN],output_force_N,output_force_sd [mN]", "20,100,15,200"),
        ("input_force_N,output_force_N", "20 ± 0.1,15 ± 0.2"),
    ],
)
def test_standard_deviations_of_forces_are_read(tmp_path, head, row):
    dataset = read(tmp_path, head, [row, row])
    assert dataset.measurements.table(ForceTable).sd == pytest.approx(np.tile([0.1, 0.2], (2, 1)))
    assert any("are taken for the noise of these readings" in remark for remark in dataset.measurements.remarks)


def test_those_of_torques_and_behind_a_lever_are_those_of_the_rope(tmp_path):
    (tmp_path / "t.csv").write_text(
        "input_torque [N*mm],input_torque_sd [N*mm],output_force_N,output_force_sd_N,wrap_angle_deg\n200,2,15,0.2,90\n"
    )
    (tmp_path / "cable.toml").write_text(
        TOML.replace("PRIOR", "")
        + '[cable]\ninput_pulley_radius = { value = 10, unit = "mm" }\n[sensors]\noutput_ratio = 0.5\n'
    )
    assert table_of(tmp_path).sd == pytest.approx(np.array([[0.2, 0.1]]))


@pytest.mark.parametrize(
    ("head", "rows", "words"),
    [
        (SDS, ["20,15,0,0.2"], "row 2, column 'input_force_sd_N': a standard deviation of '0' is not possible"),
        (SDS, ["20,15,0.1,-0.2"], "a standard deviation of '-0.2' is not possible"),
        (SDS, ["20,15,0.1,15"], "a standard deviation of '15' is as large as the reading, '15'"),
        (SDS, ["20,15,0.1,0.2", "30,20,,0.2"], "row 3, column 'input_force_sd_N': the cell is blank, and other rows state"),
        (",input_force_sd_N,output_torque_sd [Nmm]", ["20,15,0.1,2"], "errors of a torque, and the readings of the output"),
        (",input_force_sd_percent,output_force_sd_percent", ["20,15,1,1"], "does not measure a force"),
    ],
)
def test_impossible_standard_deviations_are_refused(tmp_path, head, rows, words):
    with pytest.raises(bf.DatasetError) as refusal:
        read(tmp_path, "input_force_N,output_force_N" + head, rows)
    assert words in str(refusal.value)


def test_of_one_end_alone_they_are_not_used_but_where_weights_hang(tmp_path):
    head, rows = "input_force_N,output_force_N,output_force_sd_N", ["20,15,0.2", "30,22,0.2"]
    dataset = read(tmp_path, head, rows)
    assert dataset.measurements.table(ForceTable).sd is None
    assert any("are not used, because none is stated for the input force" in r for r in dataset.measurements.remarks)
    hung = ["sensors.input_force_noise={value=0,unit=\"N\"}"]
    assert read(tmp_path, head, rows, settings=hung).measurements.table(ForceTable).sd == pytest.approx(
        np.array([[0, 0.2], [0, 0.2]])
    )
    with pytest.raises(bf.DatasetError, match="leave one of the two out"):
        read(tmp_path, "input_force_N,output_force_N" + SDS, ["20,15,0.1,0.2"], settings=hung)


def test_files_of_which_some_state_them_are_refused(tmp_path):
    rows = bench(np.random.default_rng(0), 0.12, 0.005)
    write(tmp_path, rows, False)
    (tmp_path / "u.csv").write_text((tmp_path / "t.csv").read_text())
    write(tmp_path, rows)
    (tmp_path / "cable.toml").write_text(TOML.replace("PRIOR", "").replace('file = "t.csv"', 'files = ["t.csv", "u.csv"]'))
    with pytest.raises(bf.DatasetError, match=r"t\.csv states a standard deviation of each force, and u\.csv does not"):
        bf.read(tmp_path)


def test_large_ones_are_said(tmp_path):
    remarks = read(tmp_path, "input_force_N,output_force_N" + SDS, ["20,15,0.1,6", "20,15,0.1,0.1"]).measurements.remarks
    assert any("1 reading has a standard deviation above 30% of the force" in remark for remark in remarks)


def test_the_likelihood_is_that_of_readings_with_this_noise_and_a_common_mounting(tmp_path):
    model = build_model(bf.read(write(tmp_path, bench(np.random.default_rng(3), 0.12, 0.005))))
    (term,) = model.terms
    assert isinstance(term, RunsTerm) and [p.name for p in model.space.free] == ["mu", "tau"]
    assert [(p.name, p.fixed) for p in model.space.fixed] == [(STATED_NOISE, 1.0)]
    rows, values = term.rows, {"mu": 0.13, "tau": 0.004, STATED_NOISE: 1.0}
    expected = []
    for run in range(6):
        mask = rows.run == run
        angle = np.deg2rad(ANGLES[run % 4])
        covariance = np.diag(1 / rows.information[mask]) + 0.004**2
        expected.append(stats.multivariate_normal.logpdf(rows.log_ratio[mask], np.full(mask.sum(), 0.13 * angle), covariance))
    with jax.enable_x64(True):
        computed = term.log_likelihood({name: jnp.asarray(value) for name, value in values.items()}, term.data)
    assert np.asarray(computed) == pytest.approx(expected, rel=1e-9)


def test_weights_are_those_of_the_forces_that_a_run_expects(tmp_path):
    """The variance of a log ratio is that at the true forces, within what the quiet half of a run knows of these."""
    generator, folder = np.random.default_rng(5), tmp_path
    term = build_model(bf.read(write(folder, bench(generator, 0.12, 0.0)))).terms[0]
    stroke, force = np.tile([1, -1], 24), np.tile([LOADS[i % 3] for i in range(8)], 6)
    true = force * np.exp(-stroke * 0.12 * np.deg2rad(np.repeat([ANGLES[i % 4] for i in range(6)], 8)))
    sd = table_of(folder).sd
    variance = log_ratio_variance(sd, force, true)
    of_noisy = term.rows.information * variance
    assert np.sqrt(np.mean((of_noisy - 1) ** 2)) < 0.06  # from the readings themselves it is 0.07 and more


def test_held_readings_have_their_own_noise_too(tmp_path):
    rows = ["90,1,hold,20,18,0.1,0.1", "90,1,hold,20,18,0.1,1.5", "90,1,pull,20,16,0.1,0.1"]
    (tmp_path / "t.csv").write_text("\n".join([HEAD + SDS, *rows]) + "\n")
    (tmp_path / "cable.toml").write_text(TOML.replace("PRIOR", ""))
    held = build_model(bf.read(tmp_path)).terms[1]
    with jax.enable_x64(True):
        values = {"mu": jnp.asarray(0.05), "tau": jnp.asarray(0.001), STATED_NOISE: jnp.asarray(1.0)}
        quiet, noisy = np.asarray(held.log_likelihood(values, jax.tree.map(jnp.asarray, held.data)))
    assert noisy > quiet + 3  # 0.105 is outside the band of 0.079, by four standard deviations or by a third of one


@pytest.mark.extended
def test_simulated_readings_and_the_next_run_have_the_stated_noise(tmp_path):
    dataset = bf.read(write(tmp_path, bench(np.random.default_rng(1), 0.12, 0.0)))
    model, table = build_model(dataset), dataset.measurements.table(ForceTable)
    values = {"mu": 0.12, "tau": 0.0, STATED_NOISE: 1.0}
    with jax.enable_x64(True):
        keys = jax.random.split(jax.random.key(0), 400)
        draw = jax.vmap(lambda key: TERMS["forces"].draw(table, Truth(model.cable, None, values, key)))
        readings = draw(keys)
        spread = np.std(np.stack([readings["input_force"], readings["output_force"]], axis=-1), axis=0)
        run = typical_run(dataset.measurements)
    assert spread / table.sd == pytest.approx(np.ones((48, 2)), abs=0.2)  # 400 draws: 0.035 each, 96 of them
    assert run.noise == STATED_NOISE and sorted(set(np.round(run.sd[:, 1], 6))) == [0.15, 1.5]


def test_a_noisy_reading_that_gains_force_is_refused_only_where_its_noise_does_not_say_so(tmp_path):
    rows = bench(np.random.default_rng(2), 0.12, 0.0, sd=0.05)
    noisy = [*rows[0][:2], "pull", 20.0, 23.5, 1.0, 1.5]
    assert len(table_of(write(tmp_path / "stated", [*rows, noisy])).run) == 49
    with pytest.raises(bf.DatasetError, match="friction never lets more out"):
        bf.read(write(tmp_path / "quiet", [*rows, [*noisy[:5], 0.05, 0.05]]))


@pytest.mark.parametrize(("factor", "words"), [(1.0, ""), (0.4, "times as much as"), (4.0, "only"), (1.15, "")])
def test_it_is_said_where_readings_scatter_otherwise_than_stated(tmp_path, factor, words):
    rows = [[*row[:5], factor * row[5], factor * row[6]] for row in bench(np.random.default_rng(4), 0.12, 0.005)]
    dataset = bf.read(write(tmp_path, rows))
    warnings = [w for w in bf.check(dataset).warnings if "stated standard deviations say" in w]
    assert bool(words) == bool(warnings) and all(words in warning for warning in warnings)


class Quadrature:
    """Posterior of mu, and whatever else is free, on a grid of z; one compiled program for all tables of a shape."""

    def __init__(self, posterior, points):
        positions = np.linspace(-3.5, 3.5, points)
        grid = np.stack(np.meshgrid(*[positions] * posterior.model.space.size, indexing="ij"), axis=-1)
        self.z, self.at = grid.reshape(-1, grid.shape[-1]), positions
        self.density = jax.jit(jax.vmap(posterior.log_density, (0, None)))

    def mu(self, posterior):
        """The rank of a value of mu, as a function, and the width of the 90 % interval."""
        log_density = np.asarray(self.density(self.z, posterior.data)).reshape([len(self.at)] * self.z.shape[1])
        marginal = np.exp(log_density - log_density.max()).sum(axis=tuple(range(1, self.z.shape[1])))
        cdf = np.cumsum(marginal) - marginal / 2
        low, high = np.interp([0.05, 0.95], cdf / marginal.sum(), 0.12 * np.exp(0.3 * self.at))
        return (lambda mu: np.interp(np.log(mu / 0.12) / 0.3, self.at, cdf / marginal.sum())), high - low


@pytest.mark.parametrize("count", [12, pytest.param(150, marks=pytest.mark.slow)])
def test_intervals_hold_and_are_narrower_where_the_noise_of_each_reading_is_stated(tmp_path, count):
    """Truth drawn from the prior, readings by NumPy: ranks are uniform. Either assertion fails by chance once in 1000 seeds."""
    generator = np.random.default_rng(7)
    ranks, widths, quadratures = [], [], {}
    with jax.enable_x64(True):
        for number in range(count):
            mu, tau = 0.12 * np.exp(0.3 * generator.standard_normal()), 0.005 * abs(generator.standard_normal())
            rows = bench(generator, mu, tau, sd=0.15)
            for is_stated in (True, False):
                posterior = LogDensity(build_model(bf.read(write(tmp_path / f"{number}{is_stated}", rows, is_stated))))
                quadrature = quadratures.setdefault(is_stated, Quadrature(posterior, 281 if is_stated else 81))
                rank, width = quadrature.mu(posterior)
                widths.append(width)
                if is_stated:
                    ranks.append(float(rank(mu)))
    assert stats.kstest(ranks, "uniform").pvalue > 1e-3
    inside = sum(0.05 < rank < 0.95 for rank in ranks)
    assert stats.binomtest(inside, count, 0.9).pvalue > 1e-3
    assert np.mean(widths[0::2]) < 0.8 * np.mean(widths[1::2])
