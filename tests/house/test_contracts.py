"""Rules of the house that a machine can check: layers, lazy imports, and what registered laws and curves must offer."""

import ast
import subprocess
import sys
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from bowdenfit.cable.laws import Capstan, ContactLaw
from bowdenfit.cable.registry import CONTACT_LAWS, CURVES, load_class
from bowdenfit.description import PriorDefaults, Route
from bowdenfit.questions.figures import FIGURES

ROOT = Path(__file__).parents[2]
ROUTE = Route(variable="cable_length", unit="mm", range=(400.0, 600.0))
LENGTHS = jnp.linspace(400.0, 600.0, 21)
DEFAULTS = PriorDefaults()
HELP = "import contextlib, sys\nfrom bowdenfit.cli import bowdenfit\nwith contextlib.redirect_stdout(sys.stderr):\n" + (
    "    for verb in bowdenfit: bowdenfit([verb, '--help'])"
)


def test_layers_import_only_downward():
    done = subprocess.run(
        [sys.executable, "-c", "from importlinter.cli import lint_imports_command as c; c()", "--no-cache"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert "0 broken" in done.stdout, done.stdout + done.stderr


@pytest.mark.parametrize(
    ("code", "heavy"),
    [
        (HELP, {"jax", "emcee", "matplotlib", "pint", "pydantic", "numpy"}),
        ("import bowdenfit", {"jax", "emcee", "matplotlib", "pint", "pydantic", "arviz_base", "scipy"}),
        ("import bowdenfit.cli", {"jax", "emcee", "matplotlib", "pint", "pydantic", "numpy"}),
        ("import bowdenfit as bf; bf.read('datasets/on-body-exoskeleton')", {"jax", "emcee", "matplotlib"}),
        ("import bowdenfit as bf; bf.read('datasets/synthetic-recordings')", {"jax", "emcee", "scipy.optimize"}),
        (
            "import bowdenfit.questions.figures",
            {"jax", "emcee", "scipy", "pint", "matplotlib"},
        ),
        ("import bowdenfit.run.verb, bowdenfit.questions.summary, bowdenfit.questions.error_budget", {"scipy.optimize"}),
        ("import bowdenfit.inference.diagnostics, bowdenfit.results.netcdf", {"jax", "emcee", "matplotlib"}),
    ],
)
def test_imports_load_nothing_heavy(code, heavy):
    listing = f"{code}\nimport sys; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", listing], cwd=ROOT, capture_output=True, text=True, check=True)
    assert not heavy & set(done.stdout.split())


@pytest.mark.extended
@pytest.mark.parametrize(
    "code",
    [
        "bf.simulate('datasets/synthetic-bench/bench.toml', seed=1)",
        "bf.simulate('datasets/synthetic-haptic-loop/bench.toml', seed=1)",
        "bf.identify('datasets/synthetic-haptic-loop/bench.toml')",
    ],
)
def test_what_is_asked_of_a_plan_once_is_compiled_as_a_few_programs(code):
    """Not operation by operation, of which there are more than a hundred and each is a program of its own."""
    counting = (
        "import jax, bowdenfit as bf; names = []\n"
        "jax.monitoring.register_event_duration_secs_listener(lambda name, *_, **__: names.append(name))\n"
        f"{code}\nprint(sum('backend_compile' in name for name in names))"
    )
    done = subprocess.run([sys.executable, "-c", counting], cwd=ROOT, capture_output=True, text=True, check=True)
    assert 3 <= int(done.stdout) <= 30


def test_every_figure_file_of_a_fit_is_listed():
    files = (ROOT / "bowdenfit" / "questions").glob("*/*_figure.py")
    of_fits = {path.stem.removesuffix("_figure") for path in files if "\ndef data(fit:" in path.read_text(encoding="utf-8")}
    assert of_fits == set(FIGURES)
    assert all(callable(figure.draw) and callable(figure.caption) and figure.HEADING for figure in FIGURES.values())


