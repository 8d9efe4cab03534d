"""What a fit says to people: the printed summary, the notebook page, and the verdicts."""

import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from terminal_pages import faults

import bowdenfit as bf
from bowdenfit.inference.interval import Interval
from bowdenfit.plots.style import rounded_texts
from bowdenfit.questions.error_budget import with_bench_errors
from bowdenfit.questions.summary import brief
from bowdenfit.questions.summary.brief import KeyQuantity, summary_text
from bowdenfit.questions.summary.details import details_text
from bowdenfit.questions.summary.verdict import CONTRADICTORY, Verdict

GOLDEN = Path(__file__).parent / "golden"
QUICK = ("sampler.n_walkers=64", "sampler.target_ess=200", "sampler.target_r_hat=1.05", "sampler.max_steps=3000")


@pytest.fixture(scope="module")
def fit(quick_fit):
    """A quick fit of the on-body data."""
    return quick_fit


def masked(text: str) -> str:
    """Every number as one #, runs of blanks as one, versions left out: what a golden file can hold on any machine."""
    text = re.sub(r"Seed .*", "Seed", text, flags=re.S)
    text = re.sub(r"Influential reading.*?if\s+in\s+doubt\.", "Influential: ...", text, flags=re.S)  # the last ones vary
    text = re.sub(r"in doubt,.*?further\s+measurements\.", "in doubt, ...", text, flags=re.S)
    # Which prior leads, and which follow, varies with quick draws too.
    first, remaining = r"(Interval widths depend on the prior of)", r"(Interval\s+widths\s+also\s+depend\s+on)"
    text = re.sub(rf"{first} \w+[ ,:].*?{remaining}\s+the\s+priors?\s+of\s.*?\.", r"\1 ... \2 ...", text, flags=re.S)
    # Whether a bell's part has a width, and what its departure means, varies with quick draws too.
    text = re.sub(r"(_angle_[ABC]) .*", r"\1 ...", text)
    text = re.sub(r"root\s+mean\s+square;.*?\.", "root mean square; ...", text, flags=re.S)
    text = re.sub(r"[-+]?\d+(\.\d+)?(e[-+]?\d+)?|\binf\b(?=  )", "#", text)
    return re.sub(r"-{3,}", "---", re.sub(r"[ ]{2,}", "  ", text)).strip() + "\n"


@pytest.mark.parametrize(("text", "file"), [(summary_text, "summary"), (details_text, "details")], ids=["short", "full"])
def test_the_printed_summary_is_that_of_the_golden_file(fit, text, file):
    assert masked(text(fit)) == (GOLDEN / f"on_body_{file}.txt").read_text()


def test_the_summary_is_one_page_that_an_engineer_reads_in_a_terminal(fit):
    page = summary_text(fit)
    assert faults(page) == []
    assert page.startswith("On-body knee exoskeleton: cut the cable to 470 mm.\n")
    assert "You can trust this" in page


@pytest.mark.parametrize("n", [1, 4])
def test_what_a_coefficient_is_comes_before_that_no_reading_is_an_outlier(fit, monkeypatch, n):
    """Both where there is room; that all readings agree is said above already."""
    words = "what this coefficient of the cable is, in more words than one line has"
    many = [KeyQuantity(f"q{i}", f"{words} {i}", "N", "1.00", "0.50 to 1.50") for i in range(n)]
    monkeypatch.setattr(brief, "key_quantities", lambda _: many)
    page = summary_text(fit)
    assert faults(page) == []
    assert re.findall(r"line\s+has\s+(\d)", page) == [str(i) for i in range(n)]
    assert ("None of the 26 readings is an outlier." in page) == (n == 1)


def test_nothing_is_below_zero_by_rounding_alone():
    assert str(Interval(0.7, 0.4, 0.7, -0.04, 1.4)) == "0.7 (90 % interval 0.0 to 1.4)"
    assert rounded_texts((-0.04, 0.7, -1.4), 1.4) == ["0.0", "0.7", "\N{MINUS SIGN}1.4"]


def test_a_page_that_nobody_reads_is_found_out(fit):
    page_faults = faults(details_text(fit))
    for fault in ("wider than 80", "lines", "no answer", "walkers", "LogNormal(", "condition number"):
        assert any(fault.lower() in item.lower() for item in page_faults), fault


def test_least_squares_alone_say_so_on_one_page(least_squares_of):
    for name in ("on-body-exoskeleton", "synthetic-bench"):
        page = summary_text(least_squares_of(name))
        assert faults(page) == []
        assert "least squares alone" in page


def test_a_length_that_is_not_settled_is_not_said_to_be_cut_to(fit):
    best = fit.optimal_length()
    unsure = replace(best, window=replace(best.window, start=float("nan"), stop=float("nan")))
    assert str(unsure).startswith("Measure more before you cut; the best guess is 470 mm.\n")
    assert "more measurements are needed" in " ".join(str(unsure).split())
    assert str(best).startswith("Cut the cable to 470 mm.\n")
    angle = replace(best, variable="knee_angle", unit="deg")
    assert str(angle).startswith("The best knee angle is 470 deg.\n")


def test_the_page_of_a_fit_that_has_not_converged_begins_with_that(fit):
    page = summary_text(replace(fit, converged=False, reasons=("R-hat of mu1 is 1.2 and should be below 1.01",)))
    assert faults(page) == []
    assert "DO NOT USE THESE NUMBERS: the fit has not" in page.splitlines()[0]
    assert "--resume" in page


