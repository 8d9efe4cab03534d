"""Which rows of a force table were read in one mounting of the cable."""

from collections import Counter
from collections.abc import Sequence
from typing import Literal

import numpy as np

from bowdenfit.description import Route, Table
from bowdenfit.kinds.rows import OwnAngles
from bowdenfit.types import Labels, Vector
from bowdenfit.words import few, listed

SAME_BEND = float(np.deg2rad(1.99))  # wrap angles that follow one another more closely are one bend, read twice
_SDS = 4.0  # standard deviations of stated ones within which that holds too
SAME_LENGTH = 0.005  # of the range of the route, within which it holds for lengths
_NAMED = 4  # labels that a remark names


class ForceSettings(Table):
    """The table of forces; whether one label of a run stands for one mounting wherever it was measured.

    A label that comes back at another length or bend is another mounting by default: runs are usually numbered anew there.
    """

    run: Literal["at one length", "across lengths", "across bends"] = "at one length"


def mountings(labels: Sequence[str], route: Vector, own: OwnAngles, limits: Route | None) -> tuple[Labels, list[str]]:
    """The mounting of each row, and the name of each: a label at one length and one bend.

    Args:
        labels: What the table calls the run of each row.
        route: Route variable; NaN where the cable has no route.
        own: Wrap angles measured with the row.
        limits: The route; None without.
    """
    named, sds = np.array(labels), np.nan_to_num(own.sd)
    steps = [np.full(len(route), SAME_LENGTH * np.ptp(limits.range) if limits else np.inf)]
    steps += [np.maximum(SAME_BEND, _SDS * sd) for sd in sds.T]
    place = np.zeros((len(labels), len(steps)), dtype=int)
    for label in dict.fromkeys(labels):
        mine = named == label
        for k, (values, step) in enumerate(zip((route, *own.angle.T), steps, strict=True)):
            place[mine, k] = _apart(values[mine], float(np.max(step[mine])))
    keys = [(label, *where) for label, where in zip(labels, place.tolist(), strict=True)]
    distinct = {key: i for i, key in enumerate(dict.fromkeys(keys))}
    run = np.array([distinct[key] for key in keys])
    places = Counter(key[0] for key in distinct)
    names = [
        label if places[label] == 1 else f"{label} ({_where(run == i, route, own, limits)})"
        for i, (label, *_) in enumerate(distinct)
    ]
    return run, names


def numbered_anew(labels: Sequence[str], n_mountings: int, file: str, route: Route | None) -> str:
    """What is said of labels that come back elsewhere; empty where none does."""
    distinct = list(dict.fromkeys(labels))
    if n_mountings == len(distinct):
        return ""
    what = "length" if route else "bend"
    return (
        f"{file}: the {len(distinct)} labels of its runs ({few(distinct, _NAMED)}) come back at another {what}, which is "
        f"taken as another mounting of the cable each time: {n_mountings} mountings in all. If the cable stayed mounted while "
        f'its {what} changed, write run = "across {what}s" beside the file in cable.toml.'
    )


def _apart(values: Vector, step: float) -> Labels:
    """Groups of values that leave a gap between them."""
    known = np.nan_to_num(values, nan=-1e300)
    order = np.argsort(known, kind="stable")
    group = np.empty(len(values), dtype=int)
    group[order] = np.cumsum(np.append(0, np.diff(known[order]) > step))
    return group


def _where(mine: np.ndarray, route: Vector, own: OwnAngles, limits: Route | None) -> str:
    """Length of a mounting, and its bends where there is none."""
    if limits is not None:
        return f"{np.mean(route[mine]):g} {limits.unit}"
    angles = [float(np.rad2deg(np.mean(column[mine]))) for column in own.angle.T if np.isfinite(column[mine]).all()]
    return f"{listed([f'{angle:.4g}' for angle in angles])} deg"
