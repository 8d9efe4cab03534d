"""Contact laws with parameters of their own: recovered, told in results, and asked by the stretch of the rope too."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from elastic_cables import HOUSING, TRUTH, bench, elastic_cable
from own_angle_tables import of_rows
from simulated_coverage import Laboratory

import bowdenfit as bf
from bowdenfit.dataset import Dataset
from bowdenfit.errors import DescriptionError
from bowdenfit.kinds.descriptions import parse_description
from bowdenfit.kinds.tables import StretchTable
from bowdenfit.models import build_model
from bowdenfit.questions.check.verb import check
from bowdenfit.questions.next.answer import choose_target
from bowdenfit.questions.simulate.tables import draw_true_values
from bowdenfit.questions.summary import coefficients_figure, pairs_figure

MU, WOBBLE = 0.13, np.deg2rad(35.0)
FOLDER = """
name = "Wandering sheath"
[[contact]]
name = "sheath"
friction = "mu"
law = "wobble"
wrap_angle = { column = "wrap_angle", nominal = { value = 90, unit = "deg" } }
[tables]
efficiencies = { file = "efficiencies.csv" }
[sampler]
n_walkers = 32
max_steps = 1000
target_ess = 200
target_r_hat = 1.05
"""


def wandering(n: int = 40, scatter: float = 0.004, seed: int = 3) -> tuple[np.ndarray, np.ndarray]:
    """Losses at wrap angles up to a turn of a sheath that wanders, simulated without the package."""
    angle = np.linspace(0.0, 2 * np.pi, n)
    return MU * (angle + WOBBLE) + scatter * np.random.default_rng(seed).standard_normal(n), angle[:, None]


def lawful(law: str = "wobble", scatter: float = 0.004, **more) -> Dataset:
    """Such losses, to be fitted with this law."""
    dataset = of_rows(*wandering(scatter=scatter))
    raw = dataset.description.to_json()
    raw["contact"][0]["law"] = law
    return Dataset(parse_description(raw | more), dataset.measurements, {})


def written(folder, more: str = ""):
    """The same as a folder of files."""
    loss, angle = wandering()
    rows = [f"{a},{e}" for a, e in zip(np.rad2deg(angle[:, 0]), np.exp(-loss), strict=True)]
    (folder / "cable.toml").write_text(FOLDER + more)
    (folder / "efficiencies.csv").write_text("\n".join(["wrap_angle_deg,efficiency", *rows]))
    return folder


@pytest.fixture(scope="module")
def fitted(tmp_path_factory):
    """A fit of a folder whose contact has the law, from its description to its written results."""
    folder = written(tmp_path_factory.mktemp("wobble"))
    return bf.fit(folder, seed=1, output=folder / "results", figures=False)


# Recovery ---------------------------------------------------------------------------------------------------------


def test_coefficient_and_unintended_wrap_angle_are_recovered_exactly_without_noise():
    solution = Laboratory().least_squares(lawful(scatter=0.0))
    assert solution.estimates["mu1"].value == pytest.approx(MU, rel=1e-7)
    assert solution.estimates["wobble_contact_1"].value == pytest.approx(35.0, rel=1e-7)


@pytest.mark.extended
def test_with_noise_both_are_recovered_within_their_errors_while_the_capstan_equation_alone_is_wrong():
    laboratory = Laboratory()
    solution, plain = (laboratory.least_squares(lawful(law)) for law in ("wobble", "capstan"))
    for name, truth in (("mu1", MU), ("wobble_contact_1", 35.0)):
        estimate = solution.estimates[name]
        assert abs(estimate.value - truth) < 3 * estimate.standard_error
        assert estimate.standard_error < 0.1 * truth
    assert plain.estimates["mu1"].value > 1.1 * MU  # what the sheath wanders goes into the coefficient


@pytest.mark.extended
def test_the_posterior_holds_the_truth_of_a_law_s_parameter(fitted):
    low, high = np.quantile(fitted.draws().values["wobble_sheath"], (0.005, 0.995))
    assert low < 35.0 < high
    assert high - low < 15.0


def test_errors_of_wrap_angles_enter_by_the_law_s_slope():
    cable, angle = build_model(lawful()).cable, jnp.linspace(0.0, 6.0, 9)[:, None]
    values, step = {"mu1": jnp.asarray(MU), "wobble_contact_1": jnp.asarray(WOBBLE)}, 1e-6
    variance = cable.exponent_variance(values, angle, jnp.full(angle.shape, 0.01))
    slope = (cable.friction_exponent(values, angle + step) - cable.friction_exponent(values, angle - step)) / (2 * step)
    np.testing.assert_allclose(variance, 0.01 * np.asarray(slope) ** 2, rtol=1e-8)


# The stretch of the rope ------------------------------------------------------------------------------------------


@pytest.mark.extended
def test_the_stretch_of_the_rope_asks_the_law_of_its_contact():
    """Against the formulas written out: e(T) averaged along F exp(-Lambda s), by the wobbling exponent."""
    truth = TRUTH | {"wobble_housing": 35.0}
    description = elastic_cable(("stretch",), kind="single", contact=[HOUSING | {"law": "wobble"}])
    dataset, _ = bench(description, truth, noise=False)
    rows = dataset.measurements.table(StretchTable)
    loading, exponent = ~rows.unloading, truth["mu"] * (rows.wrap_angle + WOBBLE)
    tension = rows.load * -np.expm1(-exponent) / exponent
    nodes, weights = np.polynomial.legendre.leggauss(30)
    along = rows.load * np.exp(-exponent * (nodes[:, None] + 1) / 2)
    bedded = truth["bedding_stretch"] * (weights / 2 @ -np.expm1(-along / truth["bedding_load"]))
    lengthened = truth["lengthening"] * np.rad2deg(rows.wrap_angle) - truth["stretch_zero"]
    stretch = tension / truth["stiffness"] + bedded + lengthened
    assert loading.sum() > 20
    np.testing.assert_allclose(rows.stretch[loading], stretch[loading], rtol=1e-6, atol=1e-8)


@pytest.mark.extended
def test_the_law_s_parameter_is_recovered_from_stretch_alone():
    description = elastic_cable(("stretch",), kind="single", contact=[HOUSING | {"law": "wobble"}])
    dataset, values = bench(description, TRUTH | {"wobble_housing": 35.0}, noise=False)
    solution = Laboratory().least_squares(dataset)
    assert solution.estimates["wobble_housing"].value == pytest.approx(35.0, rel=1e-5)
    assert solution.estimates["mu"].value == pytest.approx(values["mu"], rel=1e-5)


def test_a_rope_stretched_by_the_friction_of_several_contacts_with_such_a_law_is_refused():
    contacts = [HOUSING | {"law": "wobble"}, HOUSING | {"name": "second"}]
    with pytest.raises(
        DescriptionError, match=r"acts in 2 contacts, and by the wobble law .* leave stretch.friction out"
    ):
        elastic_cable(("stretch",), kind="single", contact=contacts)
    assert elastic_cable(("stretch",), kind="single", contact=contacts, stretch={}).stretch.friction is None


# What users say and read ------------------------------------------------------------------------------------------


@pytest.mark.extended
def test_the_parameter_of_a_law_stands_in_the_summary_with_its_prior_and_unit(fitted):
    page = fitted.summary()["parameters"]["wobble_sheath"]
    assert (page["prior"], page["unit"]) == ("HalfNormal(30 deg)", "deg")
    assert page["contraction"] > 0.9


def test_summary_and_check_name_the_law(tmp_path, run):
    folder = written(tmp_path)
    assert run("check", folder)[1].count("sheath: mu, wobble law, wrap angle measured in every row") == 1
    code, out, _ = run("fit", folder, "--no-mcmc", "--no-figures", "-o", tmp_path / "results")
    assert code == 0
    assert "the wobble law in the contact 'sheath'" in " ".join((tmp_path / "results/details.txt").read_text().split())
    assert [line for line in out.splitlines() if line.startswith("wobble_sheath") and " deg " in line]


@pytest.mark.extended
def test_figures_show_the_parameter_of_a_law(fitted):
    assert [p.symbol for p in coefficients_figure.data(fitted)] == [r"$\mu$", "$w$ sheath"]
    assert any("$w$ sheath" in quantity.label and "deg" in quantity.label for quantity in pairs_figure.data(fitted).quantities)


@pytest.mark.extended
def test_identifiability_and_the_next_measurement_know_the_parameter_of_a_law(fitted):
    assert {p.name for p in fitted.known.groups["friction"].parameters} == {"mu", "wobble_sheath"}
    assert choose_target(fitted, "wobble_sheath").unit == "deg"


@pytest.mark.parametrize(
    ("setting", "text"),
    [
        ({"fixed": 20.0}, "fixed"),
        ({"measured": {"value": 30.0, "sd": 4.0}}, "measured 30 ± 4 deg"),
        ({"prior": {"uniform": {"low": 0.0, "high": 90.0}}}, "Uniform(0, 90) deg"),
    ],
)
def test_a_law_s_parameter_is_fixed_measured_or_given_a_prior_like_any_other(setting, text):
    model = build_model(lawful(prior={"wobble_contact_1": setting}))
    (parameter,) = [p for p in model.space.parameters if p.name == "wobble_contact_1"]
    assert parameter.prior_text == text
    if parameter.fixed is not None:
        assert parameter.fixed == pytest.approx(np.deg2rad(20.0))


@pytest.mark.extended
def test_a_simulation_s_truth_may_state_a_law_s_parameter_in_its_unit():
    dataset = lawful()
    values = draw_true_values(dataset.description, dataset.measurements, {"wobble_contact_1": 20.0}, jax.random.key(0))
    assert values["wobble_contact_1"] == pytest.approx(np.deg2rad(20.0))


def test_an_unknown_law_is_refused_with_the_nearest_one_before_anything_is_built(tmp_path):
    with pytest.raises(DescriptionError, match="contact 'sheath': the law 'wobbel' is unknown; did you mean 'wobble'"):
        check(written(tmp_path), settings=["contact.0.law=wobbel"])
