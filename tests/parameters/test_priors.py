"""Priors as maps from a standard normal, and the space they make together."""

from dataclasses import fields
from functools import cache

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from bowdenfit.errors import DescriptionError
from bowdenfit.parameters.priors import (
    HalfCauchy,
    HalfNormal,
    JohnsonSU,
    LogNormal,
    Normal,
    Prior,
    TruncatedNormal,
    Uniform,
)
from bowdenfit.parameters.space import Parameter, ParameterSpace

# Each prior with the same distribution as scipy writes it.
PRIORS = {
    "normal": (Normal(0.3, 2.0), stats.norm(0.3, 2.0)),
    "lognormal": (LogNormal(0.12, 0.7), stats.lognorm(0.7, scale=0.12)),
    "half-normal": (HalfNormal(0.02), stats.halfnorm(scale=0.02)),
    "half-Cauchy": (HalfCauchy(0.025), stats.halfcauchy(scale=0.025)),
    "Johnson's SU": (JohnsonSU(0.02), stats.johnsonsu(0.0, 1.0, scale=0.02)),
    "uniform from 0": (Uniform(0.0, 0.4), stats.uniform(0.0, 0.4)),
    "uniform across 0": (Uniform(-2.0, 3.0), stats.uniform(-2.0, 5.0)),
    "measured well": (TruncatedNormal(0.1, 0.004), stats.truncnorm(-25.0, np.inf, 0.1, 0.004)),
    "measured": (TruncatedNormal(0.1, 0.02), stats.truncnorm(-5.0, np.inf, 0.1, 0.02)),
    "measured badly": (TruncatedNormal(0.05, 0.1), stats.truncnorm(-0.5, np.inf, 0.05, 0.1)),
    "measured as nothing": (TruncatedNormal(0.0, 0.1), stats.truncnorm(0.0, np.inf, 0.0, 0.1)),
}
EVERY_PRIOR = pytest.mark.parametrize("name", PRIORS)
GRID = np.linspace(-8.0, 8.0, 641)
EPSILON = np.finfo(float).eps

# Quantiles of Phi(z), computed with mpmath to 60 digits.
QUANTILES = [
    (
        HalfNormal(1.0),
        {
            -30: 6.1496539326576804e-198,
            -8: 7.7968178354171801e-16,
            -3: 0.0016918470940848106,
            0: 0.67448975019608174,
            3: 3.2051549205989332,
            8: 8.0849110073915441,
        },
    ),
    (
        HalfCauchy(1.0),
        {
            -30: 7.707448213397734e-198,
            -8: 9.771862019201988e-16,
            -3: 0.0021204180475455506,
            0: 1.0,
            3: 471.6051163389837,
            8: 1023346418558685.6,
        },
    ),
    (
        TruncatedNormal(0.5, 1.0),
        {
            -30: 9.6368719976357678e-198,
            -8: 1.2218075405802092e-15,
            -3: 0.0026494707548816584,
            0: 0.89687117508954454,
            3: 3.6106425553546695,
            8: 8.5453045361080266,
        },
    ),
    (
        TruncatedNormal(2.0, 1.0),
        {
            -30: 8.8812737529014789e-197,
            -8: 1.1260092739546763e-14,
            -3: 0.023857492533582903,
            0: 2.0285169265909175,
            3: 5.0070025673729735,
            8: 10.0028331376136,
        },
    ),
    (
        TruncatedNormal(5.0, 1.0),
        {
            -30: 3.3003619526093601e-192,
            -8: 4.1843526790779884e-10,
            -3: 2.0000645863447477,
            0: 5.0000003592644675,
            3: 8.0000000873112993,
            8: 13.000000035295976,
        },
    ),
    (
        Uniform(0.0, 1.0),
        {
            -30: 4.9067139271481871e-198,
            -8: 6.2209605742717841e-16,
            -3: 0.0013498980316300945,
            0: 0.5,
            3: 0.99865010196836991,
        },
    ),
]


@cache
def _program(kind: type):
    """Quantile, its derivative and its inverse of one kind of prior, compiled once for all tests."""

    def evaluate(hyperparameters, z, value):
        prior = kind(*hyperparameters)
        value_at_z, slope = jax.vmap(jax.value_and_grad(prior.constrain))(z)
        return value_at_z, slope, prior.unconstrain(value)

    return jax.jit(evaluate)


def _evaluated(prior: Prior, z: np.ndarray, value: np.ndarray) -> list[np.ndarray]:
    hyperparameters = [jnp.asarray(getattr(prior, field.name)) for field in fields(prior)]
    padded = (np.pad(x, (0, 1024 - len(x)), mode="edge") for x in (z, value))
    return [np.asarray(x)[: len(z)] for x in _program(type(prior))(hyperparameters, *padded)]


def _constrained(prior: Prior, z: np.ndarray) -> np.ndarray:
    return _evaluated(prior, z, np.ones(len(z)))[0]


