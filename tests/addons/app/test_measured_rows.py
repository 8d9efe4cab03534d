"""Rows are drawn before any fit: those that are read, those that the user leaves out, and those that are refused."""

import shutil
import tomllib
from pathlib import Path

import numpy as np
import pytest
from half_turn_bench import describe_half_turn
from recorded_benches import RecordedBench, write

import bowdenfit as bf
from bowdenfit.addons.app.angle_charts import fit_curves
from bowdenfit.addons.app.data_charts import make_pictures
from bowdenfit.addons.app.description_edit import exclude_part, include_part, write_description
from bowdenfit.addons.app.draft import list_refusals
from bowdenfit.addons.app.measured_rows import LEFT_OUT, READ, REFUSED, collect_rows
from bowdenfit.addons.app.points import parse_sample_key, row_key
from bowdenfit.addons.app.refused_recordings import sketch_refused
from bowdenfit.errors import BowdenfitError, UsageError
from bowdenfit.kinds.forces.table import ForceTable
from bowdenfit.recordings.recording import Recordings

DATASETS = Path(__file__).parents[3] / "datasets"
ROWS = ["20,15.2,1", "40,30.1,1", "60,45.6,1", "20,15.0,2", "40,30.9,2", "60,46.0,2"]


@pytest.fixture
def bench(tmp_path):
    """A bench with six readings, and comments in its description."""
    (tmp_path / "cable.toml").write_text(f"# ours\n{describe_half_turn()}\n# the end\n")
    write_rows(tmp_path, ROWS)
    return tmp_path


def write_rows(folder, rows):
    """Write the table of a bench."""
    (folder / "forces.csv").write_text("\n".join(["input_force_N,output_force_N,run", *rows, ""]))


def points_of(pictures, label):
    """Places and keys of the points with a label on the first chart."""
    series = [(group, series) for group in pictures[0].charts[0].groups for series in group.series if series.label == label]
    places = [zip(group.x, part.values, part.keys, strict=True) for group, part in series]
    return sorted((float(x), float(y), key) for some in places for x, y, key in some)


def test_a_row_that_is_refused_counts_once_though_it_is_several_points(tmp_path):
    folder = shutil.copytree(DATASETS / "on-body-exoskeleton", tmp_path / "on-body")
    text = (folder / "angles.csv").read_text().replace("450,30,11", "450,-30,11")
    (folder / "angles.csv").write_text(text)
    with pytest.raises(BowdenfitError) as refusal:
        bf.check(folder)
    pictures = make_pictures(collect_rows(folder, list_refusals(refusal.value)))
    assert len(points_of(pictures, "Refused")) == 2 and "Red, refused: 1." in pictures[0].chart_caption


def test_every_reading_is_a_point_that_is_called_as_its_row(bench):
    measured = collect_rows(bench)
    table = bf.read(bench).measurements.table(ForceTable)
    expected = zip(table.input_force, table.output_force, table.origin.row, strict=True)
    keys = sorted((float(x), float(y), row_key("forces.csv", row)) for x, y, row in expected)
    assert points_of(make_pictures(measured), "Pulling") == keys
    assert [row.row for row in measured.files[0].rows] == [2, 3, 4, 5, 6, 7]


def test_a_row_is_left_out_with_its_reason_and_taken_in_again(bench):
    original = (bench / "cable.toml").read_text()
    exclude_part(bench, "forces", "forces.csv", 3, "the  rope\njumped")
    exclude_part(bench, "forces", "forces.csv", 6, "the rope jumped")
    exclude_part(bench, "forces", "forces.csv", 4, "typed twice")
    text = (bench / "cable.toml").read_text()
    entries = tomllib.loads(text)["tables"]["forces"]["exclude"]
    assert entries == [{"rows": [3, 6], "reason": "the rope jumped"}, {"rows": [4], "reason": "typed twice"}]
    assert text.startswith("# ours\n") and text.endswith("# the end\n")
    measured = collect_rows(bench)
    assert [row.state for row in measured.files[0].rows] == [READ, LEFT_OUT, LEFT_OUT, READ, LEFT_OUT, READ]
    gray = points_of(make_pictures(measured), "Left out by you")
    assert gray == [(40.0, 30.1, "3 forces.csv"), (40.0, 30.9, "6 forces.csv"), (60.0, 45.6, "4 forces.csv")]
    assert "3 readings left out by the user" in str(bf.check(bench))
    for row in (3, 6, 4):
        include_part(bench, "forces", "forces.csv", row)
    assert (bench / "cable.toml").read_text() == original


