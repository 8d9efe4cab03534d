"""The gate on figures: as a fit writes them and in a column of a paper, no figure may have a fault that people would see.

Fits of other files ask `assert_readable` too: on-body, haptic loop, recordings of a rope and of a loop with draws, the catheter
by least squares.
"""

import numpy as np
import pytest
from figure_words import LEAST, NARROW, assert_readable, faults
from matplotlib.figure import Figure

import bowdenfit as bf
from bowdenfit.cable.friction_options import FRICTION_OPTIONS
from bowdenfit.plots.layout import text_width
from bowdenfit.plots.panels import shorten_title
from bowdenfit.questions.figures import collect_figure_data, figure_caption

pytestmark = pytest.mark.extended

QUICK = ("sampler.n_walkers=64", "sampler.target_ess=200", "sampler.target_r_hat=1.1", "sampler.max_steps=2000")
LONG = "cotton yarn, waxed and run in for a week, batch {}"
HEAD = "run,group,wrap_angle_deg,stroke,input_force_N,output_force_N,velocity [mm/s]"
# friction model: name of the cable, bends [deg], mountings of each, loads over 100 N, strokes
TABLES = {
    "capstan": ("One newton, one bend, one mounting", (180.0,), 1, 0.01, (1,)),
    "drag": ("Ten kilonewtons", (45.0, 90.0, 180.0), 2, 100.0, (1, -1)),
    "load-dependent": ("Twenty mountings of a cable whose name is long".ljust(80, "."), (90.0,), 20, 1.0, (1,)),
    "rate-dependent": ("Rate", (90.0, 180.0), 3, 1.0, (1, -1)),
    "stroke-dependent": ("Nine bends, $ and _", tuple(np.linspace(20.0, 340.0, 9)), 1, 1.0, (1, -1)),
    "by-group": ("Groups", (180.0,), 6, 1.0, (1, -1)),
}  # fmt: skip


def table(folder, name, bends, mountings, scale, strokes):
    """A data set of forces, each mounting at its own speed, in three groups with long names."""
    generator, lines = np.random.default_rng(len(name)), [HEAD]
    for i, bend in enumerate(np.repeat(bends, mountings)):
        shift, group = 0.01 * generator.standard_normal(), LONG.format(i % 3)
        for stroke in strokes:
            for load in scale * np.array([20.0, 40.0, 60.0, 80.0]):
                output = load * np.exp(-stroke * (0.12 * np.deg2rad(bend) + shift)) * (1 + 0.002 * generator.standard_normal())
                lines.append(f'{i + 1},"{group}",{bend:.4g},{stroke:+d},{load:.6g},{output:.6g},{10.0 * 2 ** (i % 4):g}')
    (folder / "forces.csv").write_text("\n".join(lines) + "\n")
    (folder / "cable.toml").write_text(
        f'schema = 1\nname = "{name}"\n[[contact]]\nname = "sheath"\nfriction = "mu_sheath"\n'
        'wrap_angle = { column = "wrap_angle", nominal = { value = 180, unit = "deg" } }\n'
        '[tables]\nforces = { file = "forces.csv" }\n'
    )
    return folder


@pytest.mark.parametrize("mcmc", [False, pytest.param(True, marks=pytest.mark.slow)])
@pytest.mark.parametrize("friction", TABLES)
def test_figures_of_every_friction_model_can_be_read(friction, mcmc, tmp_path):
    fit = bf.fit(table(tmp_path, *TABLES[friction]), friction=friction, mcmc=mcmc, seed=1, settings=QUICK if mcmc else ())
    shown = dict(collect_figure_data(fit))
    assert {"forces", "residuals"} <= set(shown)
    assert all(" n = " in figure_caption(name, data) for name, data in shown.items())
    assert_readable(shown, fit.name)


def test_figures_of_the_synthetic_bench_can_be_read(least_squares_of):
    fit = least_squares_of("synthetic-bench")
    assert_readable(dict(collect_figure_data(fit)), fit.name)


