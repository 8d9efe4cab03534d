"""Linear algebra keeps to one thread while ours use the cores, and has all of its own again afterwards."""

import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack

import numpy as np
import pytest
from own_angle_tables import of_rows
from threadpoolctl import threadpool_info, threadpool_limits

import bowdenfit as bf
from bowdenfit.inference.batch.fitting import fit_batch
from bowdenfit.inference.batch.programs import BatchSettings
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.inference.resources import linear_algebra_in_one_thread
from bowdenfit.models import build_model

FEW = ("sampler.n_ensembles=2", "sampler.n_walkers=32", "sampler.max_steps=200", "sampler.target_ess=100")


def threads() -> set[int]:
    """That each library of linear algebra has."""
    return {library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas"}


@pytest.fixture(autouse=True)
def as_in_a_notebook(monkeypatch) -> Iterator[None]:
    """Two threads each, which nobody has forbidden."""
    if not threads():
        pytest.skip("linear algebra is of a library whose threads nobody can count, such as a Mac's")
    monkeypatch.delenv("OPENBLAS_NUM_THREADS", raising=False)
    with threadpool_limits(2, user_api="blas"):
        yield


@pytest.mark.extended
def test_while_walkers_move(on_body):
    seen = set()
    bf.fit(on_body, seed=1, settings=FEW, progress=lambda *_: seen.update(threads()))
    assert seen == {1}
    assert threads() == {2}


@pytest.mark.extended
def test_while_a_batch_is_fitted():
    seen = set()

    def seeds():
        seen.update(threads())
        yield 1

    angle = np.deg2rad([[40.0], [80.0], [120.0]])
    posterior = LogDensity(build_model(of_rows(0.1 * angle[:, 0] + [0.01, -0.02, 0.01], angle)))
    fit_batch(posterior, [posterior.data], seeds(), BatchSettings(nuts=False, target_sd_error=1.0))
    assert seen == {1}
    assert threads() == {2}


def test_while_any_of_several_is_at_it():
    """In whichever order they end."""
    first, second = ExitStack(), ExitStack()
    for item in (first, second):
        item.enter_context(linear_algebra_in_one_thread())
    first.close()
    assert threads() == {1}
    second.close()
    assert threads() == {2}


@pytest.mark.extended
def test_whichever_library_is_loaded_by_then():
    """The one that compiled programs call is loaded late."""
    code = (
        "from threadpoolctl import threadpool_info\n"
        "from bowdenfit.inference.resources import linear_algebra_in_one_thread\n"
        "with linear_algebra_in_one_thread():\n"
        "    import jax, scipy.linalg\n"
        "    print(*(one['num_threads'] for one in threadpool_info() if one['user_api'] == 'blas'))"
    )
    process = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert set(process.stdout.split()) == {"1"}
