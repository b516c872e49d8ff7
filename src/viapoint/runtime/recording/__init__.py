"""Recordings: written while a run goes on, read back, exported and compared. Nothing here moves a robot."""

from .blocks import join
from .info import PRISMATIC, REVOLUTE, Axis, RunInfo
from .reader import Recording, RecordingError, load_recording
from .recorder import Recorder

__all__ = [
    "PRISMATIC",
    "REVOLUTE",
    "Axis",
    "Recorder",
    "Recording",
    "RecordingError",
    "RunInfo",
    "join",
    "load_recording",
]