def test_refused_rows_are_red_and_the_others_are_drawn_all_the_same(bench):
    write_rows(bench, [*ROWS[:2], "60,many,1", *ROWS[3:5], "60,-46.0,2"])
    with pytest.raises(BowdenfitError) as refusal:
        bf.check(bench)
    measured = collect_rows(bench, list_refusals(refusal.value))
    assert [row.state for row in measured.files[0].rows] == [READ, READ, REFUSED, READ, READ, REFUSED]
    assert "'many' is not a number" in measured.files[0].rows[2].why
    pictures = make_pictures(measured)
    assert len(points_of(pictures, "Pulling")) == 4
    assert points_of(pictures, "Refused") == [(60.0, -46.0, "7 forces.csv")]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda folder: exclude_part(folder, "forces", "forces.csv", 3, " "), "write why row 3 is left out"),
        (lambda folder: exclude_part(folder, "angles", "forces.csv", 3, "x"), "has no table angles"),
        (lambda folder: write_description(folder, "name = "), "this is no TOML"),
        (lambda folder: write_description(folder, 'name = "x"\n'), "contact"),
    ],
)
def test_what_cannot_be_described_leaves_the_description_as_it_was(bench, change, words):
    original = (bench / "cable.toml").read_bytes()
    with pytest.raises(BowdenfitError, match=words):
        change(bench)
    assert (bench / "cable.toml").read_bytes() == original


def test_a_description_that_is_a_link_is_not_written_through(bench, tmp_path_factory):
    other = tmp_path_factory.mktemp("other") / "cable.toml"
    shutil.move(bench / "cable.toml", other)
    (bench / "cable.toml").symlink_to(other)
    with pytest.raises(BowdenfitError, match="link"):
        exclude_part(bench, "forces", "forces.csv", 3, "x")
    assert "exclude" not in other.read_text()


def test_the_curves_that_would_be_fitted_follow_the_angles():
    dataset = bf.read(DATASETS / "on-body-exoskeleton")
    (group,) = fit_curves(dataset)
    assert [series.label for series in group.series] == [
        "free sheath angle, gaussian curve, least squares", "squeezed sheath angle, gaussian curve, least squares",
    ]  # fmt: skip
    angles = {(470, 0): 19.0, (520, 0): 91.0, (440, 1): 45.0}  # of the paper's table, deg
    for (length, column), angle in angles.items():
        assert np.interp(length, group.x, group.series[column].values) == pytest.approx(angle, abs=3)


def test_rows_that_are_left_out_are_drawn_in_every_table_of_a_loop(tmp_path):
    folder = shutil.copytree(DATASETS / "synthetic-haptic-loop", tmp_path / "loop")
    kinds = [file.kind for file in collect_rows(folder).files]
    for kind in kinds:
        exclude_part(folder, kind, f"{kind}.csv", 4, "the rope jumped")
    for picture in make_pictures(collect_rows(folder)):
        assert [key for _, _, key in points_of([picture], "Left out by you")] == [f"4 {picture.name[5:]}.csv"]
    assert {"stretch", "preload", "loop"} <= {*kinds}


@pytest.mark.parametrize(
    "name", ["synthetic-recordings", "synthetic-haptic-loop", "synthetic-bench", "yarn-on-cylinder", "synthetic-catheter"]
)
def test_every_kind_of_table_has_charts(name):
    pictures = make_pictures(collect_rows(DATASETS / name))
    assert pictures and all(picture.charts for picture in pictures)
    for chart in (chart for picture in pictures for chart in picture.charts):
        assert "(" in chart.x_label and "(" in chart.y_label  # with units
        assert all(np.all(np.diff(group.x) > 0) for group in chart.groups if len(group.x) and group.series[0].look == "points")


def test_a_ring_down_is_drawn_over_the_time_from_its_release(tmp_path):
    time = np.arange(0, 0.25, 1e-3)
    noise = 1e-3 * np.random.default_rng(1).normal(size=len(time))
    angle = 0.5 + 0.2 * np.exp(-8 * time) * np.cos(2 * np.pi * 22 * time) + noise
    rows = [f"{t:.4f},{x:.6f}" for t, x in zip(time + 3, angle, strict=True)]
    (tmp_path / "ringdown.csv").write_text("\n".join(["time_s,angle_rad", *rows, ""]))
    table = 'ringdown = { file = "ringdown.csv", inertia = { value = 1e-3, unit = "kg*m^2" } }'
    (tmp_path / "cable.toml").write_text(f"{describe_half_turn()}{table}\n")
    write_rows(tmp_path, ROWS)
    (chart,) = next(picture for picture in make_pictures(collect_rows(tmp_path)) if picture.name == "data-ringdown").charts
    (group,) = chart.groups
    assert chart.y_label == "Angle (deg)" and group.x[0] == 0 and group.x[-1] == pytest.approx(0.249)
    assert group.series[0].values == pytest.approx(np.rad2deg(angle), abs=1e-3)
    assert group.series[0].keys[0] == row_key("ringdown.csv", 2)
    exclude_part(tmp_path, "ringdown", "ringdown.csv", 12, "bumped")
    (place,) = points_of([p for p in make_pictures(collect_rows(tmp_path)) if p.name == "data-ringdown"], "Left out by you")
    assert place == (pytest.approx(0.010), pytest.approx(np.rad2deg(angle[10]), abs=1e-3), "12 ringdown.csv")


