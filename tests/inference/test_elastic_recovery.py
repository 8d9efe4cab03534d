"""Are stretch, preload and friction recovered from tables of stretch, preload and a pull-pull loop, and with honest intervals?

Truth is drawn from the prior that cables are fitted with, so that 90 % intervals hold it at exactly that rate, not only for
much data. The priors keep to cables like the synthetic haptic loop, for which every reading tells something. Intervals of
one cable share its data; every binomial test counts one interval a cable.
"""

import tomllib
from dataclasses import replace
from itertools import chain, combinations
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from cables import CONTACTS, cable, other_design
from cables import TRUTH as CABLE_TRUTH
from densities import over_rows
from elastic_cables import CONSTANT, ELASTIC, TRUTH, bench, changed, elastic_cable
from scipy import stats
from simulated_coverage import Laboratory, held, p_values, table

from bowdenfit.dataset import Dataset, load_dataset
from bowdenfit.description import Description, SamplerSettings
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.kinds import KINDS
from bowdenfit.kinds.descriptions import make_design, parse_description
from bowdenfit.kinds.tables import AngleTable, Measurements, StretchTable
from bowdenfit.models import build_model
from bowdenfit.questions.simulate.tables import draw_true_values, empty_tables, simulate_design

pytestmark = pytest.mark.extended

QUICK = SamplerSettings(n_ensembles=4, n_walkers=32, max_steps=1000, target_ess=500, target_r_hat=1.03)
ROPE = ("stiffness", "bedding_stretch", "bedding_load", "lengthening", "stretch_zero", "sigma_L")
SHORT = changed(
    ELASTIC,
    stretch={"loads": (1.0, 3.0, 6.0, 10.0, 20.0, 40.0, 70.0, 100.0), "wrap_angles": (0, 90, 180)},
    preload={"wrap_angles": (0, 45, 60, 90, 120, 150, 180)},
    loop={
        "wrap_angles": (60, 120, 180),
        "input_forces": (5.0, 10.0, 20.0, 40.0, 60.0),
        "free_motion": (60, 120, 180),
    },
)


@pytest.fixture(scope="module")
def laboratory() -> Laboratory:
    """One for all tests, so that each shape of data is compiled for once."""
    return Laboratory(sampler=QUICK)


def lognormal(median: float, log_sd: float) -> dict[str, Any]:
    return {"prior": {"lognormal": {"median": median, "log_sd": log_sd}}}


def plausible() -> Description:
    """A loop of the haptic kind: its parameters are known to a fifth or a third before anything is measured."""
    prior = {name: lognormal(TRUTH[name], 0.3) for name in ("stiffness", "bedding_stretch", "bedding_load")}
    prior |= {name: lognormal(TRUTH[name], 0.3) for name in ("sigma_L", "sigma_P", "sigma_F")}
    prior |= {"lengthening": lognormal(0.006, 0.2), "preload": lognormal(12.0, 0.25)}
    prior |= {"stretch_zero": {"prior": {"normal": {"mean": 0.3, "sd": 0.2}}}}
    return elastic_cable(prior=prior, friction={"mu": lognormal(0.07, 0.3)})


def arrays(data: Any) -> Any:
    """Data as JAX takes them inside a compiled function."""
    return jax.tree.map(jnp.asarray, data)


def written(dataset: Dataset) -> Dataset:
    """The data set as files of ten decimals would hold its readings."""
    tables = dataset.measurements
    rounded = [
        replace(rows, **{reading: np.round(getattr(rows, reading), 10)})
        for name, reading in (("stretch", "stretch"), ("preload", "preload"), ("loop", "output_force"))
        if (rows := tables.table(KINDS[name].table)) is not None
    ]
    return replace(dataset, measurements=tables.with_tables(*rounded))


# Noise-free tables -------------------------------------------------------------------------------------------------