def test_importing_changes_no_global_setting():
    code = (
        "import jax; before = dict(jax.config.values); import bowdenfit; bowdenfit.fit; "
        "print(before == dict(jax.config.values))"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "True"


def _law(name: str) -> tuple[ContactLaw, dict[str, jax.Array]]:
    """A law of a contact, with values of its coefficient and of its own parameters."""
    law = load_class(CONTACT_LAWS[name])("free sheath", "mu")
    own_values = {p.name: p.prior.constrain(jnp.array(0.4)) for p in law.parameters(DEFAULTS)}
    return law, {"mu": jnp.array(0.12), **own_values}


@pytest.mark.parametrize("name", CONTACT_LAWS)
def test_a_contact_law_never_gains_force_and_loses_more_with_more_wrap(name):
    law, values = _law(name)
    exponent = law.exponent(values, jnp.linspace(0.0, 6.0, 25))
    assert exponent[0] >= 0.0
    assert np.all(np.diff(exponent) > 0)


def test_the_capstan_equation_loses_nothing_without_wrap():
    assert Capstan("free sheath", "mu").exponent({"mu": jnp.array(0.12)}, jnp.zeros(1))[0] == 0.0


@pytest.mark.parametrize("name", CONTACT_LAWS)
def test_the_slope_of_a_contact_law_is_its_derivative(name):
    law, values = _law(name)
    points, step = jnp.array([0.1, 1.0, 4.0]), 1e-5
    difference = (law.exponent(values, points + step) - law.exponent(values, points - step)) / (2 * step)
    np.testing.assert_allclose(law.slope(values, points), difference, rtol=1e-9)


@pytest.mark.parametrize("name", CONTACT_LAWS)
def test_parameters_of_a_contact_law_are_fully_declared_and_named_after_the_contact(name):
    for p in _law(name)[0].parameters(DEFAULTS):
        assert p.name.endswith("_free_sheath")
        assert p.symbol.startswith("$")
        assert "free sheath" in p.meaning
        assert p.role == "friction_model"
        assert np.isfinite(float(p.prior.constrain(jnp.zeros(()))))


@pytest.mark.parametrize("name", CURVES)
def test_a_curve_gives_finite_angles_that_are_not_negative_over_the_prior(name):
    curve = load_class(CURVES[name].place)("sheath_angle", ROUTE)
    parameters = curve.parameters(np.array([0.3, 0.5, 0.9]), DEFAULTS)
    for z in np.random.default_rng(0).standard_normal((200, len(parameters))):
        values = {p.name: p.prior.constrain(jnp.array(x)) for p, x in zip(parameters, z, strict=True)}
        angle = np.asarray(curve.wrap_angle(values, LENGTHS))
        assert np.all(np.isfinite(angle))
        assert np.all(angle >= 0)  # a bell far narrower than the range is 0 to the last digit far from its middle


@pytest.mark.parametrize("name", CURVES)
def test_a_curve_names_the_unit_of_every_derived_quantity(name):
    curve = load_class(CURVES[name].place)("sheath_angle", ROUTE)
    parameters = curve.parameters(np.array([0.3, 0.5, 0.9]), DEFAULTS)
    values = {p.name: p.prior.constrain(jnp.array(0.3)) for p in parameters}
    assert set(curve.derived(values)) == set(curve.derived_units())


@pytest.mark.parametrize("name", CURVES)
def test_parameters_of_a_curve_are_fully_declared(name):
    parameters = load_class(CURVES[name].place)("sheath_angle", ROUTE).parameters(np.zeros(0), DEFAULTS)
    assert len(parameters) == CURVES[name].coefficients
    for p in parameters:
        assert p.symbol.startswith("$")
        assert p.meaning
        assert p.prior_text
        assert np.isfinite(float(p.prior.constrain(jnp.zeros(()))))


def test_every_public_name_is_documented():
    import bowdenfit

    for name in bowdenfit.__all__:
        assert getattr(bowdenfit, name).__doc__, name


def test_type_checkers_and_python_have_the_same_public_names():
    import bowdenfit

    for_types = next(node for node in ast.parse(Path(bowdenfit.__file__).read_text()).body if isinstance(node, ast.If))
    imports = [node for node in for_types.body if isinstance(node, ast.ImportFrom) and node.module != "typing"]
    names = {alias.asname: node.module for node in imports for alias in node.names if alias.name != "*"}
    assert names == bowdenfit._MODULES


def test_inner_functions_refuse_32_bit_floats(on_body):
    from bowdenfit.dataset import load_dataset
    from bowdenfit.inference.log_density import LogDensity
    from bowdenfit.models import build_model

    model = build_model(load_dataset(on_body))
    with jax.enable_x64(False), pytest.raises(RuntimeError, match="64-bit"):
        LogDensity(model)
