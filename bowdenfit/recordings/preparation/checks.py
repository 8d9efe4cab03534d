"""What a recording must be before anything is computed from it; each refusal is a sentence with a remedy."""

import shlex

import numpy as np

from bowdenfit.errors import DatasetError
from bowdenfit.files.pieces import split_pieces, subsample, to_floats
from bowdenfit.recordings.recording import RawRecording
from bowdenfit.types import OtherVector, Vector

_MISSING_CODE = 10.0  # judged, times all other forces: -9999 and the like; no load cell overshoots so twice to the same digit
FEWEST_SAMPLES = 20  # judged: fewer are a table
LARGEST_FORCE = 1e6  # N, far beyond any Bowden cable
SHORTEST_STEP, LONGEST_STEP = 1e-9, 86_400.0  # s, of any converter, and of what is still a recording
_HALF_DAY = 43_200.0  # s; the fall of a 12-hour clock from 12:59:59 to 1:00:00, but for one step
_OVERFLOWS = {  # s; what counters of microcontrollers fall by
    2**32 * 1e-6: "a counter of microseconds with 32 bits, as of micros(), that overflows",
    2**32 * 1e-3: "a counter of milliseconds with 32 bits, as of millis(), that overflows",
    2**16 * 1e-3: "a counter of milliseconds with 16 bits that overflows",
}
_MOST_REPEATED = 0.5  # judged: share of times that stand there twice, from which the clock is not one of samples


def check_recording(raw: RawRecording) -> tuple[str, ...]:
    """Refuse a recording that cannot be one, and remark on what is odd.

    Args:
        raw: The recording as read.

    Returns:
        Remarks, in sentences.

    Raises:
        DatasetError: A channel and its clock differ in length, a channel is too short, never moves or is far too large,
            a clock runs backwards, stands still or has steps that no bench has, or the two clocks do not overlap.
    """
    remarks = check_channels(raw)
    _check_overlap(raw)
    return remarks


def check_channels(raw: RawRecording) -> tuple[str, ...]:
    """Refuse channels that cannot be those of a recording, each by itself; see `check_recording`."""
    channels = {
        "input_force": (raw.input_time, raw.input_force),
        "output_force": (raw.output_time, raw.output_force),
    }
    if len(raw.velocity):
        channels["velocity"] = (raw.velocity_time, raw.velocity)
    for name, (time, values) in channels.items():
        _check_lengths(raw.file, name, time, values)
        _check_clock(raw.file, name, time)
    _check_forces(raw.file, "input_force", raw.input_force)
    _check_forces(raw.file, "output_force", raw.output_force)
    remarks = [_repeated(name, time) for name, (time, _) in channels.items()]
    return tuple(dict.fromkeys(r for r in remarks if r))


def check_sign(raw: RawRecording, name: str, force: Vector) -> None:
    """Refuse a channel most of whose readings under load are negative; call it once the tare is subtracted.

    Args:
        raw: The recording, which knows the names of its file and channels.
        name: Channel, "input_force" or "output_force".
        force: Its readings [N].

    Raises:
        DatasetError: More than half of the readings above a fifth of the largest are negative.
    """
    low, high = _measure_range(force)
    _refuse_missing_code(raw.file, name, force, low, high)
    largest, loaded, below = max(abs(low), abs(high)), 0, 0
    for part in split_pieces(len(force)):
        some = to_floats(force, part)
        under_load = some[np.isfinite(some) & (np.abs(some) > 0.2 * largest)]
        loaded, below = loaded + len(under_load), below + int(np.count_nonzero(under_load < 0))
    negative = below / max(loaded, 1)
    if negative > 0.5:
        channel = raw.channels[name == "output_force"] or "NAME"
        raise DatasetError(
            f"{raw.file}: {100 * negative:.0f} % of the readings of {name} under load are negative, down to "
            f"{low:.4g} N, but a rope can only pull; the usual cause is the sign convention of the load cell. "
            f"Turn the sign by mapping the channel with a minus before its unit, such as --channel "
            f"{shlex.quote(f'{name}={channel}:-N')}."
        )


def _refuse_missing_code(file: str, name: str, force: Vector, low: float, high: float) -> None:
    """Refuse a value that stands for a missing sample: it is repeated exactly, and ten times beyond all others.

    Raises:
        DatasetError: There is such a value.
    """
    extreme = low if abs(low) > abs(high) else high
    count, others = 0, 0.0
    for part in split_pieces(len(force)):
        some = to_floats(force, part)
        is_extreme = some == extreme
        count += int(np.count_nonzero(is_extreme))
        left = np.abs(some[np.isfinite(some) & ~is_extreme])
        others = max(others, float(left.max(initial=0.0)))
    if count > 1 and others > 0 and abs(extreme) > _MISSING_CODE * others:
        raise DatasetError(
            f"{file}: {count} samples of {name} are exactly {extreme:.6g} N, and all others are below {others:.4g} N; the "
            "usual cause is a code that a logger writes where a sample is missing. State the code as the file has it, such as "
            "--missing -9999 (in cable.toml missing = [-9999]), or leave those cells blank."
        )


