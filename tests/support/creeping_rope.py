"""Recordings of a rope whose friction builds up after a turn, by an ODE solver that shares no code with the likelihood.

Textbook LuGre (Canudas de Wit et al. 1995) with the motion of the load end, u = log F_out, in place of a displacement:
z' = u' - stiffness |u'| z / g(v), friction = stiffness z + damping z'. With no damping and a constant g it is Dahl's model.
With damping the load end has a small damper, without which its speed would be a quotient of zeros while the rope slides.
"""

from dataclasses import dataclass

import numpy as np
from cables import cable
from scipy.integrate import solve_ivp

from bowdenfit.dataset import Dataset
from bowdenfit.description import Preparation
from bowdenfit.kinds.tables import Measurements
from bowdenfit.models import Model, build_model
from bowdenfit.recordings.preparation import prepare
from bowdenfit.recordings.recording import RawRecording, Recording, Recordings
from bowdenfit.recordings.strokes import find_strokes

CONTACT = {"name": "sheath", "friction": "mu", "wrap_angle": {"column": "angle", "nominal": {"value": 90, "unit": "deg"}}}
ANGLE, SPEED = 2.0, 20.0  # rad; mm/s, of reference
NOISE = 0.15  # N, a sample
DESCRIPTION = """schema = 1
name = "rope"
friction_model = "{}"
reference_velocity = {{ value = 20, unit = "mm/s" }}
[[contact]]
name = "sheath"
friction = "mu"
wrap_angle = {{ value = 2, unit = "rad" }}
[tables.recordings]
files = "rope*.csv"
"""
LOAD_DAMPER = 2e-5  # s; the output comes later by that


@dataclass(frozen=True)
class Truth:
    """Friction exponent at the reference speed; stiffness over it (1/s per log force), damping over stiffness [s]; rate."""

    exponent: float = 0.3
    stiffness: float = 25.0
    damping: float = 0.0
    stribeck: float = 0.0
    stribeck_speed: float = 15.0
    viscous: float = 0.0
    reference_speed: float = 0.0

    def steady(self, speed):
        """Friction exponent in steady sliding."""
        a, v_s, c = self.stribeck, self.stribeck_speed, self.viscous
        factors = [1 + a * np.exp(-((v / v_s) ** 2)) + c * np.abs(v) for v in (speed, self.reference_speed)]
        return self.exponent * factors[0] / factors[1]


def pulled(time, periods=(9.0, 5.0, 3.0), low=20.0, high=90.0, speed_of=60.0):
    """Input force [N] and speed of the rope [mm/s] of strokes to and fro, two of each period, without jumps."""
    middle, half = (low + high) / 2, (high - low) / 2
    phase, ends = np.zeros_like(time), np.cumsum([2 * p for p in periods])
    rate = np.zeros_like(time)
    start, whole = 0.0, 0
    for period, end in zip(periods, ends, strict=True):
        now = (time >= start) & (time < end)
        phase[now], rate[now] = whole + (time[now] - start) / period, 1 / period
        start, whole = end, whole + 2
    turn = 2 * np.pi * phase
    return middle - half * np.cos(turn), speed_of * rate * np.sin(turn)


def creep(truth: Truth, time, profile=pulled):
    """Output force [N] at some times, for the input force and speed that a profile gives."""
    stiffness, damping = truth.stiffness * truth.exponent, truth.damping

    def grows(f, speed, sign):
        """Friction gained for each bit that the load end moves."""
        return stiffness * (1 - sign * f / float(truth.steady(speed)[0]))

    def change(t, state):
        """Without damping: x' = y' + f' and f' = grows y'."""
        (initial, force, after), speed = profile(np.array([t - 1e-5, t, t + 1e-5]))[0], profile(np.array([t]))[1]
        pulls = (after - initial) / 2e-5 / force
        moves = pulls / (1 + grows(state[1], speed, 1.0 if pulls >= 0 else -1.0))
        return [moves, pulls - moves]

    def change_damped(t, state):
        """With damping: x - y - f is that of the bristles and of the damper."""
        y, f = state
        force, speed = profile(np.array([t]))
        lead = float(np.log(force[0])) - y - f
        gain = grows(f, speed, 1.0 if lead >= 0 else -1.0)
        moves = lead / (LOAD_DAMPER + damping * max(gain, 0.0))
        return [moves, gain * moves]

    x = float(np.log(profile(np.array([time[0]]))[0][0]))
    start = [x - 0.3 * truth.exponent, 0.3 * truth.exponent]
    function, method = (change_damped, "LSODA") if damping else (change, "RK45")
    solved = solve_ivp(function, (time[0], time[-1]), start, method, time, rtol=1e-9, atol=1e-12, max_step=0.01)
    assert solved.success
    return np.exp(solved.y[0])


def record(truth: Truth, rate: float, seed: int, name: str = "turns") -> Recording:
    """A recording of half a minute with noise in both cells, prepared and cut into strokes."""
    generator, time = np.random.default_rng(seed), np.arange(0, 33.9, 1 / rate)
    (force, speed), output = pulled(time), creep(truth, time)
    noise = NOISE * generator.standard_normal((2, len(time)))
    raw = RawRecording(name, f"{name}.csv", time, force + noise[0], time, output + noise[1], time, speed)
    blocks, account = prepare(raw, Preparation(delay="none"))
    own_angles = np.array([ANGLE]), np.array([np.nan])
    return Recording(name, raw.file, name, float("nan"), *own_angles, blocks, find_strokes(blocks, raw.file, name), account)


def model_recordings(recordings: list[Recording], friction_model: str, delay_sd: float = 0.0) -> Model:
    """The model of recordings of one rope under a friction model."""
    conditions = {"reference_velocity": {"value": SPEED, "unit": "mm/s"}, "friction_model": friction_model}
    description = cable(1, {"recordings": {"files": "*.csv"}}, contact=[CONTACT], **conditions).model_copy(
        update={"route": None}
    )
    table = Recordings(("angle",), tuple(recordings), "mm/s", delay_sd)
    return build_model(Dataset(description, Measurements((table,)), {}))


def write_bench(folder, friction_model, truth, slower=1):
    """Write two recordings of one rope to a new folder, with their description: of 11 s each, or of so many times as slow."""
    folder.mkdir()
    generator, time = np.random.default_rng(2), np.arange(0, 11 * slower, 0.01)

    def motion(instants):
        return pulled(instants, periods=(2.5 * slower, 1.75 * slower, 1.25 * slower))

    force, speed = motion(time)
    output = creep(truth, time, motion)
    for n in (1, 2):
        noise = NOISE * generator.standard_normal((2, len(time)))
        columns = np.column_stack([time, force + noise[0], output + noise[1], speed])
        heading = "time_s,input_force_N,output_force_N,velocity_mm/s"
        np.savetxt(folder / f"rope{n}.csv", columns, "%.4f", ",", header=heading, comments="")
    (folder / "cable.toml").write_text(DESCRIPTION.format(friction_model))
