"""Where the samples of recordings went, what was done to them, which phases were found: as plain data, and in words."""

from typing import Any

import numpy as np

from bowdenfit.recordings.recording import PULL, RETURN, SWITCH, Recording, Recordings
from bowdenfit.words import filled, listed, narrow_table

_PHASES = (("pulling", PULL), ("returning", RETURN), ("switching", SWITCH))
_SAMPLES = ("recording", "samples", "used", "left out", "block")
_HEADS = (*_SAMPLES, "pulling", "switching", "returning", "sliding", "exponent")
_LOOP_HEADS = (*_SAMPLES, "forward", "between", "back", "moving", "loss", "exponent")
_NOTE = (
    "Samples are averaged over blocks; pulling, switching and returning count blocks of each phase, sliding those that "
    "lie safely inside a pulling or returning phase. The exponent is that of the recording by itself: half the width of "
    "its hysteresis loop, as a log ratio."
)
_LOOP_NOTE = (
    "Samples are averaged over blocks; forward, between and back count blocks in which the loop moves forward, stands while "
    "the input force crosses the friction band, and moves back, moving those that lie safely inside a motion. The loss is "
    "the force that is lost while both sides are taut, 2 x preload x exponent, and the exponent is that of one side, both by "
    "the recording itself; a dash where it does not tell them."
)


def preparation_pages(recordings: Recordings) -> list[dict[str, Any]]:
    """Return a dictionary for each recording: its samples, its preparation and its phases, in s, N and Hz."""
    return [_preparation(recording) for recording in recordings.each]


def _preparation(recording: Recording) -> dict[str, Any]:
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


def recordings_text(recordings: Recordings) -> list[str]:
    """What was done to the recordings, line by line."""
    pages = preparation_pages(recordings)
    losses = [(_or_dash(r.strokes.drag, ".3g", " N"),) if recordings.loop else () for r in recordings.each]
    rows = [_row(page, loss) for page, loss in zip(pages, losses, strict=True)]
    lines = narrow_table(_LOOP_HEADS if recordings.loop else _HEADS, rows, left=("left out",)).splitlines()
    notes = [
        _LOOP_NOTE if recordings.loop else _NOTE,
        *_delay(pages),
        *_tare(pages),
        *_by_hand(pages),
    ]
    return [*lines, *(line for note in notes for line in filled(note).splitlines())]


def _row(page: dict[str, Any], loss: tuple[str, ...]) -> tuple[str, ...]:
    counts, blocks = page["counts"], page["blocks"]
    left_out = [f"{n} {kind}" for kind, n in counts.items() if kind != "used" and n]
    block = f"{1000 * page['block']:.4g} ms" if page["block"] > 0 else "none"
    return (
        page["name"],
        str(page["samples"]),
        str(counts["used"]),
        ", ".join(left_out) or "none",
        block,
        *(str(blocks[name]) for name in ("pulling", "switching", "returning", "sliding")),
        *loss,
        _or_dash(page["exponent"], ".3f"),
    )


def _or_dash(value: float, digits: str, unit: str = "") -> str:
    """A number, or a dash where it is not known."""
    return f"{value:{digits}}{unit}" if np.isfinite(value) else "-"


def _delay(pages: list[dict[str, Any]]) -> list[str]:
    """The delay, once where it is one for all."""
    said = {}
    for page in pages:
        delay, sd = 1000 * page["delay"], 1000 * (page["delay_sd"] if page["delay_sd"] is not None else np.nan)
        if np.isfinite(sd):
            said[f"{delay:.1f} ms, give or take {sd:.1f} ms (from the reversals of all recordings)"] = page["name"]
        elif delay:
            said[f"{delay:.1f} ms (as stated)"] = page["name"]
    return [f"The output channel was shifted back by a delay of {text}." for text in said]


def _tare(pages: list[dict[str, Any]]) -> list[str]:
    tared = [p for p in pages if any(p["tare"])]
    if not tared:
        return []
    parts = [f"{p['name']} {p['tare'][0]:+.2f} and {p['tare'][1]:+.2f} N" for p in tared]
    return [f"Tare taken off the input and output force: {listed(parts)}."]


def _by_hand(pages: list[dict[str, Any]]) -> list[str]:
    names = [p["name"] for p in pages if p["phases_by_hand"]]
    return [f"Phases set by hand in cable.toml: {listed(names)}."] if names else []
