"""Recordings: markers and force plates, read from the field's formats; where up and forward are; plate
checks.

Readers are plug-ins by extension (``READERS``, ``register_reader``); everything is SI in the laboratory frame
of the file, a missing marker is NaN, and each plate keeps its own wrench, ground-on-person.
"""

from dynakin.recordings.checks import check_plates
from dynakin.recordings.frame import GroundFrame, find_ground_frame
from dynakin.recordings.read import read, register_reader
from dynakin.recordings.recording import Plate, Recording
from dynakin.recordings.resampling import ReadOptions
from dynakin.recordings.standing import standing_window

__all__ = [
    "GroundFrame",
    "Plate",
    "ReadOptions",
    "Recording",
    "check_plates",
    "find_ground_frame",
    "read",
    "register_reader",
    "standing_window",
]
