"""Rules of the house that a machine can check: layers, lazy imports, and what registered laws and curves must offer."""

import subprocess
import sys
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from bowdenfit.cable.curves import CURVES
from bowdenfit.cable.laws import CONTACT_LAWS
from bowdenfit.description import PriorDefaults, Route

ROOT = Path(__file__).parents[2]
ROUTE = Route(variable="cable_length", unit="mm", range=(400.0, 600.0))
LENGTHS = jnp.linspace(400.0, 600.0, 21)


def test_layers_import_only_downward():
    found = subprocess.run(
        [sys.executable, "-c", "from importlinter.cli import lint_imports_command as c; c()", "--no-cache"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert "0 broken" in found.stdout, found.stdout + found.stderr


@pytest.mark.parametrize(
    ("code", "heavy"),
    [
        ("import bowdenfit", {"jax", "emcee", "matplotlib", "pint", "pydantic", "arviz_base", "scipy"}),
        ("import bowdenfit.cli", {"jax", "emcee", "matplotlib", "pint", "pydantic", "numpy"}),
        ("import bowdenfit as bf; bf.read('datasets/on-body-exoskeleton')", {"jax", "emcee", "matplotlib"}),
        (
            "import bowdenfit.questions.summary.gallery, bowdenfit.questions.summary.figure_data",
            {"jax", "emcee", "scipy", "pint", "matplotlib"},
        ),
        ("import bowdenfit.inference.diagnostics, bowdenfit.results.netcdf", {"jax", "emcee", "matplotlib"}),
    ],
)
def test_imports_load_nothing_heavy(code, heavy):
    listing = f"{code}\nimport sys; print(*sys.modules)"
    found = subprocess.run([sys.executable, "-c", listing], cwd=ROOT, capture_output=True, text=True, check=True)
    assert not heavy & set(found.stdout.split())


def test_importing_changes_no_global_setting():
    code = (
        "import jax; before = dict(jax.config.values); import bowdenfit; bowdenfit.fit; "
        "print(before == dict(jax.config.values))"
    )
    found = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert found.stdout.strip() == "True"


@pytest.mark.parametrize("name", CONTACT_LAWS)
def test_a_contact_law_loses_nothing_without_wrap_and_more_with_more(name):
    law = CONTACT_LAWS[name]
    angles = jnp.linspace(0.0, 6.0, 25)
    exponent = law.exponent(jnp.array(0.12), angles)
    assert exponent[0] == 0.0
    assert np.all(np.diff(exponent) > 0)


@pytest.mark.parametrize("name", CONTACT_LAWS)
def test_the_sensitivity_of_a_contact_law_is_its_derivative(name):
    law = CONTACT_LAWS[name]
    for angle in (0.1, 1.0, 4.0):
        derivative = jax.grad(lambda a: law.exponent(jnp.array(0.12), a[None])[0])(jnp.array(angle))
        np.testing.assert_allclose(law.sensitivity(jnp.array(0.12), jnp.array([angle]))[0], derivative, rtol=1e-12)


@pytest.mark.parametrize("name", CURVES)
def test_a_curve_gives_positive_finite_angles_over_the_prior(name):
    curve = CURVES[name]("sheath_angle", ROUTE)
    parameters = curve.parameters(np.array([0.3, 0.5, 0.9]), PriorDefaults())
    for z in np.random.default_rng(0).standard_normal((200, len(parameters))):
        values = {p.name: p.prior.constrain(jnp.array(x)) for p, x in zip(parameters, z, strict=True)}
        angle = np.asarray(curve.wrap_angle(values, LENGTHS))
        assert np.all(np.isfinite(angle))
        assert np.all(angle > 0)


@pytest.mark.parametrize("name", CURVES)
def test_a_curve_names_the_unit_of_every_derived_quantity(name):
    curve = CURVES[name]("sheath_angle", ROUTE)
    parameters = curve.parameters(np.array([0.3, 0.5, 0.9]), PriorDefaults())
    values = {p.name: p.prior.constrain(jnp.array(0.3)) for p in parameters}
    assert set(curve.derived(values)) == set(curve.derived_units())


@pytest.mark.parametrize("name", CURVES)
def test_parameters_of_a_curve_are_fully_declared(name):
    for p in CURVES[name]("sheath_angle", ROUTE).parameters(np.zeros(0), PriorDefaults()):
        assert p.symbol.startswith("$")
        assert p.meaning
        assert p.prior_text
        assert np.isfinite(float(p.prior.constrain(jnp.zeros(()))))


def test_every_public_name_is_documented():
    import bowdenfit

    for name in bowdenfit.__all__:
        assert getattr(bowdenfit, name).__doc__, name


def test_inner_functions_refuse_32_bit_floats(on_body):
    from bowdenfit.dataset import load_dataset
    from bowdenfit.inference.log_density import LogDensity
    from bowdenfit.model import build_model

    model = build_model(load_dataset(on_body))
    with jax.enable_x64(False), pytest.raises(RuntimeError, match="64-bit"):
        LogDensity(model)