def _slope(prior: Prior, z: np.ndarray) -> np.ndarray:
    return _evaluated(prior, z, np.ones(len(z)))[1]


def _unconstrained(prior: Prior, value: np.ndarray) -> np.ndarray:
    return _evaluated(prior, np.zeros(len(value)), value)[2]


@EVERY_PRIOR
def test_every_prior_has_the_interface(name):
    assert isinstance(PRIORS[name][0], Prior)


@EVERY_PRIOR
def test_unconstrain_undoes_constrain_as_exactly_as_a_float_can_tell(name):
    prior, _ = PRIORS[name]
    value = _constrained(prior, GRID)
    back = _unconstrained(prior, value)
    resolution = 8 * EPSILON * np.abs(value) / _slope(prior, GRID)  # the change of z from the last digits of the value
    # Where the fraction of the range comes from a difference with an end, that end's last digits count too.
    if isinstance(prior, Uniform):
        resolution += 8 * EPSILON * max(abs(prior.low), abs(prior.high)) / _slope(prior, GRID)
    assert np.all(np.abs(back - GRID) < 1e-9 + resolution)


@EVERY_PRIOR
def test_quantiles_agree_with_scipy_in_both_tails(name):
    """The distribution function at the quantile is Phi(z): below from the left, above from the right."""
    prior, distribution = PRIORS[name]
    below, above = GRID[GRID <= 0], GRID[GRID >= 0]
    if isinstance(prior, Uniform) and prior.low != 0:  # its ends are no better known than to the last digit
        below = below[below > -5]
    if isinstance(prior, Uniform):
        above = above[above < 5]
    low, high = (_constrained(prior, z) for z in (below, above))
    if isinstance(prior, TruncatedNormal):  # scipy's own cancels next to 0; mpmath has the word there, see below
        low, below = low[below > -4], below[below > -4]
    np.testing.assert_allclose(distribution.cdf(low), stats.norm.cdf(below), rtol=1e-8)
    np.testing.assert_allclose(distribution.sf(high), stats.norm.sf(above), rtol=1e-8)


@EVERY_PRIOR
def test_the_median_is_at_zero(name):
    prior, distribution = PRIORS[name]
    assert _constrained(prior, np.zeros(1))[0] == pytest.approx(distribution.median(), rel=1e-13)


@pytest.mark.parametrize(("prior", "quantiles"), QUANTILES, ids=lambda x: repr(x) if isinstance(x, Prior) else "")
def test_quantiles_keep_thirteen_digits_far_into_both_tails(prior, quantiles):
    z, value = (np.array(x, dtype=float) for x in zip(*quantiles.items(), strict=True))
    np.testing.assert_allclose(_constrained(prior, z), value, rtol=1e-13)
    np.testing.assert_allclose(_unconstrained(prior, value), z, rtol=1e-11, atol=1e-13)


@EVERY_PRIOR
def test_every_prior_increases_strictly_and_stays_in_its_support(name):
    prior, distribution = PRIORS[name]
    low, high = distribution.support()
    inner = np.linspace(-5, 5, 401)  # further out a uniform prior is at its end, to the last digit
    assert np.all(np.diff(_constrained(prior, inner)) > 0)
    value = _constrained(prior, np.linspace(-38.0, 8.0, 500))
    assert np.all((value >= low) & (value <= high))


@EVERY_PRIOR
def test_derivatives_agree_with_finite_differences_also_at_zero(name):
    """Z = 0 is where the two branches of a quantile meet, and where least squares starts."""
    prior, _ = PRIORS[name]
    z = np.concatenate([np.linspace(-6.0, 6.0, 97), [0.0, -1e-12, 1e-12]])
    step = 1e-4
    left, right = (_constrained(prior, z + s) for s in (-step, step))
    slope = _slope(prior, z)
    rounding = 4 * EPSILON * np.maximum(np.abs(left), np.abs(right)) / step
    assert np.all(np.abs((right - left) / (2 * step) - slope) <= 1e-6 * slope + rounding)
    assert slope[-3] == pytest.approx(slope[-2], rel=1e-10)
    assert slope[-3] == pytest.approx(slope[-1], rel=1e-10)


@EVERY_PRIOR
def test_derivatives_are_finite_and_never_negative_however_far_out(name):
    slope = _slope(PRIORS[name][0], np.linspace(-38.0, 37.0, 501))
    assert np.all(np.isfinite(slope))
    assert np.all(slope >= 0)


def test_a_half_cauchy_to_a_power_is_that_power_of_one():
    z = np.linspace(-8.0, 8.0, 33)
    root = _constrained(HalfCauchy(0.1), z)
    for powers in (2.0, 0.5, np.tile([1.0, 2.0, 1.0], 11), np.tile([1.0, 2.0, 3.0], 11)):
        with jax.enable_x64(True):
            computed = np.asarray(HalfCauchy(0.1, powers).constrain(jnp.asarray(z)))
        np.testing.assert_allclose(computed, root**powers, rtol=1e-13)


