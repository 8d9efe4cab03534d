"""No answer depends on how strong a bench is: with every force times a factor the density in z is the same function.

In z every prior is a standard normal, so if the log density changes by a constant alone, every sampler draws the same z, and
quantities with a unit of force are the same times the factor.
"""

import re
import shutil
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from densities import over_rows
from slow_cases import some_slow

import bowdenfit as bf
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.models import build_model
from bowdenfit.questions.summary.verdict import NOT_DESCRIBED

DATASETS = Path(__file__).parents[2] / "datasets"
FACTORS = (2.0**-7, 2.0**7)  # powers of 2, which lose no digits
POINTS = 0.7 * np.random.default_rng(0).standard_normal((4, 40))
LOOP = """name = "loop"
[cable]
kind = "loop"
[[contact]]
name = "sheath"
friction = "mu"
wrap_angle = { value = 180, unit = "deg" }
[tables]
recordings = {}
[[recording]]
file = "loop.csv"
"""
# Settings; "<number>" is a number of newtons, which is stated times the factor.
NOISE = "sensors.force_noise={value=<0.3>, unit='N', sd=<0.1>}"
CASES = {
    "efficiencies": ("on-body-exoskeleton", ()),
    "forces": ("synthetic-bench", ()),
    "forces with drag": ("synthetic-bench", ("friction_model=drag",)),
    "forces with drag as stated": (
        "synthetic-bench", ("friction_model=drag", "prior.drag.prior.half_normal.sd=<3>", NOISE),
    ),
    "forces with measured drag": ("synthetic-bench", ("friction_model=drag", "prior.drag.measured={value=<2>, sd=<1>}")),
    "load-dependent forces": (
        "synthetic-bench", ("friction_model=load-dependent+drag", "reference_force={value=<54>, unit='N'}"),
    ),
    "offsets": (
        "synthetic-recordings",
        ("tables.recordings.prepare.tare=fitted", "sensors={input_gain_error_sd=0.01, output_gain_error_sd=0.01}"),
    ),
    "offsets as stated": (
        "synthetic-bench", ("friction_model=drag", "sensors.offset_sd={value=<0.2>, unit='N'}"),
    ),
    "robust forces": ("yarn-on-cylinder", ("noise=student", "sensors.force_noise={value=<0.01>, unit='N'}")),
    "held forces": (
        "yarn-on-cylinder", ("friction_model=drag", "hold", "sensors.force_noise={value=<0.01>, unit='N'}"),
    ),
    "stretch, preload and loop": ("synthetic-haptic-loop", ()),
    "a loop with a stated preload": (
        "synthetic-haptic-loop", ("preload.value={value=<10>, unit='N', sd=<1>}",),
    ),
    "sliding recordings": ("synthetic-recordings", ()),
    "rate-dependent recordings with drag": ("synthetic-recordings", ("friction_model=drag+rate-dependent",)),
    "whole recordings with drag": (
        "synthetic-recordings", ("friction_model=drag", "tables.recordings.likelihood=whole"),
    ),
    "recordings of a loop": ("", ()),
    "force against displacement": ("synthetic-catheter", ()),
    "force against displacement up to a stop": (
        "synthetic-catheter", ("tables.displacement.end=stop", "sensors.offset_sd={value=<0.2>, unit='N'}"),
    ),
}  # fmt: skip


def strong(folder: Path, name: str, settings: tuple[str, ...], factor: float):
    """A data set with every force times a factor, those in its settings too."""
    folder = folder / f"{factor:g}"
    if name:
        shutil.copytree(DATASETS / name, folder)
    else:
        folder.mkdir()
        (folder / "cable.toml").write_text(LOOP)
        write_loop(folder / "loop.csv")
    for file in folder.rglob("*.csv"):
        file.write_text(times(file.read_text(), factor, "hold" in settings))
    description = [setting for setting in settings if setting != "hold"]
    return bf.read(folder, settings=[scaled(setting, factor) for setting in description])


def scaled(setting: str, factor: float) -> str:
    """A setting with the numbers in brackets times a factor."""
    return re.sub(r"<(.*?)>", lambda computed: repr(float(computed[1]) * factor), setting)


def times(text: str, factor: float, held: bool) -> str:
    """A file with its columns of newtons times a factor."""
    lines = text.splitlines()
    start = next(i for i, line in enumerate(lines) if not line.startswith("#"))
    heads = lines[start].split(",")
    forces = [i for i, head in enumerate(heads) if head.endswith(("_N", "_N_m"))]
    for k in range(start + 1, len(lines)):
        cells = lines[k].split(",")
        for i in forces:
            cells[i] = repr(float(cells[i]) * factor) if cells[i].strip() else cells[i]
        lines[k] = ",".join(cells).replace("pull", "hold") if held else ",".join(cells)
    return "\n".join(lines) + "\n"


