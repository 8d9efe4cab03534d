"""Whether a reading makes sense for a cable, and what it is called."""

from collections.abc import Sequence

import numpy as np

from bowdenfit.cable.cable import ANGLE_NOISE
from bowdenfit.cable.elasticity import PRELOAD
from bowdenfit.cable.load_cells import FORCE_NOISE, RUN_SCATTER
from bowdenfit.kinds.preload.term import PRELOAD_NOISE
from bowdenfit.kinds.stretch.term import STRETCH_NOISE
from bowdenfit.questions.next.possible_readings import Candidate
from bowdenfit.questions.next.possible_runs import typical_run
from bowdenfit.results.record import Record

ALONG = ("angle", "force", "efficiency", "loop")  # kinds that are measured at a value of the route, where there is one


def columns_without_curve(fit: Record) -> tuple[str, ...]:
    """Columns of contacts whose wrap angle is measured row by row."""
    return tuple(name for name in fit.dataset.description.angle_columns if name not in fit.model.cable.curves)


def why_not(fit: Record, candidate: Candidate) -> str:
    """Why a candidate makes no sense for this cable; empty where it does."""
    names, cable = {p.name for p in fit.model.space.parameters}, fit.model.cable
    kind = candidate.kind
    noise = "the fit does not know how such readings scatter, because it has no table of them"
    if kind == "angle":
        if ANGLE_NOISE not in names or not cable.curves:
            return "no contact of this cable has a curve that an angle could tell of."
        return _outside(fit, candidate, "an angle there tells nothing of the curves")
    if kind == "force":
        design = typical_run(fit.dataset.measurements)
        if design is None or not {RUN_SCATTER, design.noise} <= names:
            return f"{noise}; name an efficiency instead, or fit with a table of forces."
    if kind == "efficiency" and RUN_SCATTER not in names:
        return f"{noise}; fit with a table of efficiencies or forces."
    if kind in ("stretch", "preload") and {"stretch": STRETCH_NOISE, "preload": PRELOAD_NOISE}[kind] not in names:
        return f"{noise}; fit with a table of {kind}."
    if kind == "loop" and not (cable.is_loop and {FORCE_NOISE, PRELOAD} <= names):
        return "only a pull-pull loop with a table of its forces, and a preload of its own, has such readings."
    if kind in ALONG and np.isfinite(candidate.route) and cable.curves:
        return _outside(fit, candidate, "no angles were measured there that could stand in", measured=True)
    return ""


def _outside(fit: Record, candidate: Candidate, why: str, measured: bool = False) -> str:
    """A sentence where the length lies outside the range of the curves (and has no measured angles)."""
    route, angles = fit.dataset.description.route, fit.dataset.measurements.angles
    assert route is not None  # curves have one
    low, high = route.range
    known: Sequence[float] = angles.route.tolist() if measured and angles is not None else ()
    if low <= candidate.route <= high or candidate.route in known:
        return ""
    return (
        f"{candidate.route:g} {route.unit} lies outside the range of the curves, {low:g} to {high:g} {route.unit}, and {why}; "
        f"name a {route_words(fit)} inside."
    )


def route_words(fit: Record) -> str:
    """What the route varies, in words."""
    route = fit.dataset.description.route
    return route.variable.replace("_", " ") if route else "length"


def words_of(fit: Record, candidate: Candidate) -> str:
    """A candidate in words, such as "the wrap angles at 450 mm"."""
    route = fit.dataset.description.route
    what = {
        "angle": "the wrap angles" if len(fit.model.cable.curves) > 1 else "the wrap angle",
        "force": "a force run",
        "efficiency": "the efficiency",
        "stretch": "the stretch",
        "preload": "the preload",
        "loop": "the loop's output force",
    }[candidate.kind]
    if route is not None and np.isfinite(candidate.route):
        what += f" at {candidate.route:g} {route.unit}"
    if candidate.angles:
        angles = " and ".join(f"{angle:.4g}" for angle in np.rad2deg(candidate.angles))
        what += f" at {angles} deg"
    return what + (f" under {candidate.load:.3g} N" if np.isfinite(candidate.load) else "")


def name_of(candidate: Candidate) -> str:
    """A candidate as `parsed_candidates` reads it."""
    parts = [f"{candidate.route:.12g}"] if np.isfinite(candidate.route) else []
    parts += [f"{angle:.6g}deg" for angle in np.rad2deg(candidate.angles)]
    parts += [f"{candidate.load:.6g}N"] if np.isfinite(candidate.load) else []
    return candidate.kind + ("@" + ",".join(parts) if parts else "")
