"""A bench for a pull-pull loop in a few lines of NumPy: its recordings, and the files they are kept in."""

import math

import numpy as np

from bowdenfit.description import Preparation
from bowdenfit.recordings.loop_strokes import LoopStrokes
from bowdenfit.recordings.preparation import prepare
from bowdenfit.recordings.recording import RawRecording
from bowdenfit.recordings.strokes import find_strokes

PRELOAD, MU, RATE = 20.0, 0.12, 200.0
HALF_TURN = MU * math.pi
SETTINGS = Preparation()


def output_of(force, preload, exponent, start=0.0):
    """Output force of a loop: it stands still between what it would be moving forward and moving back."""
    y, output, lost = start, [], 2 * preload * exponent
    for x in force.tolist():
        slack = x * math.exp(-exponent), x * math.exp(exponent)
        forward, back = min(x - lost, *slack), max(x + lost, *slack)
        y = min(max(y, forward), back)
        output.append(y)
    return np.array(output)


def motor(shape, amplitude, seconds=16.0):
    """Time and input force of a motor that swings through zero, with partial reversals on the way."""
    time = np.arange(0, seconds, 1 / RATE)
    phase = 0.5 * np.pi * time
    swing = np.sin(phase) if shape == "sine" else 2 / np.pi * np.arcsin(np.sin(phase))
    return time, amplitude * (swing + 0.35 * np.sin(3.3 * phase))


def recorded(shape="sine", amplitude=60.0, exponent=HALF_TURN, preload=PRELOAD, noise=0.3, seed=0, seconds=16.0):
    """Columns of a recording, with noise on both load cells."""
    time, force = motor(shape, amplitude, seconds)
    output = output_of(force, preload, exponent)
    in_noise, out_noise = noise * np.random.default_rng(seed).standard_normal((2, len(time)))
    return {"time_s": time, "input_force_N": force + in_noise, "output_force_N": output + out_noise}


def write(path, columns):
    np.savetxt(path, np.column_stack(list(columns.values())), "%.6f", ",", header=",".join(columns), comments="")


def folder_of(path, item, *, angles=None, cable="", more="", entry=""):
    """A data set of recordings of a loop; each at its wrap angle in degrees, or all at half a turn."""
    bend = '{ value = 180, unit = "deg" }' if angles is None else '{ column = "bend" }'
    lines = ["[[contact]]", 'name = "sheath"', 'friction = "mu"', f"wrap_angle = {bend}"]
    lines.append(more or "[tables]\nrecordings = {}")
    for i, columns in enumerate(item):
        write(path / f"r{i}.csv", columns)
        lines += ["[[recording]]", f'file = "r{i}.csv"', entry]
        if angles is not None:
            lines.append(f'wrap_angles = {{ bend = {{ value = {angles[i]}, unit = "deg" }} }}')
    (path / "cable.toml").write_text("\n".join(['name = "loop"', "[cable]", 'kind = "loop"', cable, *lines]) + "\n")
    return path


def prepared(columns, settings=SETTINGS):
    time = columns["time_s"]
    forces = columns["input_force_N"], columns["output_force_N"]
    return prepare(RawRecording("run", "run.csv", time, forces[0], time, forces[1], loop=True), settings)


def strokes_of(columns, by_hand=(), preload=None):
    return find_strokes(prepared(columns)[0], "run.csv", "run", by_hand, LoopStrokes(preload))


ANGLES, AMPLITUDES = (90, 180, 180, 270), (60, 20, 90, 60)


def several_in(folder):
    """Four recordings, each with a mounting of its own; one of them never goes slack."""
    effects = 0.01 * np.random.default_rng(5).standard_normal(4)
    recordings = [
        recorded(("sine", "triangle")[i % 2], amplitude, MU * math.radians(angle) + effects[i], seed=i)
        for i, (angle, amplitude) in enumerate(zip(ANGLES, AMPLITUDES, strict=True))
    ]
    return folder_of(folder, recordings, angles=ANGLES)
