"""A bench on the computer, sample by sample: a motor pulls a rope against a spring, and two load cells are read.

What the motor does is in `profile`, rope, friction and spring are in `mechanics`, and what the load cells get wrong is in
`faults`; `recording` puts them together.
"""

from bowdenfit.questions.simulate.bench.faults import LoadCellFaults
from bowdenfit.questions.simulate.bench.mechanics import BenchFriction, BenchSettings
from bowdenfit.questions.simulate.bench.profile import MotorProfile
from bowdenfit.questions.simulate.bench.recording import SimulatedRecording, check_settings, simulate_recording

__all__ = [
    "BenchFriction",
    "BenchSettings",
    "LoadCellFaults",
    "MotorProfile",
    "SimulatedRecording",
    "check_settings",
    "simulate_recording",
]