STRETCH_ALONE = elastic_cable(("stretch",), kind="single", stretch={})
LOOP_ALONE = elastic_cable(("loop",), preload=CONSTANT)
STIFF = {"stiffness": 400.0, "bedding_stretch": 2.0, "bedding_load": 8.0, "lengthening": 0.001, "stretch_zero": 2.0}
SOFT = {"stiffness": 8.0, "bedding_stretch": 0.1, "bedding_load": 5.0, "lengthening": 0.012, "stretch_zero": -1.0}


def among_slow(*case: Any) -> Any:
    return pytest.param(*case, marks=pytest.mark.slow)


@pytest.mark.parametrize(
    ("description", "truth"),
    [
        (elastic_cable(), TRUTH),  # slack at 0 deg: one reading of preload is 0
        (elastic_cable(), TRUTH | SOFT | {"mu": 0.03, "preload": 12.0}),
        (elastic_cable(), TRUTH | STIFF | {"mu": 0.3, "preload": 40.0}),
        among_slow(elastic_cable(), TRUTH | {"mu": 0.15, "stiffness": 120.0, "bedding_stretch": 1.0, "preload": 25.0}),
        among_slow(STRETCH_ALONE, TRUTH),
        (STRETCH_ALONE, TRUTH | STIFF | {"mu_stretch": 0.3}),
        among_slow(STRETCH_ALONE, TRUTH | SOFT | {"mu_stretch": 0.02}),
        among_slow(LOOP_ALONE, TRUTH | {"mu": 0.07, "preload": 10.0}),
        (LOOP_ALONE, TRUTH | {"mu": 0.2, "preload": 3.0}),
        among_slow(LOOP_ALONE, TRUTH | {"mu": 0.02, "preload": 25.0}),
    ],
)
def test_least_squares_recovers_known_parameters_from_noise_free_tables(laboratory, description, truth):
    """To 1e-6, whatever the prior medians are; a coefficient that no table depends on is said not to be determined."""
    dataset, values = bench(description, truth, noise=False, once=True)
    solution, parameters = laboratory.least_squares(written(dataset)), build_model(dataset).space.parameters
    assert solution.converged
    for p in parameters:
        if p.role == "noise":
            continue
        estimate = solution.estimates[p.name]
        if p.name == "mu" and description is STRETCH_ALONE:
            assert not estimate.identified
        else:
            assert estimate.value == pytest.approx(values[p.name] * p.shown_scale, rel=1e-6), p.name


# Honest intervals --------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_over_twenty_loops_nine_in_ten_intervals_hold_the_truth(laboratory):
    """Every parameter; no binomial test of the ten rejects at 0.001.

    That takes 12 hits or fewer of 20, so by chance one of the ten does in fewer than four of a thousand seeds.
    """
    ranks = laboratory.ranks(plausible(), make_design(**SHORT), range(20))
    p = p_values(ranks)
    assert set(p) == set(TRUTH) - {"mu_stretch"}
    assert all(value > 0.001 for value in p.values()), table(ranks)
    hits, n = (sum(column) for column in zip(*held(ranks).values(), strict=True))
    assert 0.8 < hits / n < 0.98, table(ranks)  # all intervals together, ten correlated ones a cable: sd about 0.03


@pytest.mark.slow
def test_over_two_hundred_loops_ranks_are_uniform():
    """The whole distribution, not only the 90 % interval: Kolmogorov-Smirnov tests of the ranks, over independent cables.

    Twenty tests with the binomial ones; the smallest p times their number is below 0.001 once in a thousand seeds.
    """
    laboratory = Laboratory(sampler=QUICK)
    ranks = laboratory.ranks(plausible(), make_design(**SHORT), range(1000, 1200))
    p = list(p_values(ranks).values())
    p += [stats.kstest([rank[name] for rank in ranks], "uniform").pvalue for name in ranks[0]]
    assert min(p) * len(p) > 0.001, (table(ranks), p)


def all_on_the_way_up(dataset: Dataset) -> Dataset:
    """Stretch read while the load came down, taken for stretch read while it grew."""
    rows = dataset.measurements.table(StretchTable)
    loading = replace(rows, unloading=np.zeros_like(rows.unloading))
    return replace(dataset, measurements=dataset.measurements.with_tables(loading))


