"""The search for the best fit begins at values of the user's too, which must be possible, and which the fit keeps."""

import re

import jax
import numpy as np
import pytest

import bowdenfit as bf
from bowdenfit.errors import UsageError
from bowdenfit.inference.least_squares import find_maximum_posterior, read_start
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.inference.objective import Problem, make_objective
from bowdenfit.models import build_model

START = {"mu1": 0.3, "mu3": 0.05}


def test_the_search_begins_at_the_stated_values_besides_its_own(on_body, monkeypatch):
    starts = []
    solve = Problem.solve
    monkeypatch.setattr(Problem, "solve", lambda self, start, *more: (starts.append(start), solve(self, start, *more))[1])
    with jax.enable_x64(True):
        density = LogDensity(build_model(bf.read(on_body)))
        space, objective = density.model.space, make_objective(density)
        usual = find_maximum_posterior(density, objective)
        count = len(starts)
        again = find_maximum_posterior(density, objective, read_start(space, START))
        assert len(starts) == 2 * count + 1
        values = {name: float(value) for name, value in space.constrain(starts[-1]).items()}
    assert {name: values[name] for name in START} == pytest.approx(START)
    np.testing.assert_allclose(again.z, usual.z, atol=1e-4)


def test_a_fit_keeps_where_it_began_and_is_as_good(on_body, run, tmp_path):
    folder, blank = tmp_path / "fit", "\N{NO-BREAK SPACE}"
    command = ("fit", on_body, "--no-mcmc", "--no-figures", "--seed", "1", "-o", folder)
    code, printed, _ = run(*command, "--start", "mu1=0.3", "--start", "mu3=0.05")
    fit = bf.load(folder)
    assert (code, fit.provenance.start) == (0, START) and printed
    assert "search began at mu1 = 0.3 and mu3 = 0.05 too" in (folder / "report.html").read_text().replace(blank, " ")
    usual = bf.fit(on_body, mcmc=False).least_squares.estimates
    assert {n: e.value for n, e in fit.least_squares.estimates.items()} == pytest.approx(
        {n: e.value for n, e in usual.items()}, rel=1e-4, nan_ok=True
    )


@pytest.mark.parametrize(
    ("start", "words"),
    [
        ("mu1=-0.1", r"start: mu1 = -0.1 is outside of what its prior .* allows, .*; start from a value in between"),
        ("mu1=1e9", "start: mu1 = 1e"),
        ("mu4=0.1", "'mu4' is not a parameter of this fit"),
        ("mu2=0.1", "'mu2' is fixed"),
        ("sigma_theta=1", "sigma_theta is the size of the noise"),
        ("mu1", "--start 'mu1' is not a parameter and a number; write it as mu1=0.1"),
    ],
)
def test_a_start_that_cannot_be_is_refused(on_body, refuse, tmp_path, start, words):
    fixed = ("--set", "friction.mu2.fixed=0.1") if "mu2" in start else ()
    error = refuse("fit", on_body, "--no-mcmc", "--no-figures", "-o", tmp_path / "fit", "--start", start, *fixed)
    assert re.search(words, error), error


def test_a_notebook_is_refused_in_the_same_words(on_body):
    with pytest.raises(UsageError, match="mu1 = -1 is outside"):
        bf.fit(on_body, mcmc=False, start={"mu1": -1.0})