def write_loop(path: Path) -> None:
    """A loop preloaded by 30 N that is moved to and fro three times and a half, with noise."""
    time = np.arange(0.0, 14.0, 0.02)
    force, shown, stands = 60.0 * np.sin(np.pi / 2 * time), [], 0.0
    for x in force:
        low, high = min(x - 15.0, x * np.exp(-0.25)), max(x + 15.0, x * np.exp(0.25))
        stands = float(np.clip(stands, low if x > 0 else x - 15.0, high if x < 0 else x + 15.0))
        shown.append(stands)
    noise = 0.1 * np.random.default_rng(1).standard_normal((2, len(time)))
    rows = np.column_stack([time, force + noise[0], np.array(shown) + noise[1]])
    np.savetxt(path, rows, "%.6f", ",", header="time_s,input_force_N,output_force_N", comments="")


USUAL = ("efficiencies", "forces with drag", "stretch, preload and loop", "sliding recordings", "force against displacement")


def density_and_values(density: LogDensity, z, data):
    """Log density and values of the parameters at one z."""
    return density.log_density(z, data), density.model.space.vector(z)


@pytest.mark.extended
@pytest.mark.parametrize("case", [c if c in USUAL else pytest.param(c, marks=pytest.mark.slow) for c in CASES])
def test_every_force_times_a_factor_changes_the_log_density_by_a_constant(case, tmp_path):
    name, settings = CASES[case]
    densities, values = {}, {}
    for factor in FACTORS:
        model = build_model(strong(tmp_path, name, settings, factor))
        density, z = LogDensity(model), POINTS[:, : model.space.size]
        densities[factor], values[factor] = over_rows(partial(density_and_values, density), z, density.data)
        assert np.all(np.isfinite(densities[factor]))
        power = np.array([("N" in p.unit.split("/")[0].split()) for p in model.space.free], dtype=float)
        rounding = 1e-9 if "recordings" in case else 1e-12  # the scale of delay_error comes out of an iteration
        np.testing.assert_allclose(values[factor] / factor**power, values[FACTORS[0]] / FACTORS[0] ** power, rtol=rounding)
    # How long deviations of a recording stay alike is found by a search, to six digits.
    weak, other = densities.values()
    tolerance = (1e-6 if "recordings" in case or case == "offsets" else 1e-10) * max(np.max(np.abs(weak)), 1.0)
    np.testing.assert_allclose(other - weak, (other - weak)[0], rtol=0, atol=tolerance)


FAULTS = {
    "healthy": (lambda row: row, set()),
    "a drag that the model lacks": (lambda row: [*row[:4], row[4] - 0.05 * 50.0], {NOT_DESCRIBED}),
    "return a tenth rougher": (lambda row: [*row[:4], row[4] * (1.1 if row[2] == "return" else 1.0)], {NOT_DESCRIBED}),
}


def spoiled(folder: Path, fault, factor: float) -> Path:
    """The synthetic bench with every force times a factor, after what a fault makes of its readings."""
    shutil.copytree(DATASETS / "synthetic-bench", folder)
    head, *lines = (folder / "forces.csv").read_text().splitlines()
    rows = (fault([*cells[:3], float(cells[3]), float(cells[4])]) for cells in (line.split(",") for line in lines))
    text = [",".join([*row[:3], repr(row[3] * factor), repr(row[4] * factor)]) for row in rows]
    (folder / "forces.csv").write_text("\n".join([head, *text]) + "\n")
    return folder


@pytest.mark.extended
@pytest.mark.parametrize("name", some_slow(FAULTS, [name for name in FAULTS if "rougher" not in name]))
def test_the_verdict_does_not_depend_on_how_strong_a_bench_is(name, tmp_path):
    """What is wrong, which sentences say it (but for their numbers), and the coefficients; by least squares."""
    fault, expected = FAULTS[name]
    fits = [bf.fit(spoiled(tmp_path / f"{f:g}", fault, f), mcmc=False, seed=1) for f in (1.0, *FACTORS)]
    message = [{kind: re.sub(r"[\d.]+( [kmM]?N)?", "_", " ".join(s)) for kind, s in f.verdict().troubles.items()} for f in fits]
    assert set(message[0]) == expected, message[0]
    assert message[1] == message[0] and message[2] == message[0]
    mu = [[f.least_squares.estimates[n].value for n in ("mu_sheath", "mu_squeezed", "mu_edge")] for f in fits]
    np.testing.assert_allclose(mu[1:], [mu[0]] * 2, rtol=1e-5)