@pytest.mark.slow
def test_the_same_test_rejects_a_model_without_the_unloading_branch(laboratory):
    """The negative control: friction that holds the stretch back while the load comes down, taken for noise."""
    wrong = Laboratory(all_on_the_way_up, QUICK)
    wrong.fits = laboratory.fits
    p = p_values(wrong.ranks(plausible(), make_design(**SHORT), range(6)))
    assert p["sigma_L"] < 0.001
    assert p["lengthening"] < 0.001


# One joint posterior -----------------------------------------------------------------------------------------------


NOISE = {"stretch": {"sigma_L": {"fixed": 0.04}}, "loop": {"sigma_F": {"fixed": 0.3}}}


def told_by(*tables: str) -> Description:
    """A loop on springs, so that the coefficient is all that its tables share; noise as data sheets give it."""
    prior = {name: setting for table in tables for name, setting in NOISE[table].items()}
    return elastic_cable(tables, preload=CONSTANT, prior=prior)


def test_stretch_and_loop_together_tell_friction_better_than_either_alone(laboratory):
    """By the standard errors of least squares: of two independent sources for mu the information adds up.

    The scatter that a standard error rests on is itself known to a tenth or so from so few rows.
    """
    few = changed(ELASTIC, loop={"wrap_angles": (45, 90), "input_forces": (10.0, 40.0), "free_motion": (90,)})
    both = bench(told_by("stretch", "loop"), TRUTH, 3, design=few, once=True)[0].measurements
    sd = []
    for names in (("stretch", "loop"), ("stretch",), ("loop",)):
        alone = Measurements().with_tables(*(both.table(KINDS[name].table) for name in names))
        estimate = laboratory.least_squares(Dataset(told_by(*names), alone, {})).estimates["mu"]
        assert estimate.value == pytest.approx(TRUTH["mu"], abs=4 * estimate.standard_error)
        sd.append(estimate.standard_error)
    joint, stretch, loop = sd
    assert joint < 0.85 * min(stretch, loop)
    assert joint == pytest.approx((stretch**-2 + loop**-2) ** -0.5, rel=0.15)
    assert 0.3 < stretch / loop < 3


ON_BODY = ("mu1", "mu2", "mu3")


@pytest.fixture(scope="module")
def stretched_on_body(on_body):
    """The on-body data set as it is, and with a table of stretch; [stretch] friction is what is asked for."""
    alone = load_dataset(on_body)
    raw = tomllib.loads((on_body / "cable.toml").read_text())
    raw["tables"]["stretch"] = {"file": "stretch.csv"}

    def joined(friction: str | None) -> Dataset:
        description = parse_description(raw | ({"stretch": {"friction": friction}} if friction else {}))
        truth = {name: TRUTH[name] for name in ROPE} | ({friction: 0.085} if friction else {})
        design = make_design(angles=(450.0, 500.0), efficiencies=(470.0,), **ELASTIC)
        values = draw_true_values(description, empty_tables(description, design), truth, jax.random.key(1), run_once=True)
        rows = simulate_design(description, design, values, jax.random.key(2), run_once=True).measurements.table(StretchTable)
        return Dataset(description, alone.measurements.with_tables(rows), {})

    return alone, joined


def test_a_stretch_table_leaves_the_density_of_the_other_parameters_as_it_was(stretched_on_body):
    """Exactly: the joint log density is that of the on-body data plus a part that depends on none of their parameters."""
    alone, joined = (LogDensity(build_model(d)) for d in (stretched_on_body[0], stretched_on_body[1](None)))
    names, index = alone.model.space.index, joined.model.space.index
    assert set(names) < set(index)
    generator, added = np.random.default_rng(4), [i for name, i in index.items() if name not in names]
    z, on_body = np.tile(generator.standard_normal(len(index)) / 2, (3, 1)), generator.standard_normal((3, len(names))) / 2
    z[:, [index[name] for name in names]] = on_body
    (middle, initial), (there, after) = (
        over_rows(lambda z, data, p=p: (p.log_likelihoods(z, data), p.log_density(z, data)), point, p.data)
        for p, point in ((alone, on_body), (joined, z))
    )
    assert set(there) - set(middle) == {"stretch"}
    for term, values in middle.items():
        np.testing.assert_array_equal(there[term], values)
    part = np.sum(there["stretch"], axis=1) + np.sum(stats.norm.logpdf(z[:, added]), axis=1)
    np.testing.assert_array_equal(there["stretch"], there["stretch"][[0, 0, 0]])
    np.testing.assert_allclose(after, initial + part, rtol=1e-14)
    slope = jax.jit(jax.grad(lambda z: jnp.sum(joined.log_likelihoods(z, arrays(joined.data))["stretch"])))(jnp.asarray(z[0]))
    assert {name for name, i in index.items() if slope[i] == 0} == set(names)


