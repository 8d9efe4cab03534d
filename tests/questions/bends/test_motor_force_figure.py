"""The figure of force against displacement shows the fitted loop through its readings, each stroke from the end of the last."""

import jax
import matplotlib.pyplot as plt
import numpy as np
import pytest
from figure_words import assert_readable

from bowdenfit.questions.bends.motor_force_figure import data, draw


@pytest.fixture(scope="module")
def shown(least_squares_of):
    """What the figure of the synthetic catheter shows, by least squares."""
    with jax.enable_x64(True):
        return data(least_squares_of("synthetic-catheter"))


@pytest.mark.extended
def test_the_loop_of_every_run_goes_through_its_readings(shown):
    assert [run.label for run in shown] == ["180 deg", "360 deg", "540 deg"]
    for run in shown:
        for way in (1, -1):
            mask = (run.points_stroke == way) & run.points_used
            displacement, force = run.displacement[run.stroke == way], run.force[0][run.stroke == way]
            nearest = np.abs(displacement[:, None] - run.points_displacement[mask]).argmin(axis=0)
            assert np.median(np.abs(force[nearest] - run.points_force[mask])) < 0.1


def test_it_is_drawn_with_a_panel_a_run_and_unused_readings_open(shown):
    figure = draw(shown)
    assert [axes.get_title() for axes in figure.axes[::2]] == ["180 deg", "360 deg", "540 deg"]
    assert "Not used" in {line.get_label() for line in figure.axes[0].lines}
    plt.close(figure)
    assert_readable({"motor_force": shown}, "Synthetic catheter")


def test_residuals_are_forces_less_those_of_the_loop_at_each_reading(shown):
    for run, strip in zip(shown, draw(shown).axes[1::2], strict=True):
        off = run.points_force - run.points_fitted
        assert np.median(np.abs(off)) < 0.1
        heights = np.concatenate([line.get_ydata() for line in strip.lines if line.get_transform() == strip.transData])
        np.testing.assert_allclose(np.sort(heights), np.sort(off))


def test_other_fits_have_no_such_figure(on_body_squares):
    with jax.enable_x64(True):
        assert data(on_body_squares) is None
