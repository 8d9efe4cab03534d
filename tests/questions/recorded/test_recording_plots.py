"""The figures of force recordings: what they draw, of how many, and how they are written."""

import dataclasses

import matplotlib as mpl
import numpy as np
import pytest
from figure_words import check_words, words
from shared_figures import DrawnOnce
from stored_figure_data import assert_kept

from bowdenfit.plots.panels import extremes
from bowdenfit.questions.figures import FIGURES, write_figure_files
from bowdenfit.questions.length.efficiency_figure import EfficiencyPoints
from bowdenfit.questions.recorded.autocorrelation_figure import Autocorrelation, compute_autocorrelation
from bowdenfit.questions.recorded.dependence_figure import Dependence
from bowdenfit.questions.recorded.hysteresis_figure import LoopPanel
from bowdenfit.questions.recorded.recordings_figure import POINTS, OverTime, cut_to_first_cycles
from bowdenfit.questions.recorded.sample_efficiency_figure import Samples, compute_sample_efficiencies
from bowdenfit.questions.summary.residuals_figure import Residuals

pytestmark = pytest.mark.extended

PER_BLOCK = ("time", "input_force", "output_force", "stroke", "saturated", "predicted", "fitted")
NAMES = ("recordings", "hysteresis", "sample_efficiency", "autocorrelation", "dependence")
EXPONENT, NOISE, BLOCKS = 0.24, 0.15, 1000
LONG_NAME = "recordings/2024-05-03_bench_a/second_mounting_after_lunch/cable_length_470_mm_slow_"


def operator(input_force, exponent, start):
    """Output force of the play operator, F_in exp(-L) <= F_out <= F_in exp(L)."""
    force, path = start, []
    for low, high in zip(input_force * np.exp(-exponent), input_force * np.exp(exponent), strict=True):
        force = min(max(force, low), high)
        path.append(force)
    return np.array(path)


@dataclasses.dataclass(frozen=True)
class Recorded:
    """One recording, and what each figure shows of it."""

    over_time: OverTime
    hysteresis: LoopPanel
    samples: Samples
    autocorrelation: Autocorrelation


def trace(number=0, n=BLOCKS, name=None, draws=True, cycles=2, seconds=40.0):
    """A recording of cycles between 20 N and 80 N at the load, with faults."""
    rng = np.random.default_rng(number)
    time = (np.arange(n) + 0.5) * seconds / n
    motor = 55 - 45 * np.cos(2 * np.pi * cycles * time / seconds)
    exponent = EXPONENT + 0.01 * rng.standard_normal()
    true_output = operator(motor, exponent, 20.0)
    output = true_output + NOISE * rng.standard_normal(n)
    step = np.diff(true_output, prepend=true_output[0])
    stroke = np.where(step > 1e-9, 1, np.where(step < -1e-9, -1, 0))
    near = np.convolve(np.abs(np.diff(stroke, prepend=stroke[0])), np.ones(9), mode="same") > 0
    spread = np.array([-0.02, 0.0, 0.02]) if draws else np.zeros(1)
    lag = 0.4 * np.arange(25)
    name, used = name or f"run_{number:02d}", (stroke != 0) & ~near
    low, middle, high = np.exp(-EXPONENT - 0.02 * np.array([1, 0, -1]))
    over_time = OverTime(
        name=name, loop=False, time=time, input_force=motor, output_force=output, stroke=stroke,
        saturated=output > 0.998 * output.max(),
        predicted=np.stack([operator(motor, EXPONENT - s, 20.0) for s in spread]), fitted=true_output,
        flagged_kind=("dropout", "spike", "spike", "saturated", "quiet"),
        flagged_time=seconds * np.array([0.2, 0.35, 0.6, 0.75, 0.99]),
        flagged_input=np.array([np.nan, 60.0, 5e3, 100.0, 10.0]),
        flagged_output=np.array([np.nan, 70.0, 40.0, 90.0, 18.0]),
    )  # fmt: skip
    correlation = np.exp(-lag) + 0.03 * rng.standard_normal(len(lag)) * (lag > 0)
    return Recorded(
        over_time,
        LoopPanel(name, motor, output, stroke, EXPONENT + spread, exponent),
        Samples(
            name, *compute_sample_efficiencies(motor, output, stroke * used),
            np.array([low, middle, high]) if draws else np.full(1, middle), np.exp(-exponent), 0.002,
        ),
        Autocorrelation(name, lag, correlation, int(used.sum())),
    )  # fmt: skip


