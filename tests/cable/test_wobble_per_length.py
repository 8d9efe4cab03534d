"""Friction per length of the sheath beside friction per angle: recovered, predicted at other lengths, or refused."""

import numpy as np
import pandas as pd
import pytest
from simulated_coverage import Laboratory

import bowdenfit as bf
from bowdenfit.errors import DescriptionError
from bowdenfit.models import build_model

MU, K = 0.12, 0.05
LENGTHS, ANGLES = (0.3, 0.8, 1.4, 2.0), (0.0, 60.0, 120.0, 180.0)
ROUTE = '[route]\nvariable = "sheath_length"\nunit = "m"\nrange = [0.3, 2.0]\n'
TOML = """schema = 1
name = "straight and bent"
ROUTE[[contact]]
name = "sheath"
friction = "mu"
law = "wobble-per-length"
length = LENGTH
wrap_angle = { column = "wrap_angle", nominal = { value = 90, unit = "deg" } }
[tables]
TABLE
"""


def bench(folder, *, noise=0.0, unit="m", along_angle=False, forces=False, seed=0, length='"route"'):
    """A bench whose sheaths differ in length and bend, by NumPy alone."""
    generator, scale = np.random.default_rng(seed), {"m": 1.0, "mm": 1000.0}[unit]
    places = [(length, 90 * length if along_angle else angle) for length in LENGTHS for angle in ANGLES]
    rows = []
    for run, (metres, angle) in enumerate(places):
        exponent = MU * np.deg2rad(angle) + K * metres + noise * generator.standard_normal()
        if forces:
            cells = [[f"{run}", stroke, 40, 40 * np.exp(-sign * exponent)] for stroke, sign in (("pull", 1), ("return", -1))]
        else:
            cells = [[np.exp(-exponent)]]
        rows += [[scale * metres, angle, *row] for row in cells]
    heads = f"sheath_length_{unit},wrap_angle_deg," + ("run,stroke,input_force_N,output_force_N" if forces else "efficiency")
    (folder / "t.csv").write_text("\n".join([heads, *(",".join(map(str, row)) for row in rows)]) + "\n")
    table = ("forces" if forces else "efficiencies") + ' = { file = "t.csv" }'
    route = ROUTE.replace('"m"', f'"{unit}"').replace("[0.3, 2.0]", f"[{0.3 * scale}, {2.0 * scale}]")
    text = TOML.replace("ROUTE", route).replace("LENGTH", length).replace("TABLE", table)
    (folder / "cable.toml").write_text(text)
    return folder


@pytest.mark.parametrize(("unit", "forces"), [("m", False), ("mm", True)])
def test_both_coefficients_are_recovered_exactly_without_noise(tmp_path, unit, forces):
    fit = Laboratory().least_squares(bf.read(bench(tmp_path, unit=unit, forces=forces, noise=1e-9)))
    assert fit.estimates["mu"].value == pytest.approx(MU, rel=1e-4)
    assert fit.estimates["wobble_per_m_sheath"].value == pytest.approx(K, rel=1e-4)


def test_with_noise_both_are_recovered_within_their_errors_and_the_capstan_equation_alone_is_wrong(tmp_path):
    """Within 3.5 standard errors: 1 in 2000 is not, for each of two."""
    folder = bench(tmp_path, noise=0.01, seed=5)
    fit = Laboratory().least_squares(bf.read(folder))
    for name, truth in (("mu", MU), ("wobble_per_m_sheath", K)):
        estimate = fit.estimates[name]
        assert abs(estimate.value - truth) < 3.5 * estimate.standard_error < 0.6 * truth
    text = (folder / "cable.toml").read_text().replace('law = "wobble-per-length"\nlength = "route"\n', "")
    (folder / "cable.toml").write_text(text)
    assert Laboratory().least_squares(bf.read(folder)).estimates["mu"].value > 1.1 * MU


def test_one_length_of_all_rows_is_stated_in_any_unit(tmp_path):
    for length in ('{ value = 1.5, unit = "m" }', '{ value = 1500, unit = "mm" }'):
        cable = build_model(bf.read(bench(tmp_path, length=length))).cable
        exponent = cable.friction_exponent({"mu": MU, "wobble_per_m_sheath": K}, np.array([[np.pi]]))
        assert float(exponent[0]) == pytest.approx(MU * np.pi + 1.5 * K, rel=1e-6)


