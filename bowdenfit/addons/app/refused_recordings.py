"""Charts of recordings that are refused: their channels over time, as far as they can be read, and where the fault is."""

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bowdenfit.addons.app.draft import Refusal
from bowdenfit.addons.app.points import COLORS, MOST_POINTS
from bowdenfit.errors import BowdenfitError
from bowdenfit.files import read_channels
from bowdenfit.files.cells import parse_number
from bowdenfit.files.clocks import is_clock, names_time
from bowdenfit.files.headings import heading_of
from bowdenfit.files.tables import read_table
from bowdenfit.pages.section import Chart, Picture, Series, SeriesGroup, Span
from bowdenfit.plots.panels import extremes
from bowdenfit.types import Vector
from bowdenfit.words import few, listed

_FEWEST, _MOST_CHARTS = 20, 8  # samples and charts of a recording that is drawn; judgements
_LARGEST = 32 << 20  # bytes of a file that is read cell by cell; a judgement
_SAMPLE = "Sample"


@dataclass(frozen=True)
class _Signal:
    """A channel as it is written: its name, unit, samples, and their times, which `clock` names; none without a clock."""

    name: str
    unit: str
    values: Vector
    time: Vector | None = None
    clock: str = ""


def sketch_refused(paths: Sequence[Path], refusals: Sequence[Refusal]) -> tuple[Picture, ...]:
    """Return charts of the recordings that refusals speak of.

    Args:
        paths: Files of recordings, or that may be some.
        refusals: Why they are refused.
    """
    pictures = list[Picture]()
    for path in paths:
        of_file = [refusal for refusal in refusals if path.name == refusal.file or path.name in refusal.sentence]
        with suppress(BowdenfitError):
            signals, faults = _read_signals(path, of_file) if of_file else ([], {})
            if any(len(signal.values) >= _FEWEST for signal in signals):
                pictures.append(_draw(path.name, f"refused-{len(pictures)}", signals, faults))
    return tuple(pictures)


def _read_signals(path: Path, refusals: Sequence[Refusal]) -> tuple[list[_Signal], dict[int, str]]:
    """Return the channels of a file, and the samples that are refused with what they are called.

    Raises:
        DatasetError: It cannot be read as columns of numbers, not even in part.
    """
    try:
        channels = [channel for channel in read_channels(path).channels if not is_clock(channel)]
    except BowdenfitError:
        return _read_cells(path, {refusal.row for refusal in refusals if refusal.file == path.name})
    return [_Signal(c.name, c.unit, c.values, c.time, "Time (s)") for c in channels], {}


def _read_cells(path: Path, refused_rows: set[int]) -> tuple[list[_Signal], dict[int, str]]:
    """Return the same of a file of which some cells are no numbers."""
    if path.stat().st_size > _LARGEST:
        return [], {}
    table = read_table(path)
    columns = {
        heading: np.array([_number(cell.text) for cell in cells])
        for heading, cells in zip(table.header, zip(*table.rows, strict=True), strict=False)
    }
    clock = next((heading for heading in columns if names_time(heading)), "")
    units = {heading: unit or heading_of(heading).unit for heading, unit in zip(table.header, table.units, strict=True)}
    time = columns.pop(clock, None)
    signals = [_Signal(name, units[name], values, time, clock) for name, values in columns.items() if np.isfinite(values).any()]
    return signals, {i: f"row {row[0].row}" for i, row in enumerate(table.rows) if row[0].row in refused_rows}


def _number(text: str) -> float:
    values = (parse_number(text.strip(), mark) for mark in ".,")
    return next((value for value in values if value is not None), np.nan)


def _draw(file: str, name: str, signals: Sequence[_Signal], faults: dict[int, str]) -> Picture:
    """Return charts of channels, one for each unit; in the order of the samples where no clock only goes on."""
    backwards = {place: "the time falls back" for signal in signals for place in _find_backwards(signal.time)}
    faults = {**faults, **backwards}
    by_clock = not backwards and all(signal.time is not None for signal in signals)
    charts = []
    for unit in list(dict.fromkeys(signal.unit for signal in signals))[:_MOST_CHARTS]:
        of_unit = [signal for signal in signals if signal.unit == unit][: len(COLORS)]
        groups = tuple(_draw_line(signal, color, by_clock) for signal, color in zip(of_unit, COLORS, strict=False))
        x_label = of_unit[0].clock if by_clock else _SAMPLE
        spans = tuple(_mark_faults(of_unit[0], faults, by_clock))
        names = listed([signal.name for signal in of_unit])
        charts.append(Chart(names, x_label, f"As written ({unit})" if unit else "As written", groups, spans))
    sentences = ["As written, as far as it can be read."]
    sentences += [f"Red: {few(list(dict.fromkeys(faults.values())))}."] if faults else []
    sentences += ["The menu shows the other channels."] if len(charts) > 1 else []
    return Picture(name, file, "", tuple(charts), " ".join(sentences), alone=True)


def _find_backwards(time: Vector | None) -> list[int]:
    """Return the samples before which a clock falls back or stops to be known."""
    return [] if time is None else (np.flatnonzero(~(np.diff(time) >= 0)) + 1).tolist()


def _draw_line(signal: _Signal, color: str, by_clock: bool) -> SeriesGroup:
    """Return the line of a channel, thinned to its extremes."""
    x = signal.time if by_clock and signal.time is not None else np.arange(1.0, len(signal.values) + 1)
    shown = extremes(np.nan_to_num(signal.values), MOST_POINTS // 2)
    shown = shown[np.append(True, np.diff(x[shown]) > 0)]
    return SeriesGroup(x[shown], (Series(signal.name, "line", color, signal.values[shown]),))


def _mark_faults(signal: _Signal, faults: dict[int, str], by_clock: bool) -> Iterator[Span]:
    """Yield an upright line for each fault."""
    for sample, label in sorted(faults.items()):
        place = float(signal.time[sample]) if by_clock and signal.time is not None else sample + 1.0
        yield Span(label, "bad", place, place)
