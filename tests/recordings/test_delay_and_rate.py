"""Delay between the channels and friction that depends on the speed: a rope that is both must not be distrusted for either."""

import numpy as np
import pytest
from creeping_rope import SPEED, Truth, model_recordings, pulled, record

import bowdenfit as bf
from bowdenfit.cable.sensors import DELAY_ERROR

DESCRIPTION = """schema = 1
name = "rope"
friction_model = "rate-dependent"
reference_velocity = { value = 20, unit = "mm/s" }
[[contact]]
name = "sheath"
friction = "mu"
wrap_angle = { value = 115, unit = "deg" }
"""
HEADING = "time (s),input force (N),output force (N),velocity (mm/s)"


def _write_bench(folder, truth: Truth, seed: int) -> None:
    """Three mountings of a play operator whose friction changes with the speed, 0.15 N of noise in both cells."""
    generator, time = np.random.default_rng(seed), np.arange(0, 33.9, 0.01)
    force, speed = pulled(time)
    text = DESCRIPTION
    for mounting in range(3):
        half = truth.steady(speed) * (1 + 0.05 * generator.standard_normal())
        x = np.log(force)
        y = [x[0] - half[0]]
        for low, high in zip((x - half)[1:], (x + half)[1:], strict=True):
            y.append(min(max(y[-1], low), high))
        noise = 0.15 * generator.standard_normal((2, len(time)))
        rows = np.column_stack([time, force + noise[0], np.exp(y) + noise[1], speed])
        np.savetxt(folder / f"{mounting}.csv", rows, fmt="%.5f", delimiter=",", header=HEADING, comments="")
        text += f'[[recording]]\nfile = "{mounting}.csv"\nrun = "{mounting}"\n'
    (folder / "cable.toml").write_text(text)


@pytest.mark.extended
@pytest.mark.parametrize("seed", [0, 2, 3])
def test_friction_that_changes_with_the_speed_is_not_taken_for_a_wrong_delay(tmp_path, seed):
    """The delay was estimated as if friction did not change, 20 to 110 ms off; the fit finds the speed all the same."""
    generator = np.random.default_rng([11, seed])
    rise, speed, viscous = generator.uniform(0.1, 0.4), generator.uniform(4, 12), generator.uniform(-0.003, 0.006)
    _write_bench(tmp_path, Truth(0.3, stribeck=rise, stribeck_speed=speed, viscous=viscous, reference_speed=SPEED), seed)
    fit = bf.fit(tmp_path, seed=1, mcmc=False)
    estimates = fit.least_squares.estimates
    assert abs(estimates[DELAY_ERROR].value) > 15 and fit.verdict().trusted
    assert estimates["stribeck_speed"].value == pytest.approx(speed, rel=0.05)


def test_the_delay_may_be_off_by_what_friction_that_depends_on_the_speed_looks_like():
    """By the time in which the force changes by 0.3 of the loss, the scale of the Stribeck rise's prior; else by its error."""
    recording = record(Truth(0.3, stiffness=60.0), 100, 1)
    sds = {}
    for friction in ("capstan", "rate-dependent"):
        model = model_recordings([recording], friction, delay_sd=0.004)
        sds[friction] = float(next(p for p in model.space.parameters if p.name == DELAY_ERROR).prior.sd)
    blocks = recording.blocks
    rate = np.sqrt(np.mean(np.gradient(np.log(blocks.input_force), blocks.time) ** 2))
    assert sds["capstan"] == 0.004
    assert sds["rate-dependent"] == pytest.approx(0.3 * 0.3 / rate, rel=0.1)