def one_way(number=0):
    """A recording that only pulls."""
    whole, part, name = trace(number), slice(80, 250), "pulling only"
    cut = {name: getattr(whole.over_time, name)[..., part] for name in PER_BLOCK}
    none = dict.fromkeys(("flagged_time", "flagged_input", "flagged_output"), np.zeros(0))
    over_time = dataclasses.replace(whole.over_time, name=name, **cut, **none, flagged_kind=())
    forces = {n: cut[n] for n in ("input_force", "output_force", "stroke")}
    efficiency, stroke = compute_sample_efficiencies(**forces)
    return Recorded(
        over_time,
        dataclasses.replace(whole.hysteresis, name=name, **forces),
        dataclasses.replace(whole.samples, name=name, efficiency=efficiency, stroke=stroke),
        dataclasses.replace(whole.autocorrelation, name=name, n_blocks=len(stroke)),
    )


def dependence_on(case, label, x, draws=True, runs=3):
    middle = 0.787 + 0.02 * np.log(x / x.mean())
    points = np.linspace(x[2], x[-2], 4)
    return Dependence(
        what=case, label=label, x=x, quantiles=middle + (0.01 * np.array([[-1], [0], [1]]) if draws else np.zeros((1, 1))),
        constant=0.787, points_x=np.tile(points, runs),
        points_efficiency=np.tile(np.interp(points, x, middle), runs) + np.repeat(0.004 * np.arange(runs), 4),
        points_label=tuple(f"mounting {i}" for i in range(runs) for _ in points), place="at 470 mm",
        points_half=np.full(4 * runs, 0.003), new_run=middle + 0.02 * np.array([[-1], [1]]) if draws else np.zeros((0, len(x))),
    )  # fmt: skip


LOADS, SPEEDS = np.linspace(10.0, 120.0, 40), np.geomspace(1.0, 300.0, 40)


def data_of(recorded, dependences=()):
    """What the figures show, by name."""
    parts = dict(zip(NAMES, ("over_time", "hysteresis", "samples", "autocorrelation"), strict=False))
    recorded = tuple(recorded)
    return {name: tuple(getattr(r, part) for r in recorded) for name, part in parts.items()} | {
        "dependence": tuple(dependences)
    }


def both(draws=True, runs=3):
    load = dependence_on("load", "Load (N)", LOADS, draws, runs)
    return load, dependence_on("speed", "Rope speed (mm/s)", SPEEDS, draws, runs)


def unlike():
    """Recordings of other lengths, loads and clocks."""
    first, second, third = trace(0), trace(1, n=120, seconds=3.0), trace(2)
    stronger = {n: 20 * getattr(third.over_time, n) for n in ("input_force", "output_force", "predicted", "fitted")}
    late = {n: getattr(third.over_time, n) + 1000.0 for n in ("time", "flagged_time")}
    forces = {n: stronger[n] for n in ("input_force", "output_force")}
    over_time = dataclasses.replace(third.over_time, **stronger, **late)
    hysteresis = dataclasses.replace(third.hysteresis, **forces)
    return first, second, dataclasses.replace(third, over_time=over_time, hysteresis=hysteresis)


def with_a_gap():
    whole = trace(3)
    time = whole.over_time.time
    return dataclasses.replace(whole, over_time=dataclasses.replace(whole.over_time, time=time + 15.0 * (time > 20)))


CASES = {
    "one": lambda: data_of([trace()], both()[:1]),
    "two": lambda: data_of([trace(0, name=LONG_NAME + "first"), with_a_gap()], both(runs=12)),
    "four": lambda: data_of(map(trace, range(4)), both()),
    "seven": lambda: data_of([*map(trace, range(6)), one_way(6)], (*both(), both()[0])),
    "twenty, long names": lambda: data_of([trace(i, name=f"{LONG_NAME}{i:02d}") for i in range(20)], both(runs=8)),
    "least squares only": lambda: data_of([trace(i, draws=False) for i in range(2)], both(draws=False)),
    "unlike each other": lambda: data_of(unlike(), both()[1:]),
    "one phase": lambda: data_of([one_way()], both()[1:]),
}