def test_a_name_that_is_too_long_for_a_panel_begins_with_a_word():
    long = "upper sheath between the hip plate and the first clamp of the thigh cuff"
    shown = shorten_title(long, 1.9)
    assert shown == "\N{HORIZONTAL ELLIPSIS} and the first clamp of the thigh cuff" and text_width(shown) <= 1.9
    assert shorten_title("squeezed sheath", 1.9) == "squeezed sheath"
    cut = shorten_title("x" * 200, 1.9)
    assert cut.startswith("\N{HORIZONTAL ELLIPSIS}x") and text_width(cut) <= 1.9


def test_no_friction_model_is_left_out():
    assert set(TABLES) == {"capstan", *(name for name, option in FRICTION_OPTIONS.items() if not option.of_turns)}


def page(*texts, **more):
    """A page with a panel, a line in it, and some texts."""
    figure = Figure(figsize=(NARROW, 2.0))
    axes = figure.add_axes((0.2, 0.2, 0.7, 0.6))
    axes.plot([0, 1], [0, 1], label="Reading", **more)
    for place, words, style in texts:
        figure.text(*place, words, **style)
    return figure, axes


def test_a_good_page_has_no_fault():
    figure, axes = page(((0.5, 0.9), r"$\mu_1$ sheath, $\sigma_F$ (N)", {}))
    axes.legend()
    assert faults(figure) == []


@pytest.mark.parametrize(
    ("texts", "says"),
    [
        ([((0.9, 0.9), "beyond the edge of the page", {})], "leaves the page"),
        ([((0.4, 0.9), "one", {}), ((0.42, 0.9), "other", {})], "overlaps"),
        ([((0.4, 0.9), "small", {"fontsize": LEAST - 0.5})], "is 5.5 pt"),
        ([((0.4, 0.9), r"$\mu_\mathrm{sheath}$", {})], "letter by letter"),
        ([((0.4, 0.9), "mu_sheath", {})], "shows code"),
        ([((0.4, 0.9), r"\mu sheath", {})], "shows code"),
    ],
)
def test_words_with_a_fault_are_refused(texts, says):
    assert any(says in fault for fault in faults(page(*texts)[0]))


@pytest.mark.parametrize("case", ["nothing", "a line across", "values that are none", "areas across"])
def test_a_panel_without_data_is_refused(case):
    figure, axes = page()
    axes.lines[0].remove()
    if case == "a line across":
        axes.axhline(0.0)
    elif case == "values that are none":
        axes.plot([np.nan, np.nan], [0.0, 1.0])
    elif case == "areas across":
        axes.axvspan(0.2, 0.4)
    assert any("is empty" in fault for fault in faults(figure))


@pytest.mark.parametrize("kind", ["lines", "marks", "areas", "bars"])
def test_entries_of_a_legend_that_look_alike_are_refused(kind):
    figure, axes = page()
    for i in range(2):
        if kind == "areas":
            axes.axvspan(0.2 * i, 0.2 * i + 0.1, color="#E9E9E9", label=f"Area {i}")
        elif kind == "bars":
            axes.errorbar([0, 1], [1, i], 0.1, fmt="o", color="black", label=f"Bars {i}")
        else:
            axes.plot([0, 1], [1, i], "-" if kind == "lines" else "o", color="black", label=f"Line {i}")
    axes.legend()
    assert any("look alike" in fault for fault in faults(figure))


def test_another_marker_dash_or_color_tells_entries_apart():
    figure, axes = page(color="black")
    for look in ({"linestyle": "--"}, {"linestyle": (0, (1, 1))}, {"marker": "o"}, {"color": "red"}):
        axes.plot([0, 1], [1, 0], **{"color": "black", **look}, label=str(look))
    for marker in "sX":
        axes.errorbar([0, 1], [1, 0], 0.1, fmt=marker, color="black", label=marker)
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0))
    assert not any("look alike" in fault for fault in faults(figure))