@pytest.mark.parametrize("forces", [False, True])
def test_one_length_needs_no_route(tmp_path, forces):
    """Friction per length is then what is left of the loss without any bend."""
    folder = bench(tmp_path, length='{ value = 1.5, unit = "m" }', forces=forces, noise=1e-9)
    text = (folder / "cable.toml").read_text()
    (folder / "cable.toml").write_text(text.replace(ROUTE, ""))
    head, *rows = (folder / "t.csv").read_text().splitlines()
    selected_rows = [row for row in rows if row.startswith("1.4")]
    (folder / "t.csv").write_text("\n".join([head, *selected_rows]).replace("sheath_length_m,", "").replace("1.4,", "") + "\n")
    fit = Laboratory().least_squares(bf.read(folder))
    assert fit.estimates["mu"].value == pytest.approx(MU, rel=1e-4)
    assert fit.estimates["wobble_per_m_sheath"].value == pytest.approx(K * 1.4 / 1.5, rel=1e-3)


def test_at_a_route_value_the_exponent_is_that_of_the_length_and_at_a_bend_alone_it_is_refused(tmp_path):
    cable = build_model(bf.read(bench(tmp_path, unit="mm"))).cable
    values = {"mu": MU, "wobble_per_m_sheath": K}
    np.testing.assert_allclose(cable.exponent_at(values, np.array([300.0, 1700.0])), MU * np.pi / 2 + K * np.array([0.3, 1.7]))
    output = cable.output_force_at(values, np.array([1000.0]), np.asarray(40.0), np.asarray(1.0))
    np.testing.assert_allclose(output, 40 * np.exp(-MU * np.pi / 2 - K))
    with pytest.raises(DescriptionError, match="at a bend alone"):
        cable.friction_exponent(values, np.array([[1.0]]))


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('length = "route"\n', "", "needs the length of the sheath"),
        ('law = "wobble-per-length"\n', "", 'which only law = "wobble-per-length" depends on'),
        (ROUTE, "", "in a unit of length"),
        ('"route"', '{ value = -1, unit = "m" }', "length"),
        ('"route"', '{ value = 1, unit = "N" }', "length"),
        ("[tables]", '[stretch]\nfriction = "mu"\n[tables]', "does not act on the stretch"),
    ],
)
def test_a_length_that_is_missing_or_means_nothing_is_refused(tmp_path, old, new, words):
    folder = bench(tmp_path)
    text = (folder / "cable.toml").read_text().replace(old, new)
    (folder / "cable.toml").write_text(text)
    with pytest.raises(bf.BowdenfitError) as refusal:
        bf.read(folder)
    assert words in str(refusal.value)


@pytest.mark.extended
def test_a_fit_says_both_predicts_at_other_lengths_and_exports_them(tmp_path):
    fit = bf.fit(bench(tmp_path, noise=0.01, seed=2), seed=1, figures=False)
    page = fit.summary()["parameters"]["wobble_per_m_sheath"]
    assert page["unit"] == "1/m" and page["q05"] < K < page["q95"]
    assert fit.verdict().trusted
    truth = [np.exp(-MU * np.pi / 2 - K * metres) for metres in (0.5, 1.9)]
    predicted = fit.efficiency([0.5, 1.9]).to_frame()["efficiency"]
    assert list(predicted) == pytest.approx(truth, abs=0.02)
    bf.export(fit, "csv", tmp_path / "cable.csv", points=18)
    table = pd.read_csv(tmp_path / "cable.csv", comment="#")
    exponent = np.interp([0.5, 1.9], table.iloc[:, 0], table["friction_exponent_q50"])
    np.testing.assert_allclose(np.exp(-exponent), predicted, rtol=1e-3)


@pytest.mark.extended
def test_where_lengths_and_angles_grow_together_it_is_said_that_they_cannot_be_told_apart(tmp_path):
    bf.fit(bench(tmp_path, noise=0.01, along_angle=True), seed=1, output=tmp_path / "results", figures=False)
    summary = " ".join((tmp_path / "results" / "summary.txt").read_text().split())
    assert "mu and wobble_per_m_sheath are strongly correlated" in summary
