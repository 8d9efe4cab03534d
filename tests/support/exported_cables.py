"""Cables as tables, made up for tests of what is exported, and what the package's own equations say of them."""

import types
from collections.abc import Sequence
from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np

from bowdenfit.physics.friction import force_from_scale, force_scale, play_operator, rate_factor
from bowdenfit.physics.loop import loop_input_force, loop_output_force
from bowdenfit.physics.presliding import presliding_operator
from bowdenfit.questions.export.python import python_module
from bowdenfit.questions.export.tables import (
    DRAW,
    LEVELS,
    FitLabel,
    FrictionLevel,
    TablePoints,
    TransmissionTables,
)

HOSTILE = (
    "*/ int x; /* ??/ \\ \n#error </x> & ]]> --> <!-- \" ' : - { [ # %{ %} ... \r\u2028\x1b[31m \u202e $about ${place} "
    "!!python/object/apply:os.system ['true'] \x00 \u03b8"
)
CASES = ("loop", "rope", "load", "rate", "stroke", "one place")
CREEPING = ("dahl", "lugre")  # with drag and load dependence, and with the rate


def cable(case: str, draws: int = 3, name: str = "test cable") -> TransmissionTables:
    """A cable of one of the `CASES`, with friction that differs by level and place."""
    rng = np.random.default_rng((*CASES, *CREEPING).index(case))
    route_points = np.sort(rng.uniform(0.2, 3.0, 1 if case == "one place" else 37))
    levels = []
    for i, called in enumerate([*LEVELS, *(f"{DRAW}{k + 1}" for k in range(draws))]):
        exponent = (0.05 + 0.02 * i) * route_points * (1 + 0.1 * rng.standard_normal(route_points.shape))
        both = np.stack([exponent, exponent * (0.9 if case in ("stroke", "dahl") else 1.0)])
        levels.append(
            FrictionLevel(
                called, both, 2 * (10 + i + route_points) * exponent if case == "loop" else 0 * route_points,
                (0.0 if i == 1 else 0.1 * i) if case in ("load", "dahl") else 0.0,
                0.5 * i if case in ("load", "dahl") else 0.0,
                (0.3 + 0.01 * i, 4.0, 0.002) if case in ("rate", "lugre") else (0.0, 1.0, 0.0),
                presliding={"dahl": (20.0 + i, 0.0), "lugre": (30.0, 0.004)}.get(case, (0.0, 0.0)),
            )
        )  # fmt: skip
    places = TablePoints("place", "", np.zeros(1)) if case == "one place" else TablePoints("wrap_angle", "rad", route_points)
    about = FitLabel(name, 7, "0.1.0", "2026-01-01T00:00:00+00:00", ("loads 5 to 200 N",))
    options = {"load": ("drag", "load-dependent"), "rate": ("rate-dependent",), "stroke": ("stroke-dependent",)}.get(
        case, ()
    )
    speed = (20.0, "mm/s") if case in ("rate", "lugre") else (0.0, "")
    return TransmissionTables(about, places, tuple(levels), case == "loop", options, 50.0, *speed, 1e-6)


def module_of(tables: TransmissionTables) -> types.ModuleType:
    """The exported module, loaded."""
    module = types.ModuleType("exported_cable")
    exec(compile(python_module(tables), "exported_cable.py", "exec"), module.__dict__)
    return module


def with_rope(
    tables: TransmissionTables, stiffness: float = 100.0, radii: tuple[float, float] = (15.0, 20.0)
) -> TransmissionTables:
    """The same, of a rope whose stiffness is known [N/mm], on pulleys [mm]."""
    by_place = stiffness * (1 + 0.1 * np.arange(len(tables.points.values)) / len(tables.points.values))
    return replace(tables, levels=tuple(replace(level, stiffness=by_place) for level in tables.levels), radii=radii)


def points(tables: TransmissionTables, n: int, seed: int) -> dict[str, np.ndarray]:
    """Questions of all kinds: any level, places inside and outside the range, forces of every size."""
    rng = np.random.default_rng(seed)
    low, high = tables.points.values[0], tables.points.values[-1]
    force = np.exp(rng.uniform(np.log(0.1), np.log(2000.0), n))
    return {
        "level": rng.integers(0, len(tables.levels), n),
        "place": rng.uniform(low - 0.3 * (high - low) - 0.1, high + 0.3 * (high - low) + 0.1, n),
        "speed": rng.uniform(-60, 60, n),
        "force": force * np.where(tables.is_loop, rng.choice([-1.0, 1.0], n), 1.0),
        "stroke": rng.choice([-1.0, 1.0], n),
    }