def _check_lengths(file: str, name: str, time: OtherVector, values: Vector) -> None:
    if len(time) != len(values):
        raise DatasetError(
            f"{file}: {name} has {len(values)} samples but its clock has {len(time)}; the usual cause is a channel that "
            "was recorded at another rate than the clock it shares. Export it with its own time, or all at one rate."
        )
    finite = int(np.isfinite(values).sum())
    if finite < FEWEST_SAMPLES:
        raise DatasetError(
            f"{file}: {name} has {finite} readings, and a recording needs at least {FEWEST_SAMPLES}; the usual cause is "
            "a recording that was cut off or another channel than meant. Leave the file out or map the right channel."
        )


def _check_clock(file: str, name: str, time: Vector) -> None:
    missing = next(
        (p.start + int(np.argmin(ok)) for p in split_pieces(len(time)) if not (ok := np.isfinite(time[p])).all()), None
    )
    if missing is not None:
        raise DatasetError(
            f"{file}: the time of {name} is missing at sample {missing + 1}; every sample needs a time. "
            "Delete that row, or export the recording again."
        )
    if backwards := explain_backward_clock(name, time):
        raise DatasetError(f"{file}: {backwards}")
    step = (time[-1] - time[0]) / max(len(time) - 1, 1)
    if step and not SHORTEST_STEP <= step <= LONGEST_STEP:
        raise DatasetError(
            f"{file}: the samples of {name} are {step:.3g} s apart, which no bench records; the usual cause is a wrong unit of "
            "the time, or another column than the time. State the right ones by --channel time."
        )
    repeated = _share_repeated(time)
    if repeated > _MOST_REPEATED:
        raise DatasetError(
            f"{file}: {100 * repeated:.0f} % of the times of {name} repeat the one before (the first is {time[0]:.10g} s)"
            "; the usual cause is a clock written with too few digits. Export the time with more digits."
        )


def explain_backward_clock(name: str, time: Vector) -> str:
    """Return where the clock of a channel runs backwards and what to do, as a clause; empty where it never does.

    Args:
        name: Name of the channel.
        time: Its times [s].
    """
    steps = ((p.start, np.diff(time[p.start : p.stop + 1]) < 0) for p in split_pieces(len(time)))
    at = next((start + int(np.argmax(back)) for start, back in steps if back.any()), None)
    if at is None:
        return ""
    place = (
        f"the time of {name} runs backwards at sample {at + 2}, from {time[at]:.10g} s to {time[at + 1]:.10g} s; "
        "the usual cause is"
    )
    some = np.diff(subsample(time))
    if -_HALF_DAY <= time[at + 1] - time[at] < -_HALF_DAY + max(60.0, 10 * float(np.nanmedian(np.abs(some)))):
        return f"{place} a 12-hour clock written without AM and PM. Export the time with 24 hours, or in seconds."
    usual = float(np.nanmedian(np.abs(some)))
    for overflow, counter in _OVERFLOWS.items():
        if abs(time[at + 1] - time[at] + overflow) < 10 * usual:
            return f"{place} {counter}, which begins again at 0. Add {overflow:.10g} s to all times from there on."
    if np.mean(some < 0) > _MOST_REPEATED:
        return f"{place} a file whose last sample comes first. Sort its rows by the time."
    return f"{place} two recordings in one file. Split the file there."


def _check_forces(file: str, name: str, force: Vector) -> None:
    low, high = _measure_range(force)
    if low == high:
        raise DatasetError(
            f"{file}: {name} reads {low:.6g} N in every sample; the usual cause is a load cell that was dead or "
            "unplugged, or another channel than meant. Map the right channel, or leave the recording out."
        )
    some = subsample(force)
    typical = float(np.median(np.abs(some[np.isfinite(some)]))) if np.isfinite(some).any() else max(-low, high)
    if typical > LARGEST_FORCE:
        raise DatasetError(
            f"{file}: {name} reads {typical:.4g} N in its middle, far more than a Bowden cable bears; the usual cause is "
            f"a wrong unit, or counts of the converter. State the unit behind the name of the channel, by --channel {name}."
        )


def _check_overlap(raw: RawRecording) -> None:
    start = max(raw.input_time[0], raw.output_time[0])
    end = min(raw.input_time[-1], raw.output_time[-1])
    if start >= end:
        raise DatasetError(
            f"{raw.file}: input_force was sampled from {raw.input_time[0]:.10g} s to {raw.input_time[-1]:.10g} s and "
            f"output_force from {raw.output_time[0]:.10g} s to {raw.output_time[-1]:.10g} s, which do not overlap; the "
            "usual cause is two clocks with different zeros. Put both channels on one clock."
        )


def _repeated(name: str, time: Vector) -> str:
    share = _share_repeated(time)
    if not share:
        return ""
    return (
        f"{100 * share:.2g} % of the times of {name} repeat the one before, as a clock with few digits does; the samples "
        "were spread evenly between the different times."
    )


def _share_repeated(time: Vector) -> float:
    repeated = sum(int(np.count_nonzero(np.diff(time[p.start : p.stop + 1]) == 0)) for p in split_pieces(len(time)))
    return repeated / (len(time) - 1) if len(time) > 1 else 0.0


def _measure_range(force: Vector) -> tuple[float, float]:
    """Return the lowest and the highest reading [N]."""
    pieces = (to_floats(force, part) for part in split_pieces(len(force)))
    ends = [(float(np.min(some)), float(np.max(some))) for piece in pieces if len(some := piece[np.isfinite(piece)])]
    return min(low for low, _ in ends), max(high for _, high in ends)
