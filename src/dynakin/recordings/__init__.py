"""Recordings: markers and force plates, read from the field's formats; where up and forward are; plate
checks.

Readers are plug-ins by extension (``READERS``, ``register_reader``); everything is SI in the laboratory frame
of the file, a missing marker is NaN, and each plate keeps its own wrench, ground-on-person.
"""

from dynakin.recordings.c3d import read_c3d
from dynakin.recordings.csv import read_csv, read_csv_table
from dynakin.recordings.feet import DEFAULT_FOOT_MARKERS
from dynakin.recordings.forces import attach_forces, plates_from_table
from dynakin.recordings.frame import GroundFrame, find_ground_frame, find_laboratory_frame
from dynakin.recordings.landmarks import DEFAULT_PAIRS, FacingPairs, find_marker, plain_name
from dynakin.recordings.mot import Table, read_table
from dynakin.recordings.options import ReadOptions
from dynakin.recordings.plate_loads import PlateLoad, without_plate_loads
from dynakin.recordings.plates import PlateCheck, check_plates
from dynakin.recordings.pressure import DEFAULT_THRESHOLD_N, Surface, centre_of_pressure, plate_from_wrench
from dynakin.recordings.read import FORCE_READERS, READERS, read, register_reader
from dynakin.recordings.recording import Plate, Recording
from dynakin.recordings.resampling import CausalLowPass, low_pass, resample
from dynakin.recordings.standing import marker_speeds, standing_window
from dynakin.recordings.trc import read_trc

__all__ = [
    "DEFAULT_FOOT_MARKERS",
    "DEFAULT_PAIRS",
    "DEFAULT_THRESHOLD_N",
    "FORCE_READERS",
    "READERS",
    "CausalLowPass",
    "FacingPairs",
    "GroundFrame",
    "Plate",
    "PlateCheck",
    "PlateLoad",
    "ReadOptions",
    "Recording",
    "Surface",
    "Table",
    "attach_forces",
    "centre_of_pressure",
    "check_plates",
    "find_ground_frame",
    "find_laboratory_frame",
    "find_marker",
    "low_pass",
    "marker_speeds",
    "plain_name",
    "plate_from_wrench",
    "plates_from_table",
    "read",
    "read_c3d",
    "read_csv",
    "read_csv_table",
    "read_table",
    "read_trc",
    "register_reader",
    "resample",
    "standing_window",
    "without_plate_loads",
]
