"""Recordings of runs: written as MCAP, read from other robots' recordings too, and replayed as a robot."""

from transport.recording.reading import read_recording
from transport.recording.recorder import RecordedScene, Recorder
from transport.recording.replayed import ReplayRobot
from transport.recording.values import RecordedTick, Recording, RecordingError, Topics

__all__ = [
    "RecordedScene",
    "RecordedTick",
    "Recorder",
    "Recording",
    "RecordingError",
    "ReplayRobot",
    "Topics",
    "read_recording",
]