def test_stretches_and_whole_recordings_are_left_out_by_the_clock_of_the_recording(tmp_path):
    folder = write(RecordedBench(rate=100.0, length=60.0, mountings=2), tmp_path / "bench", seed=4)
    text, rows = (folder / "cable.toml").read_text(), (folder / "r1.csv").read_text().splitlines()
    late = [f"{float(row.split(',')[0]) + 500:.2f},{row.split(',', 1)[1]}" for row in rows[1:]]
    (folder / "r1.csv").write_text("\n".join([rows[0], *late, ""]))
    measured = collect_rows(folder)
    (picture,) = make_pictures(measured)
    number, time = parse_sample_key(picture.charts[1].groups[0].series[0].keys[0])
    assert measured.find_recorded(number).file == "r1.csv" and time == pytest.approx(500, abs=0.5)
    assert "leave a stretch out" in picture.chart_caption
    for part in ((520.0, 526.5), (540.0, 541.0)):
        exclude_part(folder, "recordings", "r1.csv", part, "leaned on it")
    exclude_part(folder, "recordings", "r0.csv", None, "the clamp slipped")
    excluded = {file.file: file.excluded for file in collect_rows(folder).recorded}
    assert excluded["r1.csv"] == (((520.0, 526.5), "leaned on it"), ((540.0, 541.0), "leaned on it"))
    assert excluded["r0.csv"] == ((None, "the clamp slipped"),)
    assert [item.file for item in bf.read(folder).measurements.table(Recordings).items] == ["r1.csv"]
    for file, part in (("r1.csv", (520.0, 526.5)), ("r0.csv", None), ("r1.csv", (540.0, 541.0))):
        include_part(folder, "recordings", file, part)
    assert (folder / "cable.toml").read_text() == text


@pytest.mark.parametrize("separator", [",", ";"])
def test_a_recording_that_is_refused_is_drawn_with_the_place_of_the_fault(tmp_path, separator):
    folder = write(RecordedBench(rate=100.0, length=60.0), tmp_path / "bench", seed=4)
    lines = (folder / "r0.csv").read_text().splitlines()

    def sketch(rows):
        text = "\n".join([lines[0], *rows, ""])
        (folder / "r0.csv").write_text(text if separator == "," else text.replace(",", ";").replace(".", ","))
        with pytest.raises(BowdenfitError) as refusal:
            bf.check(folder)
        (picture,) = sketch_refused([folder / "r0.csv"], list_refusals(refusal.value))
        (chart,) = picture.charts
        assert [group.series[0].label for group in chart.groups] == ["input_force_N", "output_force_N"]
        return chart, [(span.label, span.start) for span in chart.spans]

    words = [*lines[1:3000], f"{lines[3000].rsplit(',', 1)[0]},slip", *lines[3001:]]
    chart, places = sketch(words)
    assert places == [("row 3001", 29.99)] and (chart.x_label, chart.y_label) == ("time_s", "As written (N)")
    expected = np.loadtxt(lines[1:], delimiter=",")
    assert chart.groups[0].series[0].values.max() == pytest.approx(expected[:, 1].max())
    chart, places = sketch([*lines[3001:], *lines[1:3001]])  # the second half first
    assert places == [("the time falls back", 3001)] and chart.x_label == "Sample"
    chart, places = sketch([f"{line.rsplit(',', 1)[0]},5" for line in lines[1:]])
    assert places == [] and np.ptp(chart.groups[1].series[0].values) == 0


def test_what_is_left_out_is_added_to_entries_with_headings_of_their_own(bench):
    entry = '\n[[tables.forces.exclude]]\nrows = [3]\nreason = "typed twice"\n'
    text = (bench / "cable.toml").read_text()
    text = text.replace('forces = { file = "forces.csv" }', '[tables.forces]\nfile = "forces.csv"')
    (bench / "cable.toml").write_text(text.replace("# the end", f"{entry}# the end"))
    exclude_part(bench, "forces", "forces.csv", 6, "slipped")
    entries = tomllib.loads((bench / "cable.toml").read_text())["tables"]["forces"]["exclude"]
    assert entries == [{"rows": [3], "reason": "typed twice"}, {"rows": [6], "reason": "slipped"}]


def test_a_reason_is_needed(bench):
    with pytest.raises(UsageError, match="200 characters"):
        exclude_part(bench, "forces", "forces.csv", 3, "x" * 201)
