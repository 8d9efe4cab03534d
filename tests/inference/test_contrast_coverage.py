"""Contrasts between groups contain the truth as often as claimed, over tables of a bench without code of the likelihood.

Truths come from no prior: coefficients, their difference, and how mountings scatter are spread over what cables have, at
loads of 1 N and of 10 kN. Each 90 % interval then holds its difference nine times out of ten, but for what the weak priors
do; of 100 tables fewer than 80 or more than 98 hold it once in 500 tests by chance, of 40 fewer than 29 once in 400.
"""

import numpy as np
import pytest
from hand_bench import BENDS, pull
from scipy import stats

from bowdenfit.dataset import load_dataset
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.models import build_model
from bowdenfit.questions.calibrate.replicator import BatchFitter, replace_data

pytestmark = pytest.mark.extended

LABORATORIES = {  # load [N], mountings of each group, loads in units of it, what is said of the runs
    "trials": (1.0, 30, None, ', run = "each row"'),
    "runs": (10_000.0, 6, (0.5, 1.0, 2.0), ""),
}
LEAST = 0.0025


def _table(folder, laboratory, seed):
    """A table of one bench in a folder; the true difference of the two coefficients."""
    load, mountings, loads, extra = LABORATORIES[laboratory]
    generator = np.random.default_rng([seed, len(laboratory)])
    mu, difference, tau = generator.uniform(0.06, 0.2), generator.uniform(-0.04, 0.1), np.exp(generator.uniform(-5.0, -2.7))
    lines = ["run,group,wrap_angle_deg,stroke,input_force_N,output_force_N"]
    for group, coefficient in (("new", mu), ("old", mu + difference)):
        bends = np.tile([90.0, 180.0], mountings // 2)
        cell_loads = (
            [load * generator.choice([0.5, 1.0, 2.0])] if loads is None else [load * load_choice for load_choice in loads]
        )
        strokes, noise = ((1,), 0.005 * load) if loads is None else ((1, -1), 0.01 * load)
        exponents = coefficient * np.deg2rad(bends)
        rows = pull(generator, bends, exponents, cell_loads, strokes=strokes, noise=(noise, noise), scatter=tau)
        cells = zip(rows.label, rows.place, rows.stroke, rows.force_in, rows.force_out, strict=True)
        lines += [
            f"{label},{group},{load_level:g},{stroke:+d},{f_in:.8g},{f_out:.8g}"
            for label, load_level, stroke, f_in, f_out in cells
        ]
    folder.mkdir(parents=True)
    (folder / "cable.toml").write_text(
        'friction_model = "by-group"\n' + BENDS.replace('"forces.csv"', f'"forces.csv"{extra}')
    )
    (folder / "forces.csv").write_text("\n".join(lines) + "\n")
    return difference


@pytest.mark.slow
@pytest.mark.parametrize("count", [20, pytest.param(100, marks=pytest.mark.slow)])
@pytest.mark.parametrize("laboratory", LABORATORIES)
def test_contrasts_hold_the_truth_as_often_as_they_say(tmp_path, laboratory, count):
    truths = np.array([_table(tmp_path / str(seed), laboratory, seed) for seed in range(count)])
    datasets = [load_dataset(tmp_path / str(seed)) for seed in range(count)]
    model = build_model(datasets[0])
    posteriors = [LogDensity(replace_data(model, dataset)) for dataset in datasets]
    fits = BatchFitter().fit_all(posteriors, range(count))
    assert all(fit.reasons == () for fit in fits)
    new, old = (model.space.index[f"mu[{group}]"] for group in ("new", "old"))
    inside = 0
    for fit, truth in zip(fits, truths, strict=True):
        values = np.array([model.space.free[new].prior.constrain(fit.z[:, i]) for i in (new, old)])
        low, high = np.quantile(values[1] - values[0], (0.05, 0.95))
        inside += low < truth < high
    assert stats.binomtest(int(inside), count, 0.9).pvalue > LEAST, f"{inside} of {count}"
