"""Stretches of a recording that its user leaves out are not looked at, whatever is in them, and are shown with their reason."""

import numpy as np
import pytest
from figure_words import assert_readable
from recorded_benches import RecordedBench, write

import bowdenfit as bf
from bowdenfit.errors import DatasetError, DescriptionError
from bowdenfit.plots.style import LEFT_OUT
from bowdenfit.questions.check.data_set_words import describe_data_set
from bowdenfit.questions.recorded import recordings_figure
from bowdenfit.questions.summary.brief import summary_text
from bowdenfit.recordings.recording import Recordings

BENCH = RecordedBench(rate=100.0, length=60.0, period=6.0, exponent=0.3, mountings=2)
SPOILED = (20.0, 26.0)  # s


@pytest.fixture
def folder(tmp_path):
    """A bench of two mountings; somebody leaned on the input cell of the first for six seconds."""
    made = write(BENCH, tmp_path / "bench", seed=4)
    path = made / "r0.csv"
    head, rows = path.read_text().split("\n", 1)[0], np.loadtxt(path, delimiter=",", skiprows=1)
    spoiled = (rows[:, 0] >= SPOILED[0]) & (rows[:, 0] <= SPOILED[1])
    rows[spoiled, 1] = 1e5 + 1e4 * np.sin(rows[spoiled, 0])
    np.savetxt(path, rows, "%.7g", ",", header=head, comments="")
    return made


def leave_out(folder, entries):
    """Write what is left out."""
    text = (folder / "cable.toml").read_text().replace("recordings = {}", f"recordings = {{ exclude = [{entries}] }}")
    (folder / "cable.toml").write_text(text)


GOOD = '{ file = "r0.csv", start = 19.9, end = 26.1, reason = "leaned on the cell" }'
SENTENCE = "1 stretch left out by the user: r0.csv, 19.9 to 26.1 s (leaned on the cell)."


def test_a_fit_is_as_good_as_if_the_stretch_had_never_been(folder, tmp_path):
    leave_out(folder, GOOD)
    text = " ".join(describe_data_set(bf.check(folder)).split())
    assert SENTENCE in text and " by the user" in text
    fit = bf.fit(folder, mcmc=False)
    clean = bf.fit(write(BENCH, tmp_path / "clean", seed=4), mcmc=False)
    value, expected = (each_fit.least_squares.estimates["mu"].value for each_fit in (fit, clean))
    assert value == pytest.approx(expected, rel=0.01) and value == pytest.approx(0.3 / np.pi, rel=0.05)
    assert SENTENCE in " ".join(summary_text(fit).split())
    recording = fit.dataset.measurements.table(Recordings).items[0]
    inside = (recording.blocks.time > SPOILED[0]) & (recording.blocks.time < SPOILED[1])
    counts = recording.account.counts
    assert not inside.any() and 621 <= counts["by the user"] <= 623 and counts["dropout"] == 0


def test_the_figures_show_the_stretch_gray(folder):
    leave_out(folder, GOOD)
    data = recordings_figure.data(bf.fit(folder, mcmc=False))
    shown = np.array(data[0].flagged_kind) == recordings_figure.BY_USER
    assert shown.sum() == 300 and data[0].flagged_input[shown].max() > 1e5 and np.isfinite(data[0].flagged_output[shown]).all()
    figure = recordings_figure.draw(data)
    assert_readable({"recordings": data}, "bench")
    assert LEFT_OUT in figure.axes[0].get_legend_handles_labels()[1]
    (chart, _) = recordings_figure.make_recordings_charts(data)
    assert [series.color for group in chart.groups for series in group.series if series.label == LEFT_OUT] == ["gray"]


def test_a_recording_that_is_left_out_is_not_read_but_kept_as_one_of_the_data(folder, tmp_path):
    (folder / "r0.csv").write_text("no recording")
    with pytest.raises(DatasetError, match="r0"):
        bf.read(folder)
    leave_out(folder, '{ file = "r0.csv", reason = "the clamp slipped" }')
    sentence = "1 recording left out by the user: r0.csv (the clamp slipped)."
    dataset = bf.read(folder)
    assert [item.file for item in dataset.measurements.table(Recordings).items] == ["r1.csv"]
    assert sentence in dataset.measurements.remarks and sentence in " ".join(describe_data_set(bf.check(folder)).split())
    assert {"r0.csv", "r1.csv"} <= {*dataset.sha256}, "else it would seem to be added after the fit"


@pytest.mark.parametrize(
    ("entry", "error", "words"),
    [
        ("{ start = 1, end = 2, reason = 'x' }", DescriptionError, "the table has 2 files; say of which one"),
        ("{ file = 'r7.csv', start = 1, end = 2, reason = 'x' }", DescriptionError, "has no file 'r7.csv'"),
        ("{ file = 'r0.csv', start = 70, end = 80, reason = 'x' }", DatasetError, "70 to 80 s, where there is no sample"),
        ("{ file = 'r0.csv', start = -1, end = 80, reason = 'x' }", DatasetError, "fewer than 20 readings"),
        ("{ file = 'r0.csv', start = 2, end = 1, reason = 'x' }", DescriptionError, "must start before it ends"),
        ("{ file = 'r0.csv', start = 1, end = 2 }", DescriptionError, "reason"),
        ("{ file = 'r0.csv', start = 1, reason = 'x' }", DescriptionError, "needs start and end"),
        ("{ file = 'r0.csv', reason = 'x' }, { file = 'r1.csv', reason = 'x' }", DatasetError, "leaves out every recording"),
        ("{ file = 'r0.csv', rows = [7], reason = 'x' }", DescriptionError, "rows"),
    ],
)
def test_a_stretch_that_cannot_be_is_refused(folder, entry, error, words):
    leave_out(folder, entry)
    with pytest.raises(error, match=words):
        bf.read(folder)
