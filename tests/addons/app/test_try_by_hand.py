"""Coefficients tried by hand are asked of the model of the fit itself, and can be held."""

import shutil
from pathlib import Path

import jax
import numpy as np
import pytest
from app_in_browser import faults_of, served, visiting

import bowdenfit as bf
from bowdenfit.addons.app.trial import TrialModel

DATASETS = Path(__file__).parents[3] / "datasets"
YARN = DATASETS / "yarn-on-cylinder"


def test_the_misfit_and_the_curve_are_those_of_the_model():
    tried = TrialModel(YARN)
    trial = tried.ask({slider.name: slider.start + 0.2 for slider in tried.sliders})
    with jax.enable_x64(True):
        model = bf.model(YARN)
        values = model.constrain(np.full(2, 0.2))
        assert trial.values == pytest.approx({name: float(value) for name, value in values.items()})
        assert trial.log_likelihood == pytest.approx(float(model.log_likelihood(values)))
        assert trial.squares == pytest.approx(float(np.sum(model.residuals(values) ** 2)))
        expected = np.asarray(model.expected(values)["run_efficiency"])
    (chart,) = tried.draw(trial)
    by_model = [y for group in chart.groups for series in group.series if series.color == "vermillion" for y in series.values]
    assert set(np.round(by_model, 6)) == set(np.round(100 * expected, 6))  # a line through each wrap angle once
    held = bf.read(YARN, settings=[tried.hold("mu", 0.1234)])
    assert held.description.friction["mu"].fixed == 0.1234


@pytest.mark.extended
def test_a_slider_moves_the_misfit_and_the_likelihood_is_drawn(chromium, tmp_path, quick_results):
    shutil.copytree(quick_results, tmp_path / "fits" / "on-body")
    shutil.copytree(DATASETS / "on-body-exoskeleton", tmp_path / "on-body")
    with served(tmp_path) as app, visiting(chromium, app, width=390, color_scheme="dark") as visit:
        page = visit.page
        page.goto(f"{visit.root}/fit/on-body")
        page.get_by_role("link", name="Try by hand").click()
        page.locator("#misfit span").wait_for()
        began, command = page.inner_text("#misfit"), page.text_content("#held-command")
        for _ in range(20):
            page.get_by_label("mu1", exact=True).press("ArrowRight")
        page.wait_for_function("began => document.querySelector('#misfit').innerText !== began", arg=began)
        page.wait_for_function("began => document.querySelector('#held-command').textContent !== began", arg=command)
        assert "--set friction.mu1.fixed=0." in page.text_content("#held-command")
        page.get_by_role("button", name="Draw the profile").click()
        page.get_by_text("The likelihood of mu1 is highest").wait_for()
        page.get_by_label("Second parameter").select_option("mu3")
        page.get_by_role("button", name="Draw contours of both").click()
        page.get_by_text("The likelihood is highest near mu1").wait_for()
        page.locator("#likelihood-charts .uplot").wait_for()
        assert faults_of(page) == []
