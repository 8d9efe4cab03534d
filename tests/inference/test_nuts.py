"""The second sampler: known targets, its checkpoint and its diagnostics."""

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy import stats

import bowdenfit as bf
from bowdenfit.description import SamplerSettings
from bowdenfit.inference import nuts
from bowdenfit.inference.chain import SamplingRequest
from bowdenfit.inference.checkpoint import checkpoint_header
from bowdenfit.inference.diagnostics import Trajectories, compute_energy_mixing, describe_trajectory_shortfalls
from bowdenfit.inference.least_squares import MaximumPosterior
from bowdenfit.parameters.priors import Normal
from bowdenfit.parameters.space import Parameter
from bowdenfit.questions.summary.details import details_text

pytestmark = pytest.mark.extended

DATA = Path(__file__).parents[2] / "datasets"
YARN = DATA / "yarn-on-cylinder"
QUICK = ("sampler.n_chains=8", "sampler.max_steps=300", "sampler.target_ess=100", "sampler.target_r_hat=1.2")
SETTINGS = SamplerSettings(n_chains=16, max_steps=1000, target_ess=1500, target_r_hat=1.02)


# Known targets ----------------------------------------------------------------------------------------------------


class Stop(Exception):
    """Stands for the user's interrupt."""


SCALES = np.array([0.1, 1.0, 10.0])
PRECISION = np.linalg.inv((0.9 + 0.1 * np.eye(3)) * np.outer(SCALES, SCALES))


def log_funnel(z):
    """Neal's funnel: the second coordinate's scale is exp of the first; the third is a standard normal beside it."""
    return -0.5 * z[0] ** 2 - 0.5 * (z[1] * jnp.exp(-z[0])) ** 2 - z[0] - 0.5 * z[2] ** 2


def log_normals(z):
    """Three normals of unlike scales and correlation 0.9."""
    return -0.5 * z @ jnp.asarray(PRECISION) @ z


def log_two_modes(z):
    """Standard normals about -20 and 20."""
    return jnp.logaddexp(-0.5 * jnp.sum((z - 20) ** 2), -0.5 * jnp.sum((z + 20) ** 2))


KNOWN = (log_funnel, log_normals, log_two_modes)


class Target:
    """A density known in closed form, in place of a posterior; which of them is told by its data, for one program of all."""

    def __init__(self, log_density):
        names = [f"x{i}" for i in range(3)]
        free = tuple(Parameter(n, n, n, "friction", Normal(0.0, 1.0)) for n in names)
        self.model = SimpleNamespace(space=SimpleNamespace(free=free, size=3))
        self.data = (np.array(KNOWN.index(log_density)),)

    def log_density(self, z, data):
        return jax.lax.switch(data[0], KNOWN, z)


@pytest.fixture(scope="module")
def program():
    """What samples every target."""
    return nuts.compile_nuts(Target(log_normals), SETTINGS)


def sampled(log_density, program, covariance: np.ndarray, settings: SamplerSettings = SETTINGS, **options):
    start = MaximumPosterior(np.zeros(3), covariance)
    return nuts.sample(SamplingRequest(Target(log_density), start, settings, 1, **options), program)


def z_scores(chain, true_means) -> list[float]:
    """Means of functions of the draws against the truth, in standard errors from the chains, which are independent."""
    scores = []
    for function, truth in true_means:
        by_chain = function(chain.z).mean(axis=1)
        scores.append((by_chain.mean() - truth) / (by_chain.std(ddof=1) / np.sqrt(len(by_chain))))
    return scores


@pytest.fixture(scope="module")
def funnel(program):
    """The narrow end is 20 times narrower at -3 than in the middle."""
    return sampled(log_funnel, program, np.eye(3), replace_settings(max_steps=4000, target_ess=200_000))


def replace_settings(**changes) -> SamplerSettings:
    return SETTINGS.model_copy(update=changes)


@pytest.mark.slow
def test_nuts_reproduces_a_funnel_down_to_its_narrow_end(funnel):
    """Shares of the standard normal coordinate below four levels; all 16-chain t-scores within p = 1e-4 / 4.

    Chance fails this once in ten thousand seeds.
    """
    levels = (-2.0, -1.0, 0.0, 1.5)
    truths = [(lambda z, level=level: z[..., 0] < level, stats.norm.cdf(level)) for level in levels]
    limit = stats.t(15).isf(0.5e-4 / len(levels))
    assert max(map(abs, z_scores(funnel, truths))) < limit


@pytest.mark.slow
def test_fine_steps_get_through_where_the_others_break_off(funnel):
    trajectories = funnel.trajectories
    assert trajectories.fine_diverged <= trajectories.fine / 1000
    assert trajectories.fine == trajectories.total // nuts.FINE_EVERY
    assert describe_trajectory_shortfalls(trajectories) == ()


def test_nuts_reproduces_correlated_normals_of_unlike_scales(program):
    """Started from the wrong covariance; p = 1e-4 by chance."""
    chain = sampled(log_normals, program, np.eye(3))
    truths = [(lambda z, i=i: z[..., i], 0.0) for i in range(3)]
    truths += [(lambda z, i=i: z[..., i] ** 2, SCALES[i] ** 2) for i in range(3)]
    truths += [(lambda z: z[..., 0] * z[..., 2], 0.9)]
    assert max(map(abs, z_scores(chain, truths))) < stats.t(15).isf(0.5e-4 / len(truths))
    assert chain.reasons == ()
    assert chain.trajectories.diverged == 0