def test_the_page_of_a_name_and_reasons_without_end_is_still_a_page(fit, monkeypatch):
    description = fit.dataset.description.model_copy(update={"name": "long " * 60})
    long = replace(fit, dataset=replace(fit.dataset, description=description))
    refused = Verdict({CONTRADICTORY: tuple(f"Reason {i}: {'word ' * 60}" for i in range(9))})
    for module in ("brief", "verdict"):
        monkeypatch.setattr(f"bowdenfit.questions.summary.{module}.assess_fit", lambda _: refused, raising=False)
    page = summary_text(long)
    assert faults(page) == []
    assert "the measurements contradict each other" in " ".join(page.splitlines()[:3])
    assert "Reason 0: word" in page
    assert re.search(r"^\[\d sentences more: bowdenfit summary --full\]\nWhat they would say: cut", page, re.MULTILINE)


def test_no_line_of_the_full_summary_is_too_wide_for_a_terminal_of_130(fit):
    assert max(map(len, details_text(fit).splitlines())) <= 130


def test_every_measured_efficiency_stands_beside_its_prediction(fit):
    rows = fit.summary()["measured"]
    assert [row["label"] for row in rows] == ["440 mm", "470 mm", "510 mm", "550 mm"]
    for row in rows:
        assert row["q05"] < row["predicted"] < row["q95"]
        assert row["predictive_q05"] < row["q05"]
        assert row["relative_error"] == pytest.approx(row["measured"] / row["predicted"] - 1)


def test_the_summary_has_every_key_of_the_format(fit):
    page = fit.summary()
    assert {"schema", "name", "verdict", "parameters", "optimal", "seed", "versions"} <= set(page)
    keys = {
        "unit",
        "prior",
        "least_squares",
        "mean",
        "sd",
        "median",
        "q05",
        "q95",
        "ess_bulk",
        "ess_tail",
        "r_hat",
        "mcse_mean",
    }
    assert keys <= set(page["parameters"]["mu1"])
    assert {"value", "standard_error", "identified"} <= set(page["parameters"]["mu1"]["least_squares"])
    assert {"mean", "sd", "median", "q05", "q95", "at_edge"} <= set(page["optimal"]["length"])
    assert {"within", "probability", "from", "to"} <= set(page["optimal"]["window"])
    assert {"length", "probability_best", "expected_regret"} <= set(page["optimal"]["choices"][0])


def test_the_summary_agrees_with_the_draws(fit):
    row, draws = fit.summary()["parameters"]["mu2"], with_bench_errors(fit).posterior.values["mu2"]
    assert row["mean"] == pytest.approx(draws.mean())
    assert row["q95"] == pytest.approx(np.quantile(draws, 0.95))


def test_what_is_not_identified_has_no_number(fit):
    estimate = fit.summary()["parameters"]["squeezed_sheath_angle_c"]["least_squares"]
    assert not estimate["identified"]
    assert estimate["value"] is None
    assert estimate["standard_error"] is None


class Tags(HTMLParser):
    """Checks that tags are closed in order."""

    def __init__(self):
        super().__init__()
        self.open, self.seen = [], []

    def handle_starttag(self, tag, attrs):
        self.open.append(tag)
        self.seen.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


def test_a_fit_shows_itself_in_a_notebook(fit):
    for shown in (fit, fit.optimal_length()):
        page = Tags()
        page.feed(shown._repr_html_())
        assert page.open == []
        assert "table" in page.seen
    assert fit._repr_html_().startswith("<p><b>On-body knee exoskeleton: cut the cable to 470 mm.</b></p>")
    assert "You can trust this" in repr(fit)


@pytest.mark.extended
def test_a_coefficient_that_no_measurement_informs_is_said_to_rest_on_its_prior(tmp_path, on_body):
    for path in on_body.iterdir():
        (tmp_path / path.name).write_text(path.read_text())
    text = (tmp_path / "cable.toml").read_text().replace('efficiencies = { file = "efficiencies.csv" }', "")
    (tmp_path / "cable.toml").write_text(text)
    page = details_text(bf.fit(tmp_path, seed=1, settings=QUICK))
    assert "mu1, mu2 and mu3 rest on the prior almost alone" in " ".join(page.split())
    assert "the measurements do not determine it" in page


def test_interval_of_one_parameter_by_name(fit):
    interval = fit.parameter("sigma_theta")
    assert 1.0 < interval.median < 4.0
    with pytest.raises(bf.UsageError, match="there is no parameter"):
        fit.parameter("mu9")


@pytest.mark.extended
def test_without_a_route_there_is_no_length_to_choose(tmp_path):
    table = tmp_path / "forces.csv"
    force = np.tile(np.arange(20.0, 60.0, 5.0), 3)
    noise = np.random.default_rng(1).normal(0, 0.2, (2, len(force)))
    rows = [f"{i // 8},{f + a:.3f},{0.7 * f + b:.3f}" for i, (f, a, b) in enumerate(zip(force, *noise, strict=True))]
    table.write_text("run,input_force_N,output_force_N\n" + "\n".join(rows) + "\n")
    fit = bf.fit(table, wrap_angle=(180.0, "deg"), seed=1)
    assert fit.converged
    assert fit.parameter("mu").q05 < -np.log(0.7) / np.pi < fit.parameter("mu").q95
    assert "Best" not in details_text(fit)
    with pytest.raises(bf.UsageError, match="no \\[route\\]"):
        fit.optimal_length()


def test_the_page_for_programs_has_the_monte_carlo_error_of_each_end(fit):
    errors = fit.summary()["sampler"]["monte_carlo_errors"]
    length = errors["optimal_length"]
    spread = fit.draws().optimum["optimal_length"]
    independent = np.std([np.quantile(part, 0.05) for part in np.array_split(spread, 8)]) / np.sqrt(8)
    assert 0.3 * independent < length["q05"] < 3 * independent
    assert all(0 <= error < 0.2 * np.ptp(np.quantile(spread, (0.05, 0.95))) for error in length.values())
    assert set(fit.draws().values) <= set(errors)
