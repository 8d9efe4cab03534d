"""Importance sampling from learnt mixtures: a bent target of known moments, one beyond reach, and the answers of walkers."""

from types import SimpleNamespace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from creeping_rope import Truth, write_bench
from scipy import stats

import bowdenfit as bf
from bowdenfit.description import SamplerSettings
from bowdenfit.inference.chain import SamplingRequest
from bowdenfit.inference.importance import compile_densities, sample
from bowdenfit.inference.least_squares import MaximumPosterior
from bowdenfit.models import Model
from bowdenfit.questions.summary.methods import sampler_text

NAMES = ("along", "bent", "far")
SEEDS = 20
FAILURE_RATE = 1e-3  # that one of all the comparisons of a correct sampler fails


def draw(log_density, names, seed):
    """A chain of a density in z whose maximum is sought far from where it is."""
    posterior = SimpleNamespace(model=SimpleNamespace(space=SimpleNamespace(free=[SimpleNamespace(name=n) for n in names])))
    start = MaximumPosterior(np.zeros(len(names)), np.eye(len(names)))
    request = SamplingRequest(posterior, start, SamplerSettings(), seed)
    with jax.enable_x64(True):
        return sample(request, compile_densities(lambda z, _: log_density(z), None, len(names)))


def bent(z):
    """`along` is Normal(2, 0.3), `bent` Normal(along^2 / 2, 0.1), and `far` Student's t of five degrees of freedom about -3."""
    along, at_bend = (z[0] - 2) / 0.3, (z[1] - z[0] ** 2 / 2) / 0.1
    return -0.5 * along**2 - 0.5 * at_bend**2 - 3 * jnp.log1p((z[2] + 3) ** 2 / 5)


def test_bent_target_is_drawn_as_it_is():
    mean_square = 2.0**2 + 0.3**2
    expected = {"along": 2.0, "bent": mean_square / 2, "far": -3.0}
    tails = {"along": stats.norm(2, 0.3), "far": stats.t(5, -3)}
    limit = stats.norm.isf(FAILURE_RATE / 2 / (SEEDS * 3))
    below = {name: [] for name in tails}
    for seed in range(SEEDS):
        chain = draw(bent, NAMES, seed)
        assert chain.reasons == () and chain.pareto_k < 0.7
        assert chain.z.shape == (4, 500, 3)
        for i, name in enumerate(NAMES):
            error = np.hypot(chain.diagnostics[name].mcse_mean, chain.z[..., i].std() / np.sqrt(chain.z[..., i].size))
            assert abs(chain.z[..., i].mean() - expected[name]) < limit * error, name
        for name, distribution in tails.items():
            below[name].append(np.mean(chain.z[..., NAMES.index(name)] < distribution.ppf(0.05)))
    for shares in below.values():  # at least 1000 effective draws of each seed
        assert abs(np.mean(shares) - 0.05) < limit * np.sqrt(0.05 * 0.95 / (1000 * SEEDS))


@pytest.mark.parametrize("value", [jnp.nan, -jnp.inf])
def test_a_density_that_cannot_be_computed_anywhere_near_is_refused(value):
    chain = draw(lambda z: jnp.where(jnp.abs(z[0]) > 1e6, 0.0, value), ("a", "b"), 1)
    assert chain.pareto_k == np.inf and "Pareto k is inf" in chain.reasons[0]
    assert chain.steps == 512


def test_target_beyond_reach_is_refused_early():
    """Eight Cauchy distributions: no mixture of Student distributions of five degrees of freedom bounds their weights."""
    chain = draw(lambda z: -jnp.sum(jnp.log1p(z**2)), tuple("abcdefgh"), 1)
    assert any("the importance weights are too uneven" in reason for reason in chain.reasons)
    assert chain.steps == 512


def test_seed_decides_the_draws():
    assert np.array_equal(draw(bent, NAMES, 3).z, draw(bent, NAMES, 3).z)
    assert not np.array_equal(draw(bent, NAMES, 3).z, draw(bent, NAMES, 4).z)


@pytest.mark.slow
def test_loop_gets_the_answer_of_walkers(tmp_path):
    fits = [
        bf.fit("datasets/synthetic-haptic-loop", seed=1, sampler=sampler, output=tmp_path / sampler, figures=False)
        for sampler in ("importance", "emcee")
    ]
    assert all(fit.verdict().trusted for fit in fits)
    assert fits[0].posterior.sampler == "importance"
    for name in fits[0].posterior.values:
        by_weights, by_walkers = (fit.posterior.values[name].ravel() for fit in fits)
        sd = by_walkers.std()
        for probability in (0.05, 0.5, 0.95):
            assert abs(np.quantile(by_weights, probability) - np.quantile(by_walkers, probability)) < 0.2 * sd, name


@pytest.mark.slow
def test_creeping_rope_is_drawn_by_importance_sampling(tmp_path):
    write_bench(tmp_path / "bench", "dahl", Truth(0.3, 25.0))
    fit = bf.fit(tmp_path / "bench", seed=1, output=tmp_path / "fit", figures=False)
    assert fit.converged
    assert fit.posterior.sampler == "importance" and fit.posterior.pareto_k < 0.7
    low, high = np.quantile(fit.posterior.values["presliding_stiffness"], (0.001, 0.999))
    assert low < 25 < high
    stored = bf.load(tmp_path / "fit")
    assert stored.posterior.pareto_k == fit.posterior.pareto_k
    assert sampler_text(stored.summary()["sampler"]).startswith("importance sampling, 4 batches of ")


@pytest.mark.extended
def test_walkers_follow_where_weighted_draws_do_not_suffice(monkeypatch):
    """The on-body data set is beyond a mixture's reach: a funnel of four readings and three coefficients."""
    monkeypatch.setattr(Model, "is_slow", True)
    fit = bf.fit("datasets/on-body-exoskeleton", seed=1, figures=False)
    assert fit.converged
    assert fit.posterior.sampler == "emcee" and fit.posterior.pareto_k is None


@pytest.mark.extended
def test_stated_importance_sampling_is_refused_where_it_does_not_suffice():
    fit = bf.fit("datasets/on-body-exoskeleton", seed=1, sampler="importance", figures=False)
    assert not fit.converged and fit.posterior.pareto_k > 0.7
    assert "Fit again with --sampler emcee" in " ".join(str(fit).split())
