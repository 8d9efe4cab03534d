"""Tables whose repeated readings are alike to the last digit: an interval that is narrower than that digit is not trusted."""

import numpy as np
import pytest

import bowdenfit as bf
from bowdenfit.kinds.plausibility import find_coarse_readings
from bowdenfit.questions.summary.brief import summary_text
from bowdenfit.questions.summary.details import details_text
from bowdenfit.questions.summary.verdict import COARSE

pytestmark = pytest.mark.extended

QUICK = ("sampler.n_walkers=64", "sampler.target_ess=200", "sampler.target_r_hat=1.05", "sampler.max_steps=2000")
CABLE = """
schema = 1
name = "Ring"
[[contact]]
name = "housing"
friction = "mu"
wrap_angle = { value = 180, unit = "deg" }
[tables]
forces = { file = "forces.csv" }
"""
TRUE_MU = 0.118  # 20 N become 13.8 N


@pytest.mark.parametrize(
    ("read", "last_digit"),
    [
        ([14.0, 14.0, 14.0, 14.0], "1 N"),
        ([14.0, 14.0, 14.0], None),  # of so few, chance
        ([14.0, 14.0, 14.0, 15.0], None),
        ([0.07, 0.07, 0.07, 0.07], "0.01 N"),
        ([1200.0, 1200.0, 1200.0, 1200.0], "100 N"),
        ([3e7, 3e7, 3e7, 3e7], "1e+06 N"),
        ([62.275, 62.275, 62.275, 62.275], "0.001 N"),
        ([1 / 3, 1 / 3, 1 / 3, 1 / 3], None),  # computed
        ([0.0, 0.0, 0.0, 0.0], None),
        ([-14.0, -14.0, -14.0, -14.0], None),
    ],
)
def test_readings_of_the_same_that_are_alike_tell_their_last_digit(read, last_digit):
    coarse = find_coarse_readings("forces.csv", np.full((len(read), 1), 20.0), np.array(read), "N")
    assert (coarse and coarse.last_digit) == last_digit


def test_readings_at_different_settings_need_not_be_alike():
    """Three of the six were read before; the logarithm of 10 is open by more than that of 20."""
    settings, read = np.array([[20.0, np.nan]] * 3 + [[40.0, np.nan]] * 3), np.array([10.0] * 3 + [20.0] * 3)
    coarse = find_coarse_readings("forces.csv", settings, read)
    assert coarse.different == 2
    assert coarse.log_sd == pytest.approx(np.sqrt((1 / 1 + 1 / 4) / 2 / 12))  # the last digit is that of tens
    settings[1] = 30.0
    assert find_coarse_readings("forces.csv", settings[:4], read[:4]) is None


def _fit(folder, digits, noise, runs=8):
    """Of eight mountings at one load, read with some digits behind the point."""
    (folder / "cable.toml").write_text(CABLE)
    true = 20 * np.exp(-TRUE_MU * np.pi) * np.exp(noise * np.random.default_rng(5).standard_normal(runs))
    rows = [f"r{i},pull,20,{force:.{digits}f}" for i, force in enumerate(true)]
    (folder / "forces.csv").write_text("\n".join(["run,stroke,input_force_N,output_force_N", *rows]) + "\n")
    return bf.fit(folder, seed=1, settings=QUICK)


def test_a_display_of_whole_newtons_that_hides_the_scatter_is_not_trusted(tmp_path):
    """Read as 14 N eight times: the interval is of no width and far from the truth. One digit more, and it holds it."""
    hidden = _fit(tmp_path, 0, 0.003)
    assert not hidden.parameter("mu").q05 < TRUE_MU < hidden.parameter("mu").q95
    (sentence,) = hidden.verdict().troubles[COARSE]
    assert sentence.startswith("Repeated readings in forces.csv agree to the last digit, 1 N,")
    assert "uncertain by up to 3.6 % either way" in sentence
    assert "state its standard deviation: [prior.sigma_F] fixed = 0.29 in cable.toml." in sentence
    assert "the readings are too coarse for such intervals" in " ".join(summary_text(hidden).split())
    assert "READINGS TOO COARSE" in details_text(hidden)
    shown = _fit(tmp_path, 2, 0.003)
    assert shown.verdict().trusted
    assert shown.parameter("mu").q05 < TRUE_MU < shown.parameter("mu").q95


@pytest.mark.slow
def test_scatter_that_is_stated_needs_no_digits(tmp_path):
    """Of one reading with what its last digit leaves open, and of efficiencies with a standard deviation."""
    (tmp_path / "cable.toml").write_text(CABLE + "[prior.sigma_F]\nfixed = 0.29\n")
    (tmp_path / "forces.csv").write_text("run,stroke,input_force_N,output_force_N\nr0,pull,20,14\n")
    single_fit = bf.fit(tmp_path, seed=1, settings=QUICK)
    assert COARSE not in single_fit.verdict().troubles
    assert single_fit.parameter("mu").q05 < TRUE_MU < single_fit.parameter("mu").q95
    (tmp_path / "efficiencies.csv").write_text("wrap_angle_deg,efficiency,efficiency_sd\n" + "180,0.7,0.03\n" * 6)
    setting = bf.fit(tmp_path / "efficiencies.csv", seed=1, settings=QUICK)
    assert COARSE not in setting.verdict().troubles
    (tmp_path / "efficiencies.csv").write_text("wrap_angle_deg,efficiency\n" + "180,0.7\n" * 6)
    (sentence,) = bf.fit(tmp_path / "efficiencies.csv", seed=1, settings=QUICK).verdict().troubles[COARSE]
    assert sentence.endswith("state its standard deviation: a column efficiency_sd with 0.029.")


@pytest.mark.slow
def test_intervals_that_are_not_trusted_miss_and_those_that_are_hold(tmp_path):
    """Of 40 benches whose readings scatter by a tenth of the last digit up to one of it, none that was refused held its truth.

    Of intervals of 90 % among 20 or more, fewer than three quarters hold in 1 of 90 such sets, where all is right.
    """
    held = {"refused": [], "trusted": []}
    for seed in range(40):
        generator, folder = np.random.default_rng(seed), tmp_path / str(seed)
        folder.mkdir()
        mu, scatter = generator.uniform(0.06, 0.25), (0.1, 0.25, 0.5, 1.0)[seed % 4]
        forces = np.round(20 * np.exp(-mu * np.pi) + scatter * generator.standard_normal(8))
        rows = [f"r{i},pull,20,{force:g}" for i, force in enumerate(forces)]
        (folder / "cable.toml").write_text(CABLE)
        (folder / "forces.csv").write_text("\n".join(["run,stroke,input_force_N,output_force_N", *rows]) + "\n")
        fit = bf.fit(folder, seed=1, settings=QUICK)
        verdict, shown = fit.verdict(), fit.parameter("mu")
        if verdict.trusted or COARSE in verdict.troubles:
            held["trusted" if verdict.trusted else "refused"].append(shown.q05 < mu < shown.q95)
    assert len(held["refused"]) >= 5 and len(held["trusted"]) >= 20
    assert np.mean(held["refused"]) < 0.3 and np.mean(held["trusted"]) >= 0.75, held
