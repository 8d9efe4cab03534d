"""Least squares of recordings of a pull-pull loop recovers what the loops simulated here have."""

import math

import numpy as np
import pytest
from loop_benches import MU, PRELOAD, folder_of, recorded, several_in

import bowdenfit as bf

pytestmark = pytest.mark.extended


@pytest.fixture(scope="module")
def several(tmp_path_factory):
    return several_in(tmp_path_factory.mktemp("several"))


def test_least_squares_recovers_friction_and_preload(several):
    fit = bf.fit(several, mcmc=False)
    for name, truth, relative in (("mu", MU, 0.03), ("preload", PRELOAD, 0.01)):
        estimate = fit.least_squares.estimates[name]
        assert estimate.standard_error < relative * truth, name
        assert abs(estimate.value - truth) < 2.5 * estimate.standard_error, name
    assert fit.least_squares.residual_sd["recorded_loss"] < 0.03
    measured = next(t for t in fit.model.terms if t.name == "recorded_loss").observed()
    np.testing.assert_allclose(fit.least_squares.readings["recorded_loss"], measured, rtol=0.08)


def test_least_squares_of_recordings_without_noise_is_exact(tmp_path):
    recordings = [recorded("triangle", 60.0, noise=0.0, seconds=8.0), recorded("sine", 90.0, noise=0.0, seconds=8.0)]
    fit = bf.fit(folder_of(tmp_path, recordings), mcmc=False)
    assert fit.least_squares.estimates["mu"].value == pytest.approx(MU, rel=1e-3)
    assert fit.least_squares.estimates["preload"].value == pytest.approx(PRELOAD, rel=1e-3)


def test_a_fit_without_preload_finds_the_friction(tmp_path):
    """The recording by itself does not tell the loss then, and the preload runs to its lower end."""
    fit = bf.fit(folder_of(tmp_path, [recorded(preload=0.0, seconds=6.0)]), mcmc=False)
    estimate = fit.least_squares.estimates["mu"]
    assert estimate.value == pytest.approx(MU, abs=3 * estimate.standard_error)
    assert estimate.standard_error < 0.07 * MU  # one mounting: what its prior says of tau, over half a turn


@pytest.mark.slow
@pytest.mark.parametrize("follows", [False, True])
def test_recordings_are_fitted_together_with_a_loop_table(tmp_path, follows):
    """Also of a cable whose preload follows its stretch: then what the bent rope is preloaded to is lost with it."""
    stiffness, lengthening, bends = 50.0, 0.1 if follows else 0.0, (90, 180, 270)
    preloads = [PRELOAD + stiffness * lengthening * math.radians(bend) for bend in bends]
    recordings = [
        recorded(amplitude=90.0, exponent=MU * math.radians(bend), preload=preload, seconds=6.0, seed=i)
        for i, (bend, preload) in enumerate(zip(bends, preloads, strict=True))
    ]
    rows = ["input_force_N,output_force_N,bend_deg,stroke"]
    generator = np.random.default_rng(3)
    for force in (5.0, 20.0, 40.0, 60.0, 90.0):
        exponent = MU * math.pi
        output = min(force - 2 * preloads[1] * exponent, force * math.exp(-exponent))
        rows.append(
            f"{force + 0.2 * generator.standard_normal():.4f},{output + 0.2 * generator.standard_normal():.4f},180,pull"
        )
    (tmp_path / "loop.csv").write_text("\n".join(rows) + "\n")
    more = "[tables]\nrecordings = {}\nloop = { file = 'loop.csv' }"
    if follows:
        settings = (
            f"bedding_stretch.fixed = 1e-6\nstiffness.fixed = {stiffness}\nlengthening.fixed = {math.radians(lengthening)}"
        )
        more = f"[preload]\nmodel = 'stretch'\n[prior]\n{settings}\n{more}"
    fit = bf.fit(folder_of(tmp_path, recordings, angles=bends, more=more), mcmc=False)
    for name, truth in (("mu", MU), ("preload", PRELOAD)):
        estimate = fit.least_squares.estimates[name]
        assert estimate.value == pytest.approx(truth, abs=max(4 * estimate.standard_error, 0.003 * truth)), name
        assert estimate.standard_error < 0.02 * truth
    assert {"recorded_loss", "loop_output_force"} <= set(fit.least_squares.readings)
