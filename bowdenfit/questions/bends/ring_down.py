"""Device description, with the damping of its rope taken from a ring-down."""

from pathlib import Path

import numpy as np

from bowdenfit.description.device import Device, Known, read_device
from bowdenfit.errors import DescriptionError
from bowdenfit.kinds.ringdown.kind import RingDownTable
from bowdenfit.results.record import Record
from bowdenfit.results.store import load
from bowdenfit.words import listed

DAMPING, JOINT_DAMPING, RINGDOWN = "rope.damping", "joint.damping", "rope.ringdown"
_INERTIA, _DRAWS = "joint.inertia", 4000


def device_with_ring_down(fit: Record, path: Path) -> Device:
    """Read a device file; take the damping of the rope from a ring-down of the fit or of results named in the file.

    The released joint is damped by rope and joint together, so that a ring-down determines the sum of both: the known
    damping of the joint is subtracted from each draw.

    Args:
        fit: The fit of the cable.
        path: The file.

    Raises:
        DescriptionError: See `read_device`; or damping is stated and told, or less is told than the joint alone has.
        UsageError, StoreError: The results that it names cannot be read, or have no posterior.
    """
    device = read_device(path)
    folder = device.rope.ringdown
    has_ring_down = fit.dataset.measurements.table(RingDownTable) is not None
    if folder is None and not has_ring_down:
        return device
    results = path.parent / folder if folder is not None else None
    source = f"{RINGDOWN} names" if results else "the fit itself has"
    if device.states(DAMPING):
        raise DescriptionError(
            f"device.toml, {DAMPING}: {source} a ring-down, which tells it already; leave one of the two out."
        )
    ring_down = fit if results is None else load(results)
    if ring_down.dataset.measurements.table(RingDownTable) is None:
        raise DescriptionError(
            f"device.toml, {RINGDOWN}: {ring_down.name} was fitted without a table ringdown; name the results of "
            'a fit that has one, as [tables] ringdown = { file = "ringdown.csv" }.'
        )
    if not ring_down.converged:
        raise DescriptionError(
            f"device.toml, {RINGDOWN}: the fit of {ring_down.name} is not to be trusted "
            f"({listed(ring_down.reasons)}); sample longer."
        )
    return device.with_fitted(_known_from_ring_down(ring_down, device))


def _known_from_ring_down(ring_down: Record, device: Device) -> dict[str, Known]:
    """Damping of the rope, and the inertia of the joint where the device does not say it."""
    joint = device.needed(
        "the damping of the rope, which a ring-down tells together with that of the joint,", JOINT_DAMPING
    )[JOINT_DAMPING]
    total = _some_draws(ring_down, "rope_damping")
    middle = float(np.median(total)) - joint.value
    if middle <= 0:
        raise DescriptionError(
            f"device.toml, {JOINT_DAMPING}: {joint.value:g} N*m*s/rad is more than the {np.median(total):.3g} N*m*s/rad "
            "that the ring-down gives for rope and joint together; correct it, or measure it with the rope taken off."
        )
    known = {DAMPING: Known(middle, float(total.std()), tuple(total.tolist()), JOINT_DAMPING)}
    if not device.states(_INERTIA) and "ring_inertia" in ring_down.draws().values:
        inertia = _some_draws(ring_down, "ring_inertia")
        known[_INERTIA] = Known(float(np.median(inertia)), float(inertia.std()), tuple(inertia.tolist()))
    return known


def _some_draws(fit: Record, name: str) -> np.ndarray:
    """Draws of a parameter, evenly picked."""
    draws = np.ravel(fit.draws().values[name])
    return draws[np.linspace(0, len(draws) - 1, min(len(draws), _DRAWS)).round().astype(int)]
