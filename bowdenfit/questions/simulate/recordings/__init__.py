"""Recordings made from known truth: the plan (`bench.toml` with [recordings]), and the folder that comes of it."""

from bowdenfit.questions.simulate.recordings.making import MadeRecording, MadeRecordings, make_recordings
from bowdenfit.questions.simulate.recordings.plan import RecordingsPlan, parse_recordings_plan, read_recordings_plan
from bowdenfit.questions.simulate.recordings.planned import PlannedRecording
from bowdenfit.questions.simulate.recordings.writing import write_recordings

__all__ = [
    "MadeRecording",
    "MadeRecordings",
    "PlannedRecording",
    "RecordingsPlan",
    "make_recordings",
    "parse_recordings_plan",
    "read_recordings_plan",
    "write_recordings",
]
