"""A newcomer adds one of everything in a package of their own, by an entry point or a line in a registry, and fits with it."""

import json
import os
import shutil
import subprocess
import sys
from functools import partial

import numpy as np
import pytest
from conftest import ROOT
from scratch import curve, law, option, shares
from scratch import format as bars

import bowdenfit as bf
from bowdenfit.cable.friction_options import FRICTION_OPTIONS
from bowdenfit.cable.registry import CONTACT_LAWS, CURVES, CurveFamily
from bowdenfit.cli.commands import command
from bowdenfit.files import FORMATS
from bowdenfit.questions.figures import FIGURES

MU, ANGLE = 0.1, np.deg2rad(180.0)
DESCRIPTION = """name = "scratch"
[[contact]]
name = "sheath"
friction = "mu"
{law}
wrap_angle = {{ value = 180, unit = "deg" }}
[tables]
{table} = {{ file = "{table}.csv" }}
"""
ROUTED = """name = "scratch"
[route]
range = [400, 500]
[[contact]]
name = "sheath"
friction = "mu"
wrap_angle = { curve = "square", column = "sheath_angle" }
[tables]
angles = { file = "angles.csv" }
"""
QUICK = ("sampler.n_walkers=32", "sampler.target_ess=100", "sampler.max_steps=1000", "sampler.target_r_hat=1.2")


@pytest.fixture
def data_set(tmp_path):
    """Writes a data set of one table: its columns, and what its cable.toml says of the contact's law."""

    def write(table, heads, columns, says=""):
        (tmp_path / "cable.toml").write_text(DESCRIPTION.format(table=table, law=says))
        rows = [",".join(f"{cell}" for cell in row) for row in zip(*columns, strict=True)]
        (tmp_path / f"{table}.csv").write_text("\n".join([heads, *rows]) + "\n")
        return tmp_path

    return write


def pulled(exponent, hidden=0.0, n=12):
    """Input and output forces while pulling, one run a row, mountings scattering by a percent."""
    force = np.linspace(10.0, 80.0, n)
    scatter = 0.01 * np.random.default_rng(1).standard_normal(n)
    return force, (force + hidden) * np.exp(-exponent - scatter) - hidden


def forces(data_set, exponent, says="", hidden=0.0):
    """A table of such forces."""
    force, output = pulled(exponent, hidden)
    runs = [f"run {i}" for i in range(len(force))]
    return data_set("forces", "input_force_N,output_force_N,run", (force, output, runs), says)


@pytest.fixture
def install(tmp_path):
    """Install a package outside of the tree, and run Python with it: in a folder to import from, with its entry points."""
    place, folder = tmp_path / "packages", tmp_path / "elsewhere"
    folder.mkdir()

    def call(entry_points, *words, within=folder, path=place):
        metadata = place / "scratch-1.0.dist-info"
        if not place.exists():
            shutil.copytree(SCRATCH, place / "scratch")
            metadata.mkdir()
            (metadata / "METADATA").write_text("Metadata-Version: 2.1\nName: scratch\nVersion: 1.0\n")
        (metadata / "entry_points.txt").write_text(entry_points)
        environment = {name: value for name, value in os.environ.items() if name != "PYTHONSAFEPATH"}
        return subprocess.run(
            [sys.executable, *words], cwd=within, capture_output=True, text=True, check=False, timeout=500,
            env=environment | {"PYTHONPATH": str(path), "JAX_PLATFORMS": "cpu"},
        )  # fmt: skip

    return call


SCRATCH = ROOT / "tests" / "support" / "scratch"
ENTRY_POINTS = """[bowdenfit.verbs]
shares = scratch.shares:VERB
[bowdenfit.kinds]
losses = scratch.losses.kind:LossKind
"""
ASK = """import bowdenfit as bf
from bowdenfit.kinds import KINDS
print("shares" in dir(bf), "losses" in KINDS, hasattr(bf, "shares"))
"""


