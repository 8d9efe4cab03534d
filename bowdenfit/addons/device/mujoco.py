"""MuJoCo: a taut loop as plain MJCF, and any loop or rope whose stretch is known as a callback that solves its friction."""

import math
from collections.abc import Callable, Iterable
from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np

from bowdenfit.errors import UsageError
from bowdenfit.questions.export.tables import TransmissionTables
from bowdenfit.questions.export.text import ascii_text, fill_template, format_comment

_STEP = 1e-3  # s, the longest time step; a judgement
_MASS, _DAMPING = 4.0, 0.5  # of the node, in units of K h^2, and as a share of the critical one of its springs
_ENDS = ".xml", ".py"
TextAndRemarks = tuple[str, tuple[str, ...]]


def mujoco_model(tables: TransmissionTables, point: float | None, path: Path) -> TextAndRemarks:
    """Return MJCF or a callback, and remarks on it.

    Args:
        tables: The tables.
        point: Where on the route, or at which wrap angle, the numbers of the file hold; None for the middle of the range.
        path: The file to be; its ending says which of the two.

    Raises:
        UsageError: The cable has what MuJoCo cannot express, or the file has another ending.
    """
    _refuse_inexpressible(tables, path)
    points, low, high = tables.points.values, tables.points.values[0], tables.points.values[-1]
    if point is not None and not low <= point <= high:
        raise UsageError(f"--at is outside the range of this fit, which is {tables.points.words}.")
    chosen = float((low + high) / 2) if point is None else point
    remarks = (
        ()
        if len(points) == 1
        else (f"Friction is that at {_describe_point(tables, chosen)}" + ("." if point is not None else _MIDDLE),)
    )
    if path.suffix == ".py":
        return _write_callback(tables, chosen), remarks
    text, slack = _write_mjcf(tables, chosen, path.name)
    remark = f"It holds up to {slack:.3g} N m at the motor, above which the return side goes slack"
    return text, (*remarks, f"{remark}; --output cable.py holds there too.")


_MIDDLE = ", the middle of the range; --at names another place."


def _refuse_inexpressible(tables: TransmissionTables, path: Path) -> None:
    """Refuse what neither file expresses, and what MJCF alone does not."""
    if path.suffix not in _ENDS:
        raise UsageError(
            f"--output {ascii_text(path.name)}: MuJoCo reads a model from cable.xml, or a callback from cable.py."
        )
    if tables.depends_on_load:
        raise UsageError("MuJoCo cannot express friction that depends on the load; --to c, fmu and matlab can.")
    if not len(tables.median.stiffness):
        raise UsageError(
            "MuJoCo needs to know how the rope stretches, which nothing measured on this cable says; add a table of stretch, "
            "or use --to c or fmu, which need none."
        )
    if path.suffix == ".py":
        return
    if not tables.is_loop:
        raise UsageError(
            "plain MJCF cannot express the friction of a single rope, which grows with its tension: it would creep. A callback "
            "can; name it as --output cable.py."
        )
    if not all(tables.radii):
        end = "input" if not tables.radii[0] else "output"
        raise UsageError(
            f"the radius of the pulley at the {end} is not known; add it to cable.toml: [cable] {end}_pulley_radius = "
            '{ value = 15, unit = "mm" }.'
        )


def _write_mjcf(tables: TransmissionTables, point: float, file: str) -> tuple[str, float]:
    """Return the XML, and the torque at the motor [N m] up to which it holds."""
    points, median = tables.points, tables.median
    friction, exponent, stiffness = (
        float(np.interp(point, points.values, table))
        for table in (median.taut_loss, median.exponent[0], median.stiffness)
    )
    k, (motor, joint) = 1000 * stiffness, (radius / 1000 for radius in tables.radii)
    mass = _MASS * k * _STEP**2
    slack = friction / max(-math.expm1(-exponent), 1e-12) * motor
    numeric = [(f"bowden_frictionloss_{level.name}", level.taut_loss) for level in tables.levels]
    numeric += [("bowden_stiffness_N_per_m", 1000 * median.stiffness)]
    text = fill_template(
        "bowden.xml",
        package=__package__,
        about=format_comment(tables.sentences, ""),
        file=ascii_text(file).replace('"', "'").replace("<", "'").replace("&", "'"),
        place=_describe_point(tables, point),
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
        sentences=quoteattr(" ".join(map(ascii_text, tables.sentences))),
        unit=quoteattr(ascii_text(points.unit or "none")),
        places=_join_numbers(points.values),
        tables="\n".join(
            f'    <numeric name="{name}" data="{_join_numbers(values)}"/>' for name, values in numeric
        ),
    )
    return text, slack


def _join_numbers(values: Iterable[float]) -> str:
    return " ".join(repr(float(value)) for value in values)


def _write_callback(tables: TransmissionTables, point: float) -> str:
    """Return the Python module of the callback."""
    levels, has_radii = tables.levels, all(tables.radii)
    motor, joint = (repr(radius / 1000) for radius in tables.radii) if has_radii else ("None", "None")
    words = f"{tables.radii[0]:g} mm and {tables.radii[1]:g} mm radius" if has_radii else "radii that are to be stated"

    def table(of: Callable[..., Iterable[float]]) -> str:
        return "\n".join(f"    [{', '.join(repr(float(x)) for x in of(level))}]," for level in levels)

    return fill_template(
        "callback.template",
        package=__package__,
        about=format_comment(tables.sentences, "").replace('"', "'"),
        pulley_words=words,
        is_loop=tables.is_loop,
        of_rate=tables.depends_on_rate,
        names=", ".join(f'"{level.name}": {i}' for i, level in enumerate(levels)),
        places=", ".join(repr(float(x)) for x in tables.points.values),
        place_words=ascii_text(tables.points.words),
        pull=table(lambda level: level.exponent[0]),
        returning=table(lambda level: level.exponent[1]),
        taut_loss=table(lambda level: level.taut_loss),
        stiffness=table(lambda level: 1000 * level.stiffness),
        rate=table(lambda level: level.rate),
        reference_speed=repr(float(tables.reference_speed)),
        speed=repr(0.001 if tables.speed_unit == "mm/s" else 0.0),
        motor_radius=motor,
        joint_radius=joint,
        place=repr(point),
    )


def _describe_point(tables: TransmissionTables, point: float) -> str:
    """Return the point in words, as 'wrap_angle 90 deg'."""
    if tables.points.unit == "rad":
        return f"{ascii_text(tables.points.variable)} {math.degrees(point):.4g} deg"
    return f"{ascii_text(tables.points.variable)} {point:.6g} {ascii_text(tables.points.unit)}".strip()
