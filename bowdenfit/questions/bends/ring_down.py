"""A device as its file describes it, and as a ring-down tells the damping of its rope."""

from pathlib import Path

import numpy as np

from bowdenfit.description.device import Device, Known, read_device
from bowdenfit.errors import DescriptionError
from bowdenfit.kinds.ringdown.kind import RingDownTable
from bowdenfit.results.record import Record
from bowdenfit.results.store import load
from bowdenfit.words import listed

DAMPING, BESIDE, RINGDOWN = "rope.damping", "joint.damping", "rope.ringdown"
_INERTIA, _DRAWS = "joint.inertia", 4000


def device_for(fit: Record, path: Path) -> Device:
    """The device of a file; what it does not say of the rope is taken from a ring-down, of the fit itself or named there.

    The bar that is released swings against rope and joint, so that what it tells is the sum of both dampings: where the
    damping of the joint is known, it is taken from each draw.

    Args:
        fit: The fit of the cable.
        path: The file.

    Raises:
        DescriptionError: See `read_device`; or damping is stated and told, or less is told than the joint alone has.
        UsageError, StoreError: The results that it names cannot be read, or have no posterior.
    """
    device = read_device(path)
    folder = device.rope.ringdown
    own = fit.dataset.measurements.table(RingDownTable) is not None
    if folder is None and not own:
        return device
    where = path.parent / folder if folder is not None else None
    said = f"{RINGDOWN} names" if where else "the fit itself has"
    if device.states(DAMPING):
        raise DescriptionError(
            f"device.toml, {DAMPING}: {said} a ring-down, which tells it already; leave one of the two out."
        )
    found = fit if where is None else load(where)
    if found.dataset.measurements.table(RingDownTable) is None:
        raise DescriptionError(
            f"device.toml, {RINGDOWN}: {found.name} was fitted without a table ringdown; name the results of one that has it, "
            'as [tables] ringdown = { file = "ringdown.csv" }.'
        )
    if not found.converged:
        raise DescriptionError(
            f"device.toml, {RINGDOWN}: the fit of {found.name} is not to be trusted ({listed(found.reasons)}); sample longer."
        )
    return device.told(_told(found, device))


def _told(ring_down: Record, device: Device) -> dict[str, Known]:
    """Damping of the rope, and the inertia of the joint where the device does not say it."""
    beside = device.needed("the damping of the rope, which a ring-down tells together with that of the joint,", BESIDE)[BESIDE]
    total = _picked(ring_down, "rope_damping")
    middle = float(np.median(total)) - beside.value
    if middle <= 0:
        raise DescriptionError(
            f"device.toml, {BESIDE}: {beside.value:g} N*m*s/rad is more than the {np.median(total):.3g} N*m*s/rad that the "
            "ring-down tells of rope and joint together; correct it, or measure it with the rope taken off."
        )
    told = {DAMPING: Known(middle, float(total.std()), tuple(total.tolist()), BESIDE)}
    if not device.states(_INERTIA) and "ring_inertia" in ring_down.draws().values:
        inertia = _picked(ring_down, "ring_inertia")
        told[_INERTIA] = Known(float(np.median(inertia)), float(inertia.std()), tuple(inertia.tolist()))
    return told


def _picked(found: Record, name: str) -> np.ndarray:
    """Draws of a parameter, evenly picked."""
    draws = np.ravel(found.draws().values[name])
    return draws[np.linspace(0, len(draws) - 1, min(len(draws), _DRAWS)).round().astype(int)]