def _parameter(name: str, prior: Prior, **more) -> Parameter:
    return Parameter(name, f"${name}$", "a parameter of a test", "friction", prior, **more)


def _space(fixed: tuple[str, ...] = ()) -> ParameterSpace:
    """Every prior twice, kinds interleaved, some fixed."""
    names = [f"{name}, {copy}" for copy in (1, 2) for name in PRIORS]
    settings = {name: {"fixed": 0.25} if name in fixed else {} for name in names}
    return ParameterSpace(tuple(_parameter(n, PRIORS[n.split(", ")[0]][0], **settings[n]) for n in names))


_there_and_back = jax.jit(lambda z: _space().unconstrain(_space().constrain(z)))


@settings(deadline=None, derandomize=True, max_examples=50)
@given(st.lists(st.floats(-4.0, 4.0), min_size=2 * len(PRIORS), max_size=2 * len(PRIORS)))
def test_a_space_returns_the_z_it_was_given(z):
    np.testing.assert_allclose(_there_and_back(np.array(z)), z, atol=1e-9)


def test_a_space_maps_every_parameter_by_its_own_prior_in_its_own_place():
    space = _space(fixed=("lognormal, 1", "measured, 2"))
    z = np.random.default_rng(1).standard_normal(space.size)
    values, vector = jax.jit(lambda z: (space.constrain(z), space.vector(z)))(z)
    alone = jax.jit(lambda z: [p.prior.constrain(x) for p, x in zip(space.free, z, strict=True)])(z)
    for i, parameter in enumerate(space.free):
        assert float(values[parameter.name]) == pytest.approx(float(alone[i]), rel=1e-14)
        assert float(vector[i]) == float(values[parameter.name])
        assert space.index[parameter.name] == i


def test_fixed_parameters_are_among_the_values_but_not_in_z():
    space = _space(fixed=("lognormal, 1", "measured, 2"))
    assert space.size == 2 * len(PRIORS) - 2
    assert {p.name for p in space.fixed} == {"lognormal, 1", "measured, 2"}
    assert not {"lognormal, 1", "measured, 2"} & set(space.index)
    values = jax.jit(space.constrain)(np.zeros(space.size))
    assert list(values) and {float(values[p.name]) for p in space.fixed} == {0.25}


def test_a_space_without_free_parameters_still_names_its_values():
    space = ParameterSpace((_parameter("mu", LogNormal(0.1, 1.0), fixed=0.2),))
    assert space.vector(jnp.zeros(0)).shape == (0,)
    assert float(space.constrain(jnp.zeros(0))["mu"]) == 0.2
    assert space.unconstrain({"mu": 0.2}).shape == (0,)


def test_two_parameters_of_one_name_are_refused_with_the_name_and_a_remedy():
    twice = (_parameter("mu", LogNormal(0.1, 1.0)), _parameter("mu", HalfNormal(1.0)))
    with pytest.raises(DescriptionError, match="both called 'mu'; rename"):
        ParameterSpace(twice)


def test_a_label_carries_the_unit_where_there_is_one():
    assert _parameter("mu", HalfNormal(1.0)).label == "$mu$"
    assert _parameter("s", HalfNormal(1.0), unit="deg").label == "$s$ (deg)"


@pytest.mark.parametrize(
    ("prior", "unit", "scale", "text"),
    [
        (Normal(0.5, 2.0), "mm", 1.0, "Normal(0.5, 2) mm"),
        (LogNormal(np.deg2rad(30.0), 0.7), "deg", np.rad2deg(1.0), "LogNormal(30 deg, 0.7)"),
        (HalfNormal(np.deg2rad(5.0)), "deg", np.rad2deg(1.0), "HalfNormal(5 deg)"),
        (Uniform(-0.25, 0.5), "1", 1.0, "Uniform(-0.25, 0.5)"),
        (Uniform(0.0, 0.002), "ms", 1000.0, "Uniform(0, 2) ms"),
        (TruncatedNormal(3.0, 0.1), "N", 1.0, "Normal(3, 0.1) N, cut off at 0"),
    ],
)
def test_a_prior_says_itself_in_the_unit_in_which_its_parameter_is_shown(prior, unit, scale, text):
    assert prior.text(unit, scale) == text
    assert _parameter("x", prior, unit=unit, shown_scale=scale).prior_text == text


def test_what_is_said_of_a_prior_comes_before_what_it_says_itself():
    assert _parameter("x", HalfNormal(1.0), fixed=0.1).prior_text == "fixed"
    assert (
        _parameter("x", HalfNormal(1.0), fixed=0.1, prior_words="fixed (data sheet)").prior_text == "fixed (data sheet)"
    )
    assert _parameter("x", HalfNormal(1.0), prior_words="measured 1 +- 0.1").prior_text == "measured 1 +- 0.1"
    assert HalfNormal(0.0174533).text("mm/deg", 1.0, digits=3) == "HalfNormal(0.0175 mm/deg)"