ONCE = DrawnOnce(CASES)
forget = ONCE.forgotten()


def draw_figure(name, case="four"):
    return ONCE.figure(name, case) if isinstance(case, str) else FIGURES[name].draw(case[name])


def line(axes, label):
    return next(artist for artist in axes.get_lines() if artist.get_label() == label)


def legend_of(figure):
    return [text.get_text() for legend in figure.legends for text in legend.get_texts()]


@pytest.mark.parametrize("case", CASES)
def test_no_words_overlap_or_leave_the_page(case):
    for name in NAMES:
        check_words(draw_figure(name, case), name)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("case", CASES)
def test_every_axis_is_labeled_or_shares_one_that_is(name, case):
    figure = draw_figure(name, case)
    lowest = max(axes.get_subplotspec().rowspan.stop for axes in figure.axes)
    for axes in figure.axes:
        place = axes.get_subplotspec()
        below = [a for a in figure.axes if a.get_subplotspec().colspan == place.colspan]
        neighbors = [a for a in figure.axes if a.get_subplotspec().rowspan == place.rowspan]
        assert any(a.get_xlabel() for a in below)
        assert any(a.get_ylabel() for a in neighbors)
        assert place.rowspan.stop < lowest or axes.get_xlabel()


@pytest.mark.parametrize("blocks", [np.zeros(0), np.ones(7), np.zeros(100)])
def test_few_or_constant_deviations_have_no_autocorrelation(blocks):
    assert compute_autocorrelation(blocks).tolist() == [1.0]


def test_deviations_that_alternate_are_correlated_in_turn():
    correlation = compute_autocorrelation(np.resize([1.0, -1.0], 400))
    assert len(correlation) == 60
    np.testing.assert_allclose(correlation, np.resize([1.0, -1.0], 60) * (400 - np.arange(60)) / 400)


@pytest.mark.parametrize(("name", "count"), list(zip(NAMES[:4], (9, 8, 8, 8), strict=True)))
def test_some_of_twenty_recordings_are_shown_from_first_to_last(name, count):
    figure = draw_figure(name, "twenty, long names")
    assert len(figure.axes) == count
    assert f"{count} of 20 recordings shown" in legend_of(figure)
    titles = [axes.get_title() for axes in figure.axes]
    assert titles[0].endswith("00") and titles[-1].endswith("19") and all(t.startswith("…") for t in titles)
    assert not any("shown" in text for text in legend_of(draw_figure(name, "seven")))


@pytest.mark.parametrize("width", [None, 3.5])
def test_recordings_take_no_more_room_however_many_they_are(width):
    def room(case):
        figure = FIGURES["recordings"].draw(ONCE.data(case)["recordings"], width)
        boxes = [axes.get_position() for axes in figure.axes]
        return figure.get_size_inches()[1] * (max(b.y1 for b in boxes) - min(b.y0 for b in boxes))

    rooms = [room(case) for case in ("one", "two", "four", "seven", "twenty, long names")]
    assert max(rooms) < rooms[0] + 0.01


@pytest.mark.parametrize(("case", "columns"), [("one", 1), ("two", 2), ("four", 4), ("seven", 4)])
def test_fewer_recordings_take_fewer_columns(case, columns):
    starts = {round(axes.get_position().x0, 6) for axes in draw_figure("hysteresis", case).axes}
    assert len(starts) == columns


def test_recordings_show_forces_fit_and_interval():
    data = CASES["one"]()
    (recording,) = data["recordings"]
    (axes,) = draw_figure("recordings", data).axes
    start = recording.time[0]
    np.testing.assert_allclose(line(axes, "Input").get_xydata().T, [recording.time - start, recording.input_force])
    np.testing.assert_allclose(line(axes, "Output").get_ydata(), recording.output_force)
    np.testing.assert_allclose(line(axes, "Output fitted").get_ydata(), recording.fitted)
    band = next(c for c in axes.collections if c.get_label() == "Output predicted, 90 % interval")
    heights = band.get_paths()[0].vertices[:, 1]
    assert (heights.min(), heights.max()) == (recording.predicted.min(), recording.predicted.max())


