"""Good tables of stretch, preload and loops that cannot tell what is asked of them, and what is said then."""

import numpy as np
import pytest
from cables import measured
from slow_cases import some_slow

import bowdenfit as bf
from bowdenfit.inference.least_squares import find_maximum_posterior, fit_least_squares
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.inference.minimum import find_rivals, range_of_minima
from bowdenfit.inference.objective import make_objective
from bowdenfit.kinds.descriptions import make_design, parse_description
from bowdenfit.models import build_model
from bowdenfit.questions.bends.words import describe_products_with_preload
from bowdenfit.questions.check.data_set_words import collect_warnings
from bowdenfit.questions.summary.details import details_text

pytestmark = pytest.mark.extended

ANGLES = (0.0, 45.0, 90.0, 135.0, 180.0)
LOADS = (1.0, 3.0, 6.0, 10.0, 15.0, 20.0, 30.0, 40.0, 60.0, 80.0, 100.0)
TRUTH = {
    "mu": 0.07, "mu_stretch": 0.07, "stiffness": 35.0, "bedding_stretch": 0.4, "bedding_load": 15.0, "lengthening": 0.0061,
    "stretch_zero": 0.3, "preload": 10.0, "sigma_L": 0.02, "sigma_P": 0.3, "sigma_F": 0.3,
}  # fmt: skip


def stretched(loads, angles=ANGLES, *, unloading=False):
    """A design that stretches the rope."""
    return {"stretch": {"loads": tuple(loads), "wrap_angles": angles, "unloading": unloading}}


FREE = {"loop": {"free_motion": ANGLES[1:], "strokes": ("pull", "return") * 3}}
CASES = {
    # tables, what is measured, truth that differs, what cannot be told, what the check warns of
    "a single load": (
        ("stretch",), stretched((30.0,)), {},
        ("stiffness", "bedding_stretch", "bedding_load"), "a single load, 30 N, so the stiffness of the rope is not identif",
    ),
    "one wrap angle": (
        ("stretch",), stretched(LOADS, ANGLES[2:3], unloading=True), {},
        ("lengthening", "stretch_zero"), "at one wrap angle, 90 deg",
    ),
    "loads far above the bedding load": (
        ("stretch",), stretched(np.linspace(150, 300, 9)), {"bedding_load": 5.0},
        ("bedding_stretch", "bedding_load", "stretch_zero"), "no low loads, only 150 to 300 N",
    ),
    "loads far below the bedding load": (
        ("stretch",), stretched(np.linspace(0.1, 1.5, 9)),
        {"bedding_load": 60.0, "sigma_L": 0.002}, ("stiffness", "bedding_stretch", "bedding_load"), None,
    ),
    "preloads alone": (
        ("preload",), {"preload": {"wrap_angles": tuple(np.linspace(60, 180, 8))}}, {},
        ("mu", "stiffness", "bedding_stretch", "lengthening"), "without a table of stretch, preloads determine only",
    ),
    "free motion": (("loop",), FREE, {}, ("mu", "preload"), "determines only the product of friction and preload"),
    "a loop that is always slack": (
        ("loop",), {"loop": {
            "wrap_angles": ANGLES[1:], "input_forces": (40.0, 60.0, 80.0, 100.0), "strokes": ("pull", "return")}},
        {"preload": 1.0}, ("preload",), None,
    ),
}  # fmt: skip


def cable_with(tables, **more):
    contact = {"name": "housing", "friction": "mu", "wrap_angle": {"column": "wrap_angle"}}
    contact["wrap_angle"]["nominal"] = {"value": 90, "unit": "deg"}
    raw = {
        "name": "hard to tell",
        "cable": {"kind": "loop" if "loop" in tables else "single"},
        "contact": [contact],
        "stretch": {"friction": "mu"},
        "preload": {"wrap_angle": {"value": 90, "unit": "deg"}} if "preload" in tables else {},
        "tables": {name: {"file": f"{name}.csv"} for name in tables},
    }
    return parse_description(raw | more)


