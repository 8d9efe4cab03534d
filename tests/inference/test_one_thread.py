"""Linear algebra keeps to one thread while ours use the cores, and has all of its own again afterwards."""

from collections.abc import Iterator

import pytest
from threadpoolctl import threadpool_info, threadpool_limits

import bowdenfit as bf
from bowdenfit.inference.batch.fitting import fit_batch
from bowdenfit.inference.batch.programs import BatchSettings
from bowdenfit.inference.log_density import LogDensity

FEW = ("sampler.n_ensembles=2", "sampler.n_walkers=32", "sampler.max_steps=200", "sampler.target_ess=100")


def threads() -> set[int]:
    """That each library of linear algebra has."""
    return {library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas"}


@pytest.fixture(autouse=True)
def as_in_a_notebook(monkeypatch) -> Iterator[None]:
    """Two threads each, which nobody has forbidden."""
    monkeypatch.delenv("OPENBLAS_NUM_THREADS", raising=False)
    with threadpool_limits(2, user_api="blas"):
        yield


def test_while_walkers_move(on_body):
    seen = set()
    bf.fit(on_body, seed=1, settings=FEW, progress=lambda *_: seen.update(threads()))
    assert seen == {1}
    assert threads() == {2}


def test_while_a_batch_is_fitted(on_body_squares):
    seen = set()

    def seeds():
        seen.update(threads())
        yield 1

    settings = BatchSettings(nuts=False, target_sd_error=1.0)
    fit_batch(LogDensity(on_body_squares.model), [LogDensity(on_body_squares.model).data], seeds(), settings)
    assert seen == {1}
    assert threads() == {2}