def test_phases_are_shaded_where_the_rope_is_in_them_in_fills_that_differ_in_gray():
    data = data_of([trace()])
    ((recording,), (axes,)) = data["recordings"], draw_figure("recordings", data).axes
    fills = {c.get_label(): c for c in axes.collections}
    for stroke, name in ((1, "Pulling"), (-1, "Returning"), (0, "Switching or held")):
        inside = np.zeros(BLOCKS, dtype=bool)
        for path in fills[name].get_paths():
            left, right = path.vertices[:, 0].min(), path.vertices[:, 0].max()
            time = recording.time - recording.time[0]
            inside |= (time >= left) & (time <= right)
        assert (inside == (recording.stroke == stroke)).mean() > 0.98
    gray = [float(c.get_facecolor()[0, :3] @ (0.299, 0.587, 0.114)) for c in fills.values() if c.get_label() in
            ("Pulling", "Returning", "Switching or held")]  # fmt: skip
    assert np.diff(sorted(gray)).min() > 0.04


def test_samples_left_out_are_marked_by_kind_on_the_axes():
    (axes,) = draw_figure("recordings", "one").axes
    low, high = axes.get_ylim()
    for kind, count in (("dropout", 1), ("spike", 4), ("saturated", 2), ("quiet", 2)):
        y = line(axes, f"Left out: {kind}").get_ydata()
        assert len(y) == count and y.min() >= low and y.max() <= high
    assert line(axes, "Left out: dropout").get_ydata()[0] == low
    assert high in line(axes, "Left out: spike").get_ydata()
    assert legend_of(draw_figure("recordings", "four")).count("Left out: spike") == 1


def test_lines_are_broken_where_nothing_was_recorded():
    axes = draw_figure("recordings", data_of([with_a_gap()])).axes[0]
    for label in ("Input", "Output", "Output fitted"):
        assert np.isnan(line(axes, label).get_ydata()).sum() == 1
    for phase in (c for c in axes.collections if c.get_label() in ("Pulling", "Returning", "Switching or held")):
        for path in phase.get_paths():
            left, right = path.vertices[:, 0].min(), path.vertices[:, 0].max()
            assert right <= 20.1 or left >= 34.9


def test_recordings_unlike_each_other_have_their_own_axes():
    limits = [axes.get_xlim() for axes in draw_figure("recordings", "unlike each other").axes]
    assert [round(high - low) for low, high in limits] == [40, 3, 40]
    assert len({axes.get_xlim() for axes in draw_figure("recordings", "four").axes}) == 1


def test_of_many_cycles_only_the_first_are_shown_and_this_is_said():
    many = trace(n=4000, cycles=40, seconds=200.0)
    figure = draw_figure("recordings", data_of([many]))
    assert "First 8 cycles shown" in legend_of(figure)
    shown = cut_to_first_cycles(many.over_time)
    assert shown.time[-1] == pytest.approx(8 * 5.0, abs=1.5)
    assert shown.predicted.shape == (3, len(shown.time)) == (3, len(shown.stroke))
    assert shown.flagged_kind == ("dropout",) and shown.flagged_time.tolist() == [40.0]
    assert not any("cycles" in text for text in legend_of(draw_figure("recordings", "four")))


def test_thinned_lines_keep_every_peak():
    values = np.random.default_rng(1).standard_normal(100_000)
    indices = extremes(values, 100)
    assert len(indices) <= 200 and {values.argmin(), values.argmax()} <= set(indices.tolist())
    np.testing.assert_array_equal(extremes(values[:150], 100), np.arange(150))
    long = trace(n=20_000)
    (axes,) = draw_figure("recordings", data_of([long])).axes
    assert len(line(axes, "Output").get_ydata()) <= POINTS
    assert line(axes, "Output").get_ydata().max() == long.over_time.output_force.max()


