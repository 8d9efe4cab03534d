"""Simulated recordings as a reader of files would hand them on."""

from bowdenfit.recordings.recording import RawRecording


def to_raw(simulated, name, file, velocity="rope"):
    """The recording with the velocity of the rope [mm/s] or of the motor [rad/s]."""
    time = simulated.time
    shown = simulated.velocity if velocity == "rope" else simulated.motor_speed
    return RawRecording(name, file, time, simulated.input_force, time, simulated.output_force, time, shown)
