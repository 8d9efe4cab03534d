"""What the preparation of recordings could not find out, where it matters: a delay, and samples beyond a range."""

import numpy as np

from bowdenfit.recordings.preparation.delay import BEYOND, RANGE, UNKNOWN
from bowdenfit.recordings.recording import Recording, Recordings
from bowdenfit.results.record import Record
from bowdenfit.words import counted, percent

_EXAMPLE = 0.01  # [s], a delay in a sentence: that of a filter of 30 Hz
_LEAST_CHANGE = 0.1  # judged: slow healthy recordings, whose delay nothing shows, change by less
_MOST_SATURATED = 0.5  # judged: share of samples at the end of a range from which little of a recording is left


def describe_distant_delay(fit: Record) -> str:
    """Say that the output is late by more than is looked for, and that this matters to the friction; empty otherwise."""
    unknown = _unknown_delays(fit)
    beyond = [recording for recording in unknown if any(BEYOND in remark for remark in recording.account.remarks)]
    if not beyond or not _matters(fit, beyond):
        return ""
    return (
        f"{beyond[0].name}: the output seems to be {RANGE:g} s or more later or earlier than the input, and no delay was "
        "assumed. The usual causes are a channel that a logger buffers, and channels that did not start together. State the "
        f"delay: {_remedy()}, or record a reversal at a steady speed."
    )


def describe_recording_caveats(fit: Record) -> list[str]:
    """Say what to keep in mind: a delay that is unknown and would matter, and how few samples are left of recordings."""
    sentences, unknown = list[str](), _unknown_delays(fit)
    if unknown and _matters(fit, unknown) and not describe_distant_delay(fit):
        change = _EXAMPLE * _mean_sensitivity(unknown)
        sentences.append(
            "How much later the output channel is than the input channel is unknown, and no delay was assumed: each "
            f"{1000 * _EXAMPLE:g} ms of it would change the friction by {percent(change, 1)}, which its interval does not "
            f"contain. State the delay: {_remedy()}, or record both strokes."
        )
    recordings = fit.dataset.measurements.table(Recordings)
    for recording in recordings.items if recordings is not None else ():
        saturated, samples = recording.account.counts["saturated"], recording.account.samples
        if saturated > _MOST_SATURATED * samples:
            sentences.append(
                f"Of {counted(samples, 'sample')} of {recording.name} {saturated} are at the end of a load cell's range and "
                f"left out, so that {recording.account.counts['used']} decide; look at its range, its plug and its display."
            )
    return sentences


def _remedy() -> str:
    return "--set 'tables.recordings.prepare.delay={value=10,unit=\"ms\"}' (in cable.toml delay under prepare)"


def _unknown_delays(fit: Record) -> list[Recording]:
    """Return the recordings of a rope whose delay was looked for and not found."""
    recordings = fit.dataset.measurements.table(Recordings)
    if recordings is None or recordings.loop:
        return []
    return [r for r in recordings.items if any(remark.startswith(UNKNOWN) for remark in r.account.remarks)]


def _matters(fit: Record, recordings: list[Recording]) -> bool:
    """Return whether the longest delay that is looked for changes the friction by more than its interval and a tenth."""
    estimates = [fit.least_squares.estimates.get(name) for name in fit.dataset.description.coefficients]
    widths = [(e.upper - e.lower) / 2 / e.value for e in estimates if e is not None and e.value > 0]
    finite = [width for width in widths if np.isfinite(width)]
    return bool(finite) and RANGE * _mean_sensitivity(recordings) > max(min(finite), _LEAST_CHANGE)


def _mean_sensitivity(recordings: list[Recording]) -> float:
    """Return the relative change of the friction exponent with a delay of the output [1/s]."""
    return float(np.mean([_sensitivity(recording) for recording in recordings]))


def _sensitivity(recording: Recording) -> float:
    """Return by how much the friction exponent of one recording changes with a delay, over itself [1/s].

    While the rope slides, an output that is late by d lags by d times the rate of the logarithm of the force.
    """
    blocks, strokes = recording.blocks, recording.strokes
    used = strokes.used_sliding & (blocks.input_force > 0)
    if np.count_nonzero(used) < 2 or not strokes.exponent > 0:
        return 0.0
    rate = np.gradient(np.log(np.where(blocks.input_force > 0, blocks.input_force, 1.0)), blocks.time)
    return abs(float(np.mean((strokes.stroke * rate)[used]))) / strokes.exponent