def test_hysteresis_shows_the_loop_between_both_capstan_lines():
    recording = trace().hysteresis
    (axes,) = draw_figure("hysteresis", {"hysteresis": (recording,)}).axes
    assert axes.get_xlim() == axes.get_ylim()
    box = axes.get_window_extent()
    assert box.width == pytest.approx(box.height, rel=1e-3)
    pulling = line(axes, "Pulling").get_xydata()
    np.testing.assert_array_equal(pulling[:, 1], recording.output_force[recording.stroke == 1])
    lines = [artist for artist in axes.get_lines() if artist.get_label() == "Capstan equation, median"]
    slopes = [artist.get_ydata()[1] / artist.get_xdata()[1] for artist in lines]
    np.testing.assert_allclose(slopes, np.exp([-EXPONENT, EXPONENT]))
    bands = [c for c in axes.collections if c.get_label() == "Capstan equation, 90 % interval"]
    right = axes.get_xlim()[1]
    ends = [b.get_paths()[0].vertices[np.isclose(b.get_paths()[0].vertices[:, 0], right), 1] / right for b in bands]
    np.testing.assert_allclose(sorted({round(v, 9) for e in ends for v in e}),
                               np.exp([-EXPONENT - 0.02, -EXPONENT + 0.02, EXPONENT - 0.02, EXPONENT + 0.02]))  # fmt: skip


def test_hysteresis_writes_the_exponent_and_its_interval():
    exact = dataclasses.replace(trace().hysteresis, own_exponent=0.25)
    (text,) = draw_figure("hysteresis", {"hysteresis": (exact,)}).axes[0].texts
    assert text.get_text() == "exponent 0.250\nexpected 0.240\n(0.220 to 0.260)"
    (text,) = draw_figure("hysteresis", data_of([trace(draws=False)])).axes[0].texts
    assert "(" not in text.get_text()


@pytest.mark.parametrize("case", ["one", "two", "seven", "twenty, long names", "unlike each other"])
def test_the_exponent_is_written_clear_of_the_loop(case):
    figure = draw_figure("hysteresis", case)
    figure.draw_without_rendering()
    for axes in figure.axes:
        box = axes.texts[0].get_window_extent()
        for artist in filter(lambda a: len(a.get_xdata()), axes.get_lines()):
            x, y = axes.transData.transform(artist.get_xydata()).T
            places = np.linspace(0, len(x) - 1, 2000)
            x, y = (np.interp(places, np.arange(len(x)), values) for values in (x, y))
            assert not np.any((x > box.x0) & (x < box.x1) & (y > box.y0) & (y < box.y1)), artist.get_label()


def test_sample_efficiencies_are_below_one_both_ways():
    values, stroke = trace().samples.efficiency, trace().samples.stroke
    assert set(stroke.tolist()) == {-1, 1}
    for way in (-1, 1):
        assert values[stroke == way].mean() == pytest.approx(np.exp(-EXPONENT), abs=0.02)


def test_sample_efficiency_shows_samples_mean_and_expectation_in_percent():
    recording = trace().samples
    (axes,) = draw_figure("sample_efficiency", {"sample_efficiency": (recording,)}).axes
    values, stroke = recording.efficiency, recording.stroke
    np.testing.assert_allclose(line(axes, "Returning").get_ydata(), 100 * values[stroke == -1])
    assert line(axes, "Mean of the run").get_ydata()[0] == 100 * recording.mean
    band = next(c for c in axes.collections if "from the readings" in c.get_label())
    assert np.ptp(band.get_paths()[0].vertices[:, 1]) == pytest.approx(2 * 1.645 * 0.2)
    (bar,) = axes.containers[0][2][0].get_segments()
    np.testing.assert_allclose(bar[:, 1], 100 * recording.expected[[0, 2]])
    assert bar[0, 0] > line(axes, "Returning").get_xdata().max()


def test_a_recording_of_one_phase_has_one_mark():
    labels = legend_of(draw_figure("sample_efficiency", "one phase"))
    assert "Pulling" in labels and "Returning" not in labels