def test_a_density_of_two_modes_far_apart_is_not_called_converged(program):
    """Chains cannot cross; R-hat across them sees it."""
    chain = sampled(log_two_modes, program, 200 * np.eye(3), replace_settings(max_steps=200))
    assert any(reason.startswith("x0 spreads") for reason in chain.reasons)


# Diagnostics ------------------------------------------------------------------------------------------------------

GOOD = Trajectories(500, 10_000, 50, 1000, 0, 0, 0.8, 0.1, 1, {})


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({}, []),
        ({"fine_diverged": 2}, ["2 of 1000 trajectories of fine steps diverged"]),
        ({"diverged": 101}, ["101 of 10000 trajectories diverged"]),
        ({"energy_mixing": 0.2}, ["energy of a chain mixes slowly (E-BFMI 0.20"]),
        ({"energy_mixing": float("nan")}, ["energy of a chain"]),
    ],
)
def test_bad_trajectories_are_reasons_in_words(changes, says):
    reasons = describe_trajectory_shortfalls(replace(GOOD, **changes))
    assert len(reasons) == len(says)
    for reason, expected in zip(reasons, says, strict=True):
        assert expected in reason


def test_energy_mixing_is_that_of_the_worst_chain():
    """Independent energies have E-BFMI 2 (+- 0.2 in 500 draws); a slow one, whose steps are a tenth, about 0.01."""
    random = np.random.default_rng(1).normal(size=(4, 500))
    assert compute_energy_mixing(random) == pytest.approx(2.0, abs=0.4)
    random[2] = np.cumsum(0.1 * random[2])
    assert compute_energy_mixing(random) < 0.3
    assert np.isnan(compute_energy_mixing(np.ones((2, 10))))


# Fits -------------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def saved(tmp_path_factory):
    """A quick fit by NUTS with its folder."""
    folder = tmp_path_factory.mktemp("results") / "fit"
    return bf.fit(YARN, output=folder, sampler="nuts", seed=3, settings=QUICK, figures=False), folder


@pytest.mark.parametrize("point", [200, 600])
def test_resumed_chains_equal_those_that_were_never_interrupted(program, tmp_path, point):
    """Interrupted while tuning, and after."""

    def stop(progress):
        assert progress.sampler == "nuts"
        if progress.steps >= point:
            raise Stop

    def run(**options):
        return sampled(log_normals, program, np.eye(3), replace_settings(max_steps=300, target_ess=100), **options)

    path = tmp_path / "chain.checkpoint"
    path.write_bytes(checkpoint_header({}))
    with pytest.raises(Stop):
        run(checkpoint=path, report=stop)
    np.testing.assert_array_equal(run(checkpoint=path, resume=True).z, run().z)


def test_resume_tops_up_a_fit_that_has_not_converged_and_refuses_another_sampler(tmp_path):
    folder, settings = tmp_path / "fit", (*QUICK, "sampler.target_r_hat=1.0000001")
    fit = bf.fit(YARN, output=folder, sampler="nuts", seed=5, settings=settings, figures=False)
    with pytest.raises(bf.StoreError, match="description changed"):
        bf.fit(YARN, output=folder, resume=True, settings=settings)
    more = (*settings, "sampler.max_steps=500")
    longer = bf.fit(YARN, output=folder, sampler="nuts", resume=True, settings=more, figures=False)
    assert (fit.posterior.steps, longer.posterior.steps) == (300, 500)
    np.testing.assert_array_equal(longer.posterior.z[:, :300], fit.posterior.z)
    assert not longer.converged


def test_statistics_of_trajectories_are_stored_under_arviz_s_names(saved, tmp_path):
    import xarray

    fit, _ = saved
    fit.save(tmp_path / "copy")
    with xarray.open_datatree(tmp_path / "copy" / "posterior.nc", engine="h5netcdf") as tree:
        names = {"lp", "diverging", "energy", "acceptance_rate", "tree_depth", "n_steps"}
        assert set(tree["sample_stats"].data_vars) == names
        energy, lp = tree["sample_stats"]["energy"].values, tree["sample_stats"]["lp"].values
    assert np.all(energy > -lp - 1e-9)  # the rest is kinetic
    page = json.loads((tmp_path / "copy" / "summary.json").read_text())["sampler"]
    assert page["method"] == "nuts"
    assert page["total"] == 8 * fit.posterior.steps


def test_the_summary_says_how_trajectories_went(saved):
    text = " ".join(details_text(saved[0]).split())
    assert "NUTS, 8 chains of 300 draws after 500 of warm-up" in text
    assert "no trajectory diverged; energy mixing (E-BFMI)" in text


def test_an_unknown_sampler_is_a_sentence():
    with pytest.raises(bf.UsageError, match="sampler = 'gibbs' is unknown; choose one of emcee, nuts, importance, both"):
        bf.fit(YARN, sampler="gibbs")
