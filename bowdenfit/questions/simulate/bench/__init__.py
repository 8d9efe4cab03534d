"""A bench on the computer, sample by sample: a motor pulls a rope against a spring, and two load cells are read.

What the motor does, and rope, friction and spring are in `mechanics`; `recording` adds what the load cells get wrong.
"""

from bowdenfit.questions.simulate.bench.mechanics import BenchFriction, BenchSettings, MotorProfile
from bowdenfit.questions.simulate.bench.recording import (
    LoadCellFaults,
    SimulatedRecording,
    check_settings,
    simulate_recording,
)

__all__ = [
    "BenchFriction",
    "BenchSettings",
    "LoadCellFaults",
    "MotorProfile",
    "SimulatedRecording",
    "check_settings",
    "simulate_recording",
]
