"""MuJoCo: a taut loop as plain MJCF, and any loop or rope whose stretch is known as a callback that solves its friction."""

import math
from collections.abc import Callable, Iterable
from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np

from bowdenfit.errors import UsageError
from bowdenfit.questions.export.transmission import Transmission
from bowdenfit.questions.export.words import comment, filled_template, plain

_STEP = 1e-3  # s, the longest time step
_MASS, _DAMPING = 4.0, 0.5  # of the node, in units of K h^2, and as a share of the critical one of its springs
_ENDS = ".xml", ".py"
Written = tuple[str, tuple[str, ...]]


def model(found: Transmission, place: float | None, path: Path) -> Written:
    """The file, and what is to be known of it.

    Args:
        found: The tables.
        place: Where on the route, or at which wrap angle, the numbers of the file hold; None for the middle of the range.
        path: The file to be; its ending says which of the two.

    Raises:
        UsageError: The cable has what MuJoCo cannot express, or the file has another ending.
    """
    _refuse(found, path)
    at, low, high = found.places.at, found.places.at[0], found.places.at[-1]
    if place is not None and not low <= place <= high:
        raise UsageError(f"--at is outside the range of this fit, which is {found.places.words}.")
    where = float((low + high) / 2) if place is None else place
    said = () if len(at) == 1 else (f"Friction is that at {_spoken(found, where)}" + ("." if place is not None else _MIDDLE),)
    if path.suffix == ".py":
        return _callback(found, where), said
    text, slack = _mjcf(found, where, path.name)
    more = f"It holds up to {slack:.3g} N m at the motor, above which the return side goes slack"
    return text, (*said, f"{more}; --output cable.py holds there too.")


_MIDDLE = ", the middle of the range; --at names another place."


def _refuse(found: Transmission, path: Path) -> None:
    """What neither file expresses, and what MJCF alone does not."""
    if path.suffix not in _ENDS:
        raise UsageError(f"--output {plain(path.name)}: MuJoCo reads a model from cable.xml, or a callback from cable.py.")
    if found.of_load:
        raise UsageError("MuJoCo cannot express friction that depends on the load; --to c, fmu and matlab can.")
    if not len(found.median.stiffness):
        raise UsageError(
            "MuJoCo needs to know how the rope stretches, which nothing measured on this cable says; add a table of stretch, "
            "or use --to c or fmu, which need none."
        )
    if path.suffix == ".py":
        return
    if not found.is_loop:
        raise UsageError(
            "plain MJCF cannot express the friction of a single rope, which grows with its tension: it would creep. A callback "
            "can; name it as --output cable.py."
        )
    if not all(found.radii):
        end = "input" if not found.radii[0] else "output"
        raise UsageError(
            f"the radius of the pulley at the {end} is not known; add it to cable.toml: [cable] {end}_pulley_radius = "
            '{ value = 15, unit = "mm" }.'
        )


def _mjcf(found: Transmission, place: float, file: str) -> tuple[str, float]:
    """The XML, and the torque at the motor [N m] up to which it holds."""
    places, median = found.places, found.median
    friction, exponent, stiffness = (
        float(np.interp(place, places.at, table)) for table in (median.taut_loss, median.exponent[0], median.stiffness)
    )
    k, (motor, joint) = 1000 * stiffness, (radius / 1000 for radius in found.radii)
    mass = _MASS * k * _STEP**2
    slack = friction / max(-math.expm1(-exponent), 1e-12) * motor
    tables = [(f"bowden_frictionloss_{level.name}", level.taut_loss) for level in found.levels]
    tables += [("bowden_stiffness_N_per_m", 1000 * median.stiffness)]
    text = filled_template(
        "bowden.xml",
        about=comment(found.sentences, ""),
        file=plain(file).replace('"', "'").replace("<", "'").replace("&", "'"),
        place=_spoken(found, place),
        slack_torque=f"{slack:.4g}",
        step=_STEP,
        friction=friction,
        hold=2 * _STEP,
        mass=f"{mass:.6g}",
        inertia=f"{mass * motor**2:.3g}",
        half_stiffness=2 * k,
        damping=_DAMPING * math.sqrt(4 * k * mass),
        motor_radius=motor,
        joint_radius=joint,
        sentences=quoteattr(" ".join(map(plain, found.sentences))),
        unit=quoteattr(plain(places.unit or "none")),
        places=_blanks(places.at),
        tables="\n".join(f'    <numeric name="{name}" data="{_blanks(values)}"/>' for name, values in tables),
    )
    return text, slack


def _blanks(values: Iterable[float]) -> str:
    return " ".join(repr(float(value)) for value in values)


def _callback(found: Transmission, place: float) -> str:
    """The module."""
    levels, known = found.levels, all(found.radii)
    motor, joint = (repr(radius / 1000) for radius in found.radii) if known else ("None", "None")
    words = f"{found.radii[0]:g} mm and {found.radii[1]:g} mm radius" if known else "radii that are to be stated"

    def table(of: Callable[..., Iterable[float]]) -> str:
        return "\n".join(f"    [{', '.join(repr(float(x)) for x in of(level))}]," for level in levels)

    return filled_template(
        "callback.template",
        about=comment(found.sentences, "").replace('"', "'"),
        pulley_words=words,
        is_loop=found.is_loop,
        of_rate=found.of_rate,
        names=", ".join(f'"{level.name}": {i}' for i, level in enumerate(levels)),
        places=", ".join(repr(float(x)) for x in found.places.at),
        place_words=plain(found.places.words),
        pull=table(lambda level: level.exponent[0]),
        returning=table(lambda level: level.exponent[1]),
        taut_loss=table(lambda level: level.taut_loss),
        stiffness=table(lambda level: 1000 * level.stiffness),
        rate=table(lambda level: level.rate),
        reference_speed=repr(float(found.reference_speed)),
        speed=repr(0.001 if found.speed_unit == "mm/s" else 0.0),
        motor_radius=motor,
        joint_radius=joint,
        place=repr(place),
    )


def _spoken(found: Transmission, place: float) -> str:
    """'wrap_angle 90 deg'"""
    if found.places.unit == "rad":
        return f"{plain(found.places.variable)} {math.degrees(place):.4g} deg"
    return f"{plain(found.places.variable)} {place:.6g} {plain(found.places.unit)}".strip()