def test_a_package_outside_of_the_tree_adds_a_verb_and_a_kind_by_its_entry_points(install, data_set):
    done = install(ENTRY_POINTS, "-m", "bowdenfit", "--help")
    assert "shares" in done.stdout and done.stderr == ""
    done = install(ENTRY_POINTS, "-m", "bowdenfit", "shares", "--help")
    assert done.stdout.startswith("Usage: bowdenfit shares")
    assert install(ENTRY_POINTS, "-c", ASK).stdout == "True True True\n"
    folder = data_set("losses", "input_force_N,loss_N", (np.linspace(10.0, 80.0, 15), np.linspace(2.0, 20.0, 15)))
    assert "15 lost forces" in install(ENTRY_POINTS, "-m", "bowdenfit", "check", folder).stdout


def test_a_working_folder_supplies_no_entry_points(install, tmp_path):
    """Although `python -c`, and PYTHONPATH here, import from it."""
    place = tmp_path / "packages"
    for path in (place, "", "."):
        done = install(ENTRY_POINTS, "-c", f"import scratch\n{ASK}", within=place, path=path)
        assert done.stdout == "False False False\n", done.stderr


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("shares = scratch.nowhere:VERB", "'shares' of the package scratch cannot be used and is left out"),
        ("shares = scratch.law:Threshold", "'shares' of bowdenfit.verbs is left out"),
        ("fit = scratch.shares:VERB", "'fit' of bowdenfit.verbs is left out"),
    ],
)
def test_an_extension_that_cannot_be_used_is_named_in_one_sentence_and_the_rest_works(install, data_set, line, words):
    force = np.linspace(10.0, 80.0, 15)
    folder = data_set("forces", "input_force_N,output_force_N", (force, 0.8 * force))
    done = install(f"[bowdenfit.verbs]\n{line}\n", "-m", "bowdenfit", "check", folder)
    assert done.returncode == 0 and "15" in done.stdout
    assert len(done.stderr.splitlines()) == 1 and words in done.stderr


def test_a_kind_that_cannot_be_used_is_named_in_one_sentence(install, data_set):
    folder = data_set("losses", "input_force_N,loss_N", ([1.0], [0.1]))
    done = install("[bowdenfit.kinds]\nlosses = scratch.nowhere:LossKind\n", "-m", "bowdenfit", "check", folder)
    error, warning = done.stderr.splitlines()
    assert done.returncode == 2 and error.startswith("Error: ") and "losses" in error
    assert warning.startswith("Warning: 'losses' of the package scratch cannot be used")


def test_our_own_add_ons_that_are_not_registered_are_missed_in_one_sentence(install, tmp_path):
    """As in an environment of an older version, in which a newer one lies without having been installed."""
    older = tmp_path / "packages" / "bowdenfit-0.0.1.dist-info"
    older.mkdir(parents=True)
    (older / "METADATA").write_text("Metadata-Version: 2.1\nName: bowdenfit\nVersion: 0.0.1\n")
    (older / "entry_points.txt").write_text("[console_scripts]\nbowdenfit = bowdenfit.__main__:start\n")
    (tmp_path / "packages" / "scratch-1.0.dist-info").mkdir()
    done = install("", "-m", "bowdenfit", "--help")
    assert done.returncode == 0 and "fit " in done.stdout
    assert len(done.stderr.splitlines()) == 1 and "install it again" in done.stderr


@pytest.mark.extended
def test_a_new_kind_of_table_is_a_folder_and_an_entry_point(data_set, install, tmp_path):
    force = np.linspace(10.0, 80.0, 15)
    loss = force * -np.expm1(-MU * ANGLE) + 0.2 * np.random.default_rng(2).standard_normal(15)
    folder, settings = data_set("losses", "input_force_N,loss_N", (force, loss)), [f"--set={setting}" for setting in QUICK]
    done = install(ENTRY_POINTS, "-m", "bowdenfit", "fit", folder, "-o", tmp_path / "fit", "--seed=1", *settings)
    assert done.returncode in (0, 3), done.stderr
    summary = json.loads((tmp_path / "fit" / "summary.json").read_text())
    mu = summary["parameters"]["mu"]
    assert abs(mu["mean"] - MU) < 4 * mu["sd"]
    assert "15 lost forces" in (tmp_path / "fit" / "details.txt").read_text()
    assert {"checks.png", "coefficients.png", "pairs.png"} <= {
        path.name for path in (tmp_path / "fit" / "figures").iterdir()
    }
    again = install(ENTRY_POINTS, "-m", "bowdenfit", "summary", tmp_path / "fit", "--json")
    assert json.loads(again.stdout) == summary
    assert install(ENTRY_POINTS, "-m", "bowdenfit", "shares", tmp_path / "fit").stdout == "sheath: 100% of the loss\n"