def estimates_of(tables, design, truth, seeds):
    """Least-squares estimates and true values [shown units] of several seeds, and the last data set."""
    objective, results = None, []
    for seed in seeds:
        data, values = measured(cable_with(tables), seed, design=make_design(**design), once=True, **(TRUTH | truth))
        posterior = LogDensity(build_model(data))
        objective = objective or make_objective(posterior)
        start = find_maximum_posterior(posterior, objective).z
        estimates = fit_least_squares(posterior, objective, start, intervals=False).estimates
        true = {p.name: values[p.name] * p.shown_scale for p in posterior.model.space.free}
        results.append({name: (estimate, true[name]) for name, estimate in estimates.items()})
    return results, data


USUAL = ("one wrap angle",)


@pytest.mark.parametrize("case", some_slow(CASES, USUAL))
@pytest.mark.parametrize("seeds", [(0,), pytest.param((1, 2), marks=pytest.mark.slow)], ids=["a seed", "others"])
def test_what_the_data_cannot_tell_is_not_identified_and_no_error_bar_is_too_small(case, seeds):
    tables, design, truth, untold, warning = CASES[case]
    computed, data = estimates_of(tables, design, truth, seeds)
    for estimates in computed:
        for name, (estimate, true) in estimates.items():
            if not estimate.identified:
                assert np.isnan(estimate.value)
                assert estimate.remark
                continue
            assert abs(estimate.value - true) < 5 * estimate.standard_error, (name, estimate, true)
            if name in untold:
                assert estimate.standard_error > abs(estimate.value), (name, estimate, true)
    if case == "a single load":
        assert not any(estimates["stiffness"][0].identified for estimates in computed)
    if warning is not None:
        assert any(warning in sentence for sentence in collect_warnings(data)), collect_warnings(data)


def test_good_tables_leave_nothing_unidentified():
    computed, data = estimates_of(("stretch",), stretched(LOADS, unloading=True), {}, seeds=(0,))
    assert all(estimate.identified for estimates in computed for estimate, _ in estimates.values())
    assert collect_warnings(data) == []


def test_the_summary_says_which_values_fit_as_well():
    tables, design, truth, *_ = CASES["a loop that is always slack"]
    data, _ = measured(cable_with(tables), 0, design=make_design(**design), once=True, **(TRUTH | truth))
    text = " ".join(details_text(bf.fit(data, mcmc=False, seed=1)).split())
    assert "preload is not identified by least squares: values from" in text
    assert "fit about as well" in text


def test_free_motion_tells_the_product_of_friction_and_preload_and_says_so():
    sampler = {"n_walkers": 32, "target_ess": 100, "target_r_hat": 1.1, "max_steps": 400}
    prior = {"preload": {"prior": {"lognormal": {"median": 20.0, "log_sd": 1.0}}}}  # else it may as well be slack
    data, _ = measured(
        cable_with(("loop",), sampler=sampler, prior=prior), 0, design=make_design(**FREE), once=True, **TRUTH
    )
    fit = bf.fit(data, seed=1)  # so short that the ratio below is 6 to 12, by the seed
    (sentence,) = describe_products_with_preload(fit)
    assert sentence.startswith(
        "The measurements barely separate preload from mu; they determine the product preload x mu = 0.6"
    )
    product = fit.posterior.values["preload"] * fit.posterior.values["mu"]
    assert np.std(np.log(fit.posterior.values["preload"])) > 5 * np.std(np.log(product))
    assert np.quantile(product, 0.01) < 0.7 < np.quantile(product, 0.99)


def test_a_preload_whose_wrap_angle_is_given_but_not_used_is_warned_of():
    description = cable_with(("loop",), preload={"wrap_angle": {"value": 90, "unit": "deg"}})
    data, _ = measured(description, 0, design=make_design(**FREE), once=True, **TRUTH)
    assert any('model = "stretch"' in sentence for sentence in collect_warnings(data))


def test_a_rival_counts_only_where_it_fits_as_well_and_lies_outside_the_error():
    residuals = np.array([1.0, -1.0, 1.0, -1.0, 0.5, -0.5])
    computed = {"residuals": {"a": residuals}}
    near, far = ({"residuals": {"a": residuals * factor}} for factor in (1.1, 5.0))
    assert find_rivals(computed, [near, far], np.ones(6), 2) == [near]
    assert range_of_minima(10.0, 1.0, [13.0, 7.0]) is None
    assert range_of_minima(10.0, 1.0, [13.0, 1.0]) == (1.0, 13.0)
    assert range_of_minima(10.0, 0.0, [10.0]) is None
