"""Two cables side by side: the difference of draws that were sampled apart, and none where measurements are shared."""

import numpy as np
import pytest

import bowdenfit as bf
from bowdenfit.errors import UsageError
from bowdenfit.questions.compare import contrast_cables

QUICK = ("sampler.n_walkers=64", "sampler.target_ess=200", "sampler.target_r_hat=1.05", "sampler.max_steps=4000")


def fit_of(folder, name, share):
    """A fit of a cable that lets through a share of the force."""
    places = [(run, i, force) for run in range(4) for i, force in enumerate((20, 40, 60))]
    rows = [f"{force},{share * force * (1 + 0.01 * ((run + i) % 3 - 1)):.3f},{run}" for run, i, force in places]
    lines = ["input_force_N,output_force_N,run", *rows]
    (folder / f"{name}.csv").write_text("\n".join([*lines, ""]))
    return bf.fit(folder / f"{name}.csv", wrap_angle="180deg", settings=QUICK, seed=1)


@pytest.mark.extended
def test_the_difference_of_two_cables_is_that_of_their_draws(tmp_path):
    worn, new = fit_of(tmp_path, "worn", 0.70), fit_of(tmp_path, "new", 0.80)
    comparison = contrast_cables(worn, new, ("worn", "new"))
    by_name = {contrast.coefficient: contrast for contrast in comparison.contrasts}
    assert list(by_name) == ["efficiency at the nominal wrap angles (%)", "mu"]
    medians = [np.median(fit.posterior.values["mu"]) for fit in (worn, new)]
    spread = np.hypot(*(np.std(fit.posterior.values["mu"]) for fit in (worn, new)))
    difference = by_name["mu"].difference
    assert difference.median == pytest.approx(medians[0] - medians[1], abs=0.1 * spread)
    assert difference.sd == pytest.approx(spread, rel=0.1)
    assert "worn minus new" in comparison.sentences()[1]
    assert by_name["mu"].probability > 0.99
    assert [series.label for series in comparison.charts[1].groups[0].series] == ["worn", "new"]
    with pytest.raises(UsageError, match=r"worn\.csv"):
        contrast_cables(worn, worn, ("a", "b"))
