"""Which contact takes how much of the loss."""

import numpy as np
import pytest

import bowdenfit as bf
from bowdenfit.inference.interval import Interval
from bowdenfit.questions.error_budget import with_bench_errors
from bowdenfit.questions.loss import ContactShare, LossByContact, loss_by_contact, loss_text

QUICK = ("sampler.n_walkers=64", "sampler.target_ess=100", "sampler.target_r_hat=1.1", "sampler.max_steps=1000")


@pytest.fixture(scope="module")
def fit(quick_fit):
    """A quick fit of the on-body data."""
    return quick_fit


def test_shares_are_coefficient_times_angle_over_their_sum_draw_by_draw(fit):
    losses = loss_by_contact(fit)
    fit = with_bench_errors(fit)
    best_length = float(np.median(fit.posterior.optimum["optimal_length"]))
    grid, curves = fit.along_route.grid, fit.along_route.curves

    def angle(column):
        return np.deg2rad(np.array([np.interp(best_length, grid, row) for row in curves[column]]))

    draws = {name: fit.posterior.values[name].ravel() for name in ("mu1", "mu2", "mu3")}
    lost = {
        "free sheath": draws["mu1"] * angle("free_sheath_angle"),
        "squeezed sheath": draws["mu2"] * angle("squeezed_sheath_angle"),
        "bracket edge": draws["mu3"] * np.pi / 4,
    }
    total = sum(lost.values())
    for contact in losses.contacts:
        share = lost[contact.contact] / total
        assert contact.share.median == pytest.approx(np.median(share), abs=1e-4)  # the grid is interpolated here
        assert contact.share.q05 == pytest.approx(np.quantile(share, 0.05), abs=1e-4)
    assert [c.contact for c in losses.contacts] == ["bracket edge", "squeezed sheath", "free sheath"]
    assert sum(c.share.mean for c in losses.contacts) == pytest.approx(1)
    assert sum(c.probability_largest for c in losses.contacts) == pytest.approx(1)


def test_the_answer_says_where_to_work_on_the_cable(fit):
    assert "of the loss occurs at 'bracket edge'" in str(fit.summary()["loss"]["in_words"])
    assert loss_text(fit).startswith("Where the force is lost, at 4")


@pytest.mark.extended
def test_one_contact_has_no_shares(tmp_path):
    table = tmp_path / "bench.csv"
    table.write_text("wrap_angle_deg,input_force_N,output_force_N\n90,50,43\n180,50,36.5\n270,50,31.1\n90,80,68.7\n")
    fit = bf.fit(table, seed=1, settings=QUICK)
    assert loss_by_contact(fit) is None
    assert loss_text(fit) == ""
    assert "loss" not in fit.summary()


def test_a_sentence_names_four_contacts_and_leaves_none_of_the_loss_out():
    share = Interval(0.2, 0.01, 0.2, 0.18, 0.22)
    four, six = (
        LossByContact("", tuple(ContactShare(f"contact {i}", share, 0.2) for i in range(n))).sentence() for n in (4, 6)
    )
    assert four.endswith("20 % at 'contact 1', 20 % at 'contact 2' and 20 % at 'contact 3'.")
    assert six.endswith("20 % at 'contact 3' and the rest at 2 others.")