def _there(tables: TransmissionTables, inputs: dict[str, np.ndarray], stroke: np.ndarray):
    """Exponent and taut loss of each question."""
    place, places = inputs["place"], tables.points.values
    exponent, taut = np.zeros(len(place)), np.zeros(len(place))
    for k, level in enumerate(tables.levels):
        for row, sign in enumerate((1.0, -1.0)):
            mask = (inputs["level"] == k) & (stroke == sign)
            exponent[mask] = np.interp(place[mask], places, level.exponent[row])
            taut[mask] = np.interp(place[mask], places, level.taut_loss)
    if tables.depends_on_rate:
        rate = [_of_levels(tables, inputs, [level.rate[i] for level in tables.levels]) for i in range(3)]
        reference = jnp.asarray(tables.reference_speed)
        ratio = jax.vmap(lambda speed, *rate: rate_factor(speed, *rate) / rate_factor(reference, *rate))
        exponent *= np.asarray(ratio(jnp.asarray(inputs["speed"]), *rate))
    return exponent, taut


def _of_levels(tables: TransmissionTables, inputs: dict[str, np.ndarray], numbers: Sequence[float]) -> jax.Array:
    """The number of each question's level."""
    return jnp.asarray(np.array(numbers)[inputs["level"]])


def of_equations(tables: TransmissionTables, inputs: dict[str, np.ndarray], *, inverse: bool = False) -> np.ndarray:
    """Output forces (input forces) by `bowdenfit.physics`."""
    stroke, force = inputs["stroke"], inputs["force"]
    exponent, taut = _there(tables, inputs, stroke)
    if tables.is_loop:
        function = loop_input_force if inverse else loop_output_force
        return np.asarray(function(force, taut / (2 * exponent), exponent, stroke))
    sign = -stroke if inverse else stroke
    numbers = ([getattr(level, name) for level in tables.levels] for name in ("load_exponent", "drag"))

    def shifted(force: jax.Array, shift: jax.Array, *scale: jax.Array) -> jax.Array:
        g = force_scale(force, *scale, tables.reference_force) - shift
        return force_from_scale(g, *scale, tables.reference_force)

    scales = (_of_levels(tables, inputs, of_levels) for of_levels in numbers)
    answers = jax.jit(jax.vmap(shifted))(jnp.asarray(force), jnp.asarray(sign * exponent), *scales)
    return np.maximum(np.asarray(answers), 0.0)


def followed(tables: TransmissionTables, level: int, place: float, speed: float, force: np.ndarray) -> np.ndarray:
    """Output forces through a motion, from the middle of the band on, by the package's play operator on its own scale."""
    n = len(force)
    inputs = {"level": np.full(n, level), "place": np.full(n, place), "speed": np.full(n, speed), "force": force}
    ends = [of_equations(tables, inputs | {"stroke": np.full(n, stroke)}) for stroke in (1.0, -1.0)]
    if tables.is_loop:
        return np.asarray(play_operator(*ends, 0.5 * (ends[0][0] + ends[1][0]))[0])
    level_table = tables.levels[level]
    scale = jnp.asarray(level_table.load_exponent), jnp.asarray(level_table.drag), tables.reference_force
    low, high = (force_scale(jnp.asarray(end), *scale) for end in ends)
    start = force_scale(jnp.asarray(0.5 * (ends[0][0] + ends[1][0])), *scale)
    return np.asarray(force_from_scale(play_operator(low, high, start)[0], *scale))


def crept(
    tables: TransmissionTables, level: int, place: float, speed: np.ndarray | float, force: np.ndarray, step: float
) -> np.ndarray:
    """Output forces through a motion, from the middle of the band on, of a rope whose friction builds up."""
    n, level_table = len(force), tables.levels[level]
    questions = {"level": np.full(n, level), "place": np.full(n, place), "speed": np.full(n, speed), "force": force}
    limits = tuple(jnp.asarray(_there(tables, questions, np.full(n, stroke))[0]) for stroke in (1.0, -1.0))
    reference = replace(tables, speed_unit="")
    at_reference = sum(_there(reference, questions, np.full(n, stroke))[0] for stroke in (1.0, -1.0))
    scale = jnp.asarray(level_table.load_exponent), jnp.asarray(level_table.drag), tables.reference_force
    x = force_scale(jnp.asarray(force), *scale)
    stiffness = level_table.presliding[0] * jnp.asarray(at_reference) / (limits[0] + limits[1])
    start = x[0] - (limits[0] - limits[1])[0] / 2
    y = presliding_operator(x, limits, stiffness, start, None, level_table.presliding[1] / step)
    return np.asarray(force_from_scale(y, *scale))


def changing_speed(n: int) -> np.ndarray:
    """Speeds between 6 and 56 of a motion, slow beside its turns."""
    return 31 + 25 * np.sin(np.linspace(0, 60, n))


def motion(tables: TransmissionTables, n: int) -> np.ndarray:
    """An input force that goes to and fro by much and little."""
    t = np.linspace(0, 1, n)
    walk = np.sin(40 * t) + 0.3 * np.sin(313 * t) + 0.05 * np.sin(2011 * t)
    return 80 * walk if tables.is_loop else 100 + 60 * walk
