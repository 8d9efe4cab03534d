"""The figure of a metabolic study: readable with few and many conditions, and drawn from the printed numbers."""

import json
from pathlib import Path

import numpy as np
import pytest
from figure_words import assert_answer_readable, words
from matplotlib.container import BarContainer

import bowdenfit as bf
from bowdenfit.addons.metabolic import metabolic_figure
from bowdenfit.addons.metabolic.answer import analyze_study
from bowdenfit.addons.metabolic.study import MetabolicCosts, Study
from bowdenfit.questions.figure_files import draw_answer_figure

PRINTED = Path(__file__).parents[3] / "datasets" / "on-body-metabolic"


def test_it_shows_the_means_errors_and_p_of_the_paper():
    answer = bf.metabolic(PRINTED)
    assert [(cost.name, cost.mean, cost.error) for cost in answer.costs] == [
        ("no exoskeleton", 6.3, 0.148), ("550 mm", 5.91, 0.116), ("470 mm", 5.78, 0.108)
    ]  # fmt: skip
    figure = draw_answer_figure(metabolic_figure, answer, answer.name)
    costs, differences = figure.axes
    (bars,) = (container for container in costs.containers if isinstance(container, BarContainer))
    assert [bar.get_height() for bar in bars] == [6.3, 5.91, 5.78]
    brackets = [text for text, _ in words(figure) if text.startswith("p = ")]
    assert brackets == ["p = 0.022 *", "p = 0.22", "p = 0.0048 *"]
    points = [container.lines[0].get_xdata()[0] for container in differences.containers]
    assert points == pytest.approx([5.78 - 5.91, 5.78 - 6.3, 5.91 - 6.3])


@pytest.mark.parametrize("conditions", [2, 3, 4, 7])
def test_it_can_be_read(conditions):
    generator = np.random.default_rng(conditions)
    names = tuple(f"assisted with profile {i}" for i in range(conditions))
    net = generator.normal(5, 0.4, (8, 1)) + generator.normal(0, 0.2, (8, conditions))
    costs = MetabolicCosts(tuple(map(str, range(8))), names, net)
    answer = analyze_study(Study(schema=1, name="Profiles"), costs)
    assert [cost.mean for cost in answer.costs] == pytest.approx(net.mean(axis=0))
    assert_answer_readable(metabolic_figure, answer, answer.name)


def test_the_printed_study_can_be_read_and_is_written(tmp_path, run):
    assert_answer_readable(metabolic_figure, bf.metabolic(PRINTED), "Study")
    code, _, err = run("metabolic", PRINTED, "-o", tmp_path / "study")
    assert code == 0
    assert "metabolic.png" in err
    assert json.loads((tmp_path / "study" / "metabolic.json").read_text())["costs"][0]["mean"] == 6.3
    assert (tmp_path / "study" / "metabolic.svg").exists()