@pytest.mark.slow
def test_a_stretch_table_leaves_the_coefficients_of_the_other_tables_as_they_were(laboratory, stretched_on_body):
    """Least squares: to 1e-9; unless the rope is said to slide with one of them while it is stretched."""
    alone, joined = stretched_on_body
    initial, after, shared = (laboratory.least_squares(d).estimates for d in (alone, joined(None), joined("mu1")))
    for name in ON_BODY:
        assert after[name].value == pytest.approx(initial[name].value, rel=1e-9), name
        assert after[name].standard_error == pytest.approx(initial[name].standard_error, rel=1e-6), name
    assert abs(shared["mu1"].value / initial["mu1"].value - 1) > 1e-3
    assert shared["mu1"].standard_error < 0.5 * initial["mu1"].standard_error


MIXED = ("angles", "efficiencies", "forces", "stretch", "preload")
MIXTURES = list(chain.from_iterable(combinations(MIXED, n) for n in range(1, len(MIXED) + 1)))


def mixture(tables: tuple[str, ...]) -> Dataset:
    """Such tables of one cable: of two contacts with curves if its angles are measured, else of a cable without."""
    contacts = {} if "angles" in tables else {"contact": [CONTACTS[2], CONTACTS[4]]}
    description = cable(2, tables, **contacts, preload={"model": "stretch"})
    design = other_design(**SHORT)
    empty = empty_tables(description, design)
    names = {p.name for p in build_model(Dataset(description, empty, {})).space.parameters}
    truth = {name: value for name, value in (TRUTH | CABLE_TRUTH).items() if name in names}
    values = draw_true_values(description, empty, truth, jax.random.key(len(tables)), run_once=True)
    return simulate_design(description, design, values, jax.random.key(7), run_once=True)


@pytest.mark.parametrize(
    "tables", [m if i % 16 == 10 else pytest.param(m, marks=pytest.mark.slow) for i, m in enumerate(MIXTURES)], ids="+".join
)
def test_any_mixture_of_tables_makes_one_posterior_that_is_the_sum_of_its_parts(tables):
    """Each table's part is that of a model built for it alone (with the angles, where there are curves)."""
    dataset = mixture(tables)
    posterior = LogDensity(build_model(dataset))
    z = 0.3 * np.random.default_rng(len(tables)).standard_normal(posterior.model.space.size)
    angles, parts = dataset.measurements.table(AngleTable), []
    for name in tables:
        alone = Measurements().with_tables(angles, dataset.measurements.table(KINDS[name].table))
        terms = build_model(Dataset(dataset.description, alone, {})).terms
        parts += [t for t in terms if (t.name == "wrap_angle") == (name == "angles")]

    def summed(z: Any, data: Any) -> Any:
        values = posterior.model.space.constrain(z)
        return sum(jnp.sum(t.log_likelihood(values, d)) for t, d in zip(parts, data, strict=True))

    log_likelihood = over_rows(summed, z[None], tuple(t.data for t in parts))[0]
    total = float(log_likelihood + np.sum(stats.norm.logpdf(z)))
    density = float(over_rows(posterior.log_density, z[None], posterior.data)[0])
    assert np.isfinite(density)
    assert density == pytest.approx(total, rel=1e-12)