def test_an_unknown_mean_or_exponent_is_left_out():
    nan = float("nan")
    whole = trace()
    samples = dataclasses.replace(whole.samples, mean=nan, sd=nan)
    data = data_of(
        [
            dataclasses.replace(
                whole, samples=samples, hysteresis=dataclasses.replace(whole.hysteresis, own_exponent=nan)
            )
        ]
    )
    assert "Mean of the run" not in legend_of(draw_figure("sample_efficiency", data))
    assert "nan" not in "".join(text for text, _ in words(draw_figure("hysteresis", data)))


def test_autocorrelation_has_the_band_of_its_own_number_of_blocks():
    recording = trace().autocorrelation
    (axes,) = draw_figure("autocorrelation", {"autocorrelation": (recording,)}).axes
    band = next(p for p in axes.patches if "95 %" in p.get_label())
    assert 2 * 1.96 / np.sqrt(recording.n_blocks) == pytest.approx(band.get_height())
    np.testing.assert_array_equal(line(axes, "Deviations from the fit").get_ydata(), recording.correlation)


def test_dependence_shows_curve_constant_and_points():
    load, speed = both()
    first, second = draw_figure("dependence", data_of([], (load, speed))).axes
    assert (first.get_title(), second.get_title()) == ("Load at 470 mm", "Speed at 470 mm")
    assert (first.get_xscale(), second.get_xscale()) == ("linear", "log")
    np.testing.assert_allclose(line(first, "Median").get_ydata(), 100 * load.quantiles[1])
    assert [list(a.get_ydata()) for a in first.get_lines() if a.get_label() == "90 % of runs, each on a new mounting"] == [
        list(100 * end) for end in load.new_run
    ]
    points = next(bars for bars in first.containers if bars.get_label() == "mounting 1")
    np.testing.assert_allclose(points[0].get_ydata(), 100 * load.points_efficiency[4:8])
    np.testing.assert_allclose([np.ptp(bar[:, 1]) for bar in points[2][0].get_segments()], 2 * 0.3)
    assert set(line(first, "Capstan equation alone").get_ydata()) == {78.7}
    assert "Measured in 12 runs" in legend_of(draw_figure("dependence", "two"))


def test_without_draws_there_are_lines_and_no_intervals():
    for name in NAMES:
        labels = legend_of(draw_figure(name, "least squares only"))
        assert not [text for text in labels if "interval" in text and "readings" not in text]
        assert name == "autocorrelation" or any("least squares" in text.lower() for text in labels)


def test_recorded_efficiencies_are_drawn_like_those_of_runs():
    from bowdenfit.kinds import find_readings
    from bowdenfit.kinds.recordings.blocks import RECORDED

    assert find_readings(RECORDED).are_runs
    assert find_readings(RECORDED).axis == find_readings("run_efficiency").axis
    route = np.array([450.0, 500.0])
    points = EfficiencyPoints(True, ("a", "b"), route, 0.8 + 0 * route, np.full((5, 2), 0.79), np.ones(2, dtype=bool))
    assert {"a", "b"} <= {text for text, _ in words(draw_figure("residuals", {"residuals": Residuals((points,))}))}


@pytest.mark.slow
@pytest.mark.parametrize("case", ["two", pytest.param("twenty, long names", marks=pytest.mark.slow)])
def test_the_same_data_give_the_same_small_files(case, tmp_path):
    initial = dict(mpl.rcParams)
    data = ONCE.data(case)
    for folder in ("first", "second"):
        written = [path for name in NAMES for path in write_figure_files(name, data[name], tmp_path / folder)]
    assert [path.name for path in written] == [f"{name}.{ending}" for name in NAMES for ending in ("png", "svg", "pdf")]
    for path in (tmp_path / "first").iterdir():
        assert path.read_bytes() == (tmp_path / "second" / path.name).read_bytes()
        assert 1_000 < path.stat().st_size < 500_000, path.name
    assert "Input force (N)</text>" in (tmp_path / "first" / "hysteresis.svg").read_text(encoding="utf-8")
    assert dict(mpl.rcParams) == initial


@pytest.mark.parametrize("case", CASES)
def test_data_come_back_from_the_file_in_which_they_are_kept(case, tmp_path):
    assert_kept(ONCE.data(case), tmp_path / "figures.npz")
