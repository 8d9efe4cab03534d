"""Stretches of a recording that its user leaves out, and the samples left out for whatever reason, as figures show them."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bowdenfit.errors import DatasetError
from bowdenfit.recordings.preparation.blocks import CommonClock
from bowdenfit.recordings.preparation.checks import FEWEST_SAMPLES
from bowdenfit.recordings.preparation.clock import EXCLUDED, GOOD, KINDS, NO_OVERLAP
from bowdenfit.recordings.recording import ExcludedStretches, FlaggedSamples, RawRecording

_SHOWN_FLAGS = 300  # flagged samples of a kind that a figure shows


def leave_out_spans(raw: RawRecording, spans: Sequence[tuple[float, float]]) -> RawRecording:
    """Return a recording in which the forces in some stretches count as missing, whatever they are.

    Args:
        raw: The recording.
        spans: Start and end of each stretch on its clock [s].

    Raises:
        DatasetError: The recording has no sample in one of them, or too few elsewhere.
    """
    if not spans:
        return raw
    first, last = (float(pick(raw.input_time)) for pick in (np.nanmin, np.nanmax))
    for start, end in spans:
        if not np.any((raw.input_time >= start) & (raw.input_time <= end)):
            raise DatasetError(
                f"{raw.file}: exclude names {start:g} to {end:g} s, where there is no sample; the usual cause is a time of "
                f"another recording. {raw.name} lasts from {first:.6g} to {last:.6g} s: correct the entry, or delete it.",
                key_path=("exclude",),
            )
    excluded = ExcludedStretches(tuple(spans), raw.input_force, raw.output_force)
    inputs = np.where(excluded.covers(raw.input_time), np.nan, raw.input_force)
    outputs = np.where(excluded.covers(raw.output_time), np.nan, raw.output_force)
    if min(np.isfinite(inputs).sum(), np.isfinite(outputs).sum()) < FEWEST_SAMPLES:
        raise DatasetError(
            f"{raw.file}: exclude leaves fewer than {FEWEST_SAMPLES} readings of {raw.name}; leave more of it in, or leave the "
            "whole recording out.",
            key_path=("exclude",),
        )
    return replace(raw, input_force=inputs, output_force=outputs, excluded=excluded)


def collect_flagged(common: CommonClock, raw: RawRecording, delay: float) -> FlaggedSamples:
    """Return the samples left out, evenly thinned to a few hundred of each kind, in order of time.

    Args:
        common: Both channels on one clock.
        raw: The recording, by which the user's own are filled in.
        delay: How much later the output channel is [s].
    """
    chosen = []
    for kind in range(GOOD + 1, NO_OVERLAP):
        positions = np.flatnonzero(common.fault == kind)
        chosen.append(positions[np.unique(np.linspace(0, len(positions) - 1, min(len(positions), _SHOWN_FLAGS)).astype(int))])
    samples = np.sort(np.concatenate(chosen))
    time, inputs, outputs = common.time[samples], common.input_force[samples], common.output_force[samples]
    if raw.excluded is not None:
        is_excluded = common.fault[samples] == EXCLUDED
        as_read = np.interp(time, raw.input_time, raw.excluded.input_force)
        inputs = np.where(is_excluded, as_read, inputs)
        as_read = np.interp(time + delay, raw.output_time, raw.excluded.output_force)
        outputs = np.where(is_excluded, as_read, outputs)
    return FlaggedSamples(tuple(KINDS[k] for k in common.fault[samples].tolist()), time, inputs, outputs)