def test_a_kind_that_is_not_registered_is_refused_by_name(data_set):
    with pytest.raises(bf.DescriptionError, match="losses"):
        bf.read(data_set("losses", "input_force_N,loss_N", ([1.0], [0.1])))


def test_a_new_contact_law_is_a_class_and_a_line(data_set, monkeypatch):
    monkeypatch.setitem(CONTACT_LAWS, "threshold", f"{law.__name__}:{law.Threshold.__name__}")
    fit = bf.fit(forces(data_set, MU * (ANGLE - 0.1), 'law = "threshold"'), mcmc=False)
    estimate = fit.least_squares.estimates["mu"]
    assert abs(estimate.value - MU) < 4 * estimate.standard_error


def test_a_new_curve_family_is_a_class_and_a_line(monkeypatch, tmp_path):
    monkeypatch.setitem(CURVES, "square", CurveFamily(f"{curve.__name__}:{curve.Square.__name__}", 1))
    length = np.linspace(400.0, 500.0, 11)
    angle = 120.0 * ((length - 400.0) / 100.0) ** 2 + np.random.default_rng(3).standard_normal(11)
    (tmp_path / "cable.toml").write_text(ROUTED)
    rows = [f"{value:g},{reading:.3f}" for value, reading in zip(length, np.abs(angle), strict=True)]
    (tmp_path / "angles.csv").write_text("\n".join(["cable_length_mm,sheath_angle_deg", *rows]))
    fit = bf.fit(tmp_path, mcmc=False)
    estimate = fit.least_squares.estimates["sheath_angle_end"]
    assert abs(estimate.value - np.deg2rad(120.0)) < 4 * estimate.standard_error


def test_a_new_option_of_the_friction_model_is_a_class_and_a_line(data_set, monkeypatch):
    monkeypatch.setitem(FRICTION_OPTIONS, "hidden", option.HiddenTension())
    fit = bf.fit(
        forces(data_set, MU * ANGLE, hidden=4.0), mcmc=False, friction="hidden", settings=["prior.tau.fixed=0.01"]
    )
    estimates = fit.least_squares.estimates
    assert abs(estimates["mu"].value - MU) < 4 * estimates["mu"].standard_error
    assert abs(estimates["hidden"].value - 4.0) < 4 * estimates["hidden"].standard_error


def test_a_new_file_format_is_a_module_and_a_line(monkeypatch, tmp_path):
    monkeypatch.setitem(FORMATS, ".bars", bars.__name__)
    source = ROOT / "datasets" / "synthetic-recordings" / "recordings" / "470mm_20rpm.csv"
    heads, *rows = source.read_text().splitlines()
    units = {"time_s": "time:s", "input_force_N": "input_force:N", "output_force_N": "output_force:N"}
    path = tmp_path / "pull.bars"
    indices = [i for i, head in enumerate(heads.split(",")) if head in units]
    lines = [[units[head] for head in heads.split(",") if head in units]]
    lines += [[row.split(",")[i] or "nan" for i in indices] for row in rows]
    path.write_text("\n".join("|".join(line) for line in lines))
    fit = partial(bf.fit, wrap_angle=(180.0, "deg"), mcmc=False)
    assert fit(path).least_squares.estimates["mu"].value == pytest.approx(
        fit(source).least_squares.estimates["mu"].value, rel=1e-9
    )


@pytest.mark.extended
def test_a_new_question_and_its_figure_are_a_file_and_a_line_each(data_set, monkeypatch, tmp_path, capsys):
    monkeypatch.setitem(FIGURES, "shares", sys.modules[shares.__name__])
    fit = bf.fit(forces(data_set, MU * ANGLE), output=tmp_path / "fit", seed=1, settings=QUICK)
    assert (tmp_path / "fit" / "figures" / "shares.png").exists()
    assert [share.contact for share in shares.shares(fit)] == ["sheath"]
    capsys.readouterr()
    assert command(shares.VERB)([str(tmp_path / "fit")]) == 0
    assert capsys.readouterr().out == "sheath: 100% of the loss\n"
    assert command(shares.VERB)([str(tmp_path / "fit"), "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == {"sheath": 1.0}
