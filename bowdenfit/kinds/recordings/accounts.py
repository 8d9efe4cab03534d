"""Where the samples of each recording went, as plain data."""

from typing import Any

import numpy as np

from bowdenfit.recordings.recording import PULL, RETURN, SWITCH, Recording, Recordings


def preparation_pages(recordings: Recordings) -> list[dict[str, Any]]:
    """One page a recording: its samples, its preparation and its phases, in s, N and Hz."""
    return [_account(recording) for recording in recordings.each]


def _account(recording: Recording) -> dict[str, Any]:
    account, strokes = recording.account, recording.strokes
    phases = {word: int(np.sum(strokes.stroke == sign)) for word, sign in _PHASES}
    return {
        "name": recording.name,
        "file": recording.file,
        "run": recording.run,
        "at": recording.route,
        "samples": account.samples,
        "counts": dict(account.counts),
        "rate": account.rate,
        "bandwidth": account.bandwidth,
        "block": account.block,
        "tare": list(account.tare),
        "delay": account.delay,
        "delay_sd": account.delay_sd,
        "noise": list(account.noise),
        "blocks": phases | {"sliding": int(strokes.used_sliding.sum())},
        "phases_by_hand": strokes.by_hand,
        "correlation_time": strokes.correlation * max(account.block, 1 / account.rate),
        "exponent": strokes.exponent,
        "center": strokes.center,
    }


_PHASES = (("pulling", PULL), ("returning", RETURN), ("switching", SWITCH))
