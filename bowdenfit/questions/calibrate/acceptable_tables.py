"""Which simulated tables could come from a bench: those that the reader takes and that look like the measured ones.

Priors are weak, so that some of what they allow is no cable: an efficiency of 1 %, an output force below its own noise, a
rope slack at every angle. No bench would hand in such tables, and where noise is as large as what is read the likelihoods,
which take errors to be small, do not hold. They are drawn again, truth and tables together. The rule looks at the simulated
readings alone, never at the truth; and because the posterior is that of the truth given the readings, leaving readings out by
such a rule leaves ranks exactly uniform if they were so.

The limits are wide and are the same for every replication: efficiencies between 20 and 99 %, of every run and recording too;
at least as many detected angles of a contact as its curve has parameters; the largest stretch, preload and scatter within a
factor of ten of the measured one, however it is fitted; and everything that a reader of tables checks.
"""

from collections.abc import Callable

import numpy as np

from bowdenfit.dataset import Dataset
from bowdenfit.kinds.rows import LARGEST_ANGLE
from bowdenfit.kinds.tables import AngleTable, EfficiencyTable, ForceTable, LoopTable, PreloadTable, StretchTable
from bowdenfit.recordings.recording import PULL, RETURN, Recordings

LOWEST, HIGHEST = 0.2, 0.99  # efficiency
LEAST_LOSS, LARGEST_LOSS = -np.log(HIGHEST), -np.log(LOWEST)
FACTOR = 10.0  # between what is simulated and what was measured, at most
SCATTER = 0.1  # of log ratios of forces about their stroke's mean, at most
CURVE_PARAMETERS = 3
FEWEST_TAUT = 3  # readings of a preload above 0
FEWEST_BLOCKS = 10  # of each stroke of a recording


def refusal(measured: Dataset, drawn: Dataset) -> str:
    """Why no bench would hand in the drawn tables, in a few words; empty if one might.

    Args:
        measured: What was measured.
        drawn: What was simulated in its place.
    """
    checks: tuple[tuple[str, Callable[..., str]], ...] = (
        ("angles", _angles),
        ("efficiencies", _efficiencies),
        ("forces", _forces),
        ("recordings", _recordings),
        ("stretch", _stretch),
        ("preload", _preload),
        ("loop", _loop),
    )
    for name, check in checks:
        real, made = getattr(measured.measurements, name), getattr(drawn.measurements, name)
        if made is not None and (why := check(real, made)):
            return why
    return ""


def _angles(real: AngleTable, made: AngleTable) -> str:
    if np.nanmax(made.angle, initial=0.0) > LARGEST_ANGLE:
        return "an angle is above 2000 deg"
    detected, enough = (np.isfinite(table.angle).sum(axis=0) for table in (made, real))
    return "too few angles are detected" if np.any(detected < np.minimum(enough, CURVE_PARAMETERS)) else ""


def _efficiencies(real: EfficiencyTable, made: EfficiencyTable) -> str:
    del real
    return _beyond(-np.log(made.efficiency), "an efficiency")


def _beyond(loss: np.ndarray, what: str) -> str:
    if np.any(loss > LARGEST_LOSS):
        return f"{what} is below 20 %"
    return f"{what} is above 99 %" if np.any(loss < LEAST_LOSS) else ""


def _forces(real: ForceTable, made: ForceTable) -> str:
    """By run; and readings of one run and stroke must not scatter more than errors of forces may."""
    del real
    if np.any(made.input_force <= 0) or np.any(made.output_force <= 0):
        return "a force is not positive"
    slides = made.stroke != 0
    if not slides.any():
        return ""
    ratio = (made.stroke * np.log(made.input_force / made.output_force))[slides]
    strokes = _parts(2 * made.run[slides] + (made.stroke[slides] > 0), ratio)
    if any(np.std(part) > SCATTER for part in strokes):
        return "forces scatter by more than a tenth"
    return _beyond(np.array([part.mean() for part in _parts(made.run[slides], ratio)]), "the efficiency of a run")


def _parts(group: np.ndarray, values: np.ndarray) -> list[np.ndarray]:
    return [values[group == each] for each in np.unique(group)]


def _recordings(real: Recordings, made: Recordings) -> str:
    for one, other in zip(real.each, made.each, strict=True):
        for stroke in (PULL, RETURN):
            before, after = (int(np.sum(r.strokes.used_sliding & (r.strokes.stroke == stroke))) for r in (one, other))
            if after < min(before, FEWEST_BLOCKS):
                return "a recording hardly slides"
        if other.strokes.noise > max(FACTOR * one.strokes.noise, SCATTER if not real.loop else 0.0):
            return "a recording is nothing but noise"
    exponents = np.array([r.strokes.exponent for r in made.each])
    return _beyond(exponents[np.isfinite(exponents)], "the efficiency of a recording")


def _stretch(real: StretchTable, made: StretchTable) -> str:
    if not _within_factor(np.ptp(real.stretch), np.ptp(made.stretch)):
        return "the stretch is far from the measured one"
    of_cycle = 2 * made.cycle + made.unloading
    load, stretch = (
        np.concatenate([part - part.mean() for part in _parts(of_cycle, values)])
        for values in (made.load, made.stretch)
    )
    return "the stretch falls with the load" if load @ stretch <= 0 else ""


def _preload(real: PreloadTable, made: PreloadTable) -> str:
    if np.sum(made.preload > 0) < min(int(np.sum(real.preload > 0)), FEWEST_TAUT):
        return "the rope is slack at nearly every angle"
    close = _within_factor(real.preload.max(), made.preload.max())
    return "" if close else "the preload is far from the measured one"


def _loop(real: LoopTable, made: LoopTable) -> str:
    lost = made.stroke * (made.input_force - made.output_force)
    if np.median(lost) < 0:
        return "a loop gains force"
    loaded = np.abs(real.input_force) >= 0.5 * np.abs(real.input_force).max()
    share = np.median(lost[loaded] / np.abs(made.input_force[loaded]))
    return "" if 1 - HIGHEST <= share <= 1 - LOWEST else "a loop loses less than 1 % or more than 80 % of its force"


def _within_factor(real: float, made: float) -> bool:
    return bool(real / FACTOR <= made <= real * FACTOR)
