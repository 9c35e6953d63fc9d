"""Whole files that mutations start from: small ones of every kind that dynakin reads, and real recordings."""

from __future__ import annotations

import json
import re
from importlib import resources
from pathlib import Path

import numpy as np

from dynakin.recordings.recording import Recording
from dynakin.results.files.markers import write_trc
from dynakin.results.files.storage import write_storage
from dynakin.simulation.trial import simulate_squat
from support.made_c3d import made_c3d
from support.made_recordings import write_c3d

FRAMES, MARKERS = 24, 8
LINES, LARGEST = 80, 1_000_000  # of real files: more of the same would only take longer

OSIM_4 = """<?xml version="1.0" encoding="UTF-8" ?>
<OpenSimDocument Version="40000"><Model name="leg"><gravity>0 -9.81 0</gravity>
<BodySet><objects>
<Body name="thigh"><mass>8</mass><mass_center>0 -0.2 0</mass_center><inertia>0.1 0.02 0.1 0 0 0</inertia></Body>
<Body name="shank"><mass>3</mass><mass_center>0 -0.2 0</mass_center><inertia>0.04 0.01 0.04 0 0 0</inertia></Body>
</objects></BodySet>
<JointSet><objects>
<CustomJoint name="hip"><socket_parent_frame>hip_0</socket_parent_frame>
<socket_child_frame>/bodyset/thigh</socket_child_frame>
<coordinates><Coordinate name="flexion"><default_value>0.1</default_value><range>-2 2</range></Coordinate></coordinates>
<frames><PhysicalOffsetFrame name="hip_0"><socket_parent>/ground</socket_parent>
<translation>0.1 0.9 0</translation><orientation>0 0.1 0</orientation></PhysicalOffsetFrame></frames>
<SpatialTransform><TransformAxis name="rotation1"><coordinates>flexion</coordinates><axis>0 0 1</axis>
<LinearFunction name="function"><coefficients>1 0</coefficients></LinearFunction></TransformAxis>
<TransformAxis name="translation1"><coordinates>flexion</coordinates><axis>1 0 0</axis>
<SimmSpline name="function"><x>-2 -1 0 1 2</x><y>0 0.01 0.02 0.01 0</y></SimmSpline></TransformAxis></SpatialTransform>
</CustomJoint>
<PinJoint name="knee"><socket_parent_frame>/bodyset/thigh</socket_parent_frame>
<socket_child_frame>/bodyset/shank</socket_child_frame>
<coordinates><Coordinate name="knee_flexion"><range>-2 0</range></Coordinate></coordinates></PinJoint>
</objects></JointSet>
<MarkerSet><objects><Marker name="KNE"><socket_parent_frame>/bodyset/thigh</socket_parent_frame>
<location>0.05 -0.4 0.05</location><fixed>true</fixed></Marker></objects></MarkerSet>
</Model></OpenSimDocument>
"""

OSIM_3 = """<?xml version="1.0" encoding="UTF-8"?>
<OpenSimDocument Version="30000"><Model name="leg"><gravity>0 -9.81 0</gravity>
<BodySet><objects><Body name="ground"><mass>0</mass></Body>
<Body name="thigh"><mass>8</mass><mass_center>0 -0.2 0</mass_center><inertia_xx>0.1</inertia_xx>
<inertia_yy>0.02</inertia_yy><inertia_zz>0.1</inertia_zz>
<Joint><PinJoint name="hip"><parent_body>ground</parent_body><location_in_parent>0 0.9 0</location_in_parent>
<orientation_in_parent>0 0 0</orientation_in_parent><location>0 0 0</location><orientation>0 0 0</orientation>
<CoordinateSet><objects><Coordinate name="flexion"><default_value>0</default_value><range>-2 2</range></Coordinate>
</objects></CoordinateSet><reverse>false</reverse></PinJoint></Joint></Body></objects></BodySet>
<MarkerSet><objects><Marker name="KNE"><body>thigh</body><location>0.05 -0.4 0.05</location></Marker></objects>
</MarkerSet>
</Model></OpenSimDocument>
"""


def make(folder: Path) -> None:
    """Small files of every kind that is read: `KIND_name.ending`."""
    folder.mkdir(parents=True, exist_ok=True)
    recording = simulate_squat(seed=3, duration_s=5.0, rate_hz=50.0).recording.window(2.0, 2.0 + (FRAMES - 1) / 50.0)
    names = list(recording.marker_names[:MARKERS])
    markers = recording.markers[:, :MARKERS]
    write_trc(folder / "markers_squat.trc", recording.time, names, markers, unit="mm")
    columns, values = _forces(recording)
    write_storage(folder / "forces_squat.mot", "forces", recording.time, columns, values, in_degrees=False)
    table = np.column_stack([recording.time, markers.reshape(FRAMES, -1), values])
    heads = ["time", *(f"{name}_{axis}" for name in names for axis in "xyz"), *columns]
    lines = [",".join(heads), *(",".join(f"{value:.6g}" for value in row) for row in table)]
    (folder / "markers_squat.csv").write_text("# a squat\n" + "\n".join(lines) + "\n")
    _as_they_come(folder)
    _c3d(folder / "c3d_plates.c3d", markers, values)
    _c3d(folder / "c3d_plain.c3d", markers, None)
    _c3d_of_a_laboratory(folder, markers)
    package = resources.files("dynakin.model")
    for kind, inside in (("model", "builtin"), ("set", "markers"), ("table", "tables")):
        for entry in (package / inside).iterdir():
            if entry.name.endswith((".toml", ".csv")):
                (folder / f"{kind}_{entry.name}").write_text(entry.read_text())
    (folder / "osim_4.osim").write_text(OSIM_4)
    (folder / "osim_3.osim").write_text(OSIM_3)
    (folder / "preset_own.toml").write_text(
        'base = "default"\n[noise]\njerk_density_rad2_s5 = 30.0\nmarker_gate = 1e-6\n'
    )
    (folder / "config_run.toml").write_text(
        'trial = "squat.trc"\nmodel = "squat7"\noutput = "out"\nmass_kg = 70.0\nside = "right"\nforward = [1, 0, 0]\n'
        'estimate = ["lengths", "markers"]\nplate_filter_hz = 20.0\n'
        "[noise]\njerk_density_rad2_s5 = 30.0\n[priors]\nmarker_sd_m = 0.02\n"
        '[[plate_loads]]\nplate = "plate 1"\nforce_n = [0, 5, 0]\npoint_m = [0, 0, 0]\n'
    )
    (folder / "study_two.toml").write_text(
        'model = "squat7"\noutput = "out"\ntrials = "*.trc"\n[[subjects]]\nname = "one"\nfolder = "."\nmass_kg = 70.0\n'
        '[[subjects]]\nname = "two"\nfolder = "."\ntrials = [{ trial = "a.trc", name = "x" }]\n'
    )
    (folder / "subject_own.toml").write_text(
        'schema_version = 1\nmodel = "squat7"\nmass_kg = 70.0\nuse = "bodies"\ntrials = ["a"]\n[batch]\n'
        'names = ["inertia/thigh/mass"]\nvalues = [8.0]\ncovariance = [[0.1]]\nprior_covariance = [[1.0]]\n'
        'base_names = ["b"]\nbase_words = ["b"]\nK = [[1.0]]\n'
    )
    known = {"parameters": [{"name": "length/thigh", "value": 0.4, "sd": 0.01, "estimated": True}]}
    (folder / "known_run.json").write_text(json.dumps(known))


def _as_they_come(folder: Path) -> None:
    """The same text files as other programs write them: decimal commas, semicolons, doubled tabs, UTF-16, rounded
    times, a doubled name."""
    trc, csv = ((folder / name).read_text() for name in ("markers_squat.trc", "markers_squat.csv"))
    (folder / "markers_commas.trc").write_text(re.sub(r"(?<=\d)\.(?=\d)", ",", trc))
    (folder / "markers_tabs.trc").write_text(re.sub(r"(?m)^(\d.*)$", lambda m: m[1].replace("\t", "\t\t"), trc))
    rounded = re.sub(r"(?m)^(\d+\t\d+\.\d)\d*", r"\1", trc)  # 50 Hz, to 0.1 s
    names = [name for name in trc.splitlines()[3].split("\t")[2:] if name]
    (folder / "markers_rounded.trc").write_text(rounded.replace(names[1], names[0]))
    (folder / "markers_semicolons.csv").write_text(csv.replace(",", ";").replace(".", ","))
    (folder / "markers_wide.csv").write_bytes(csv.encode("utf-16"))


def _c3d_of_a_laboratory(folder: Path, markers: np.ndarray) -> None:
    """Axes, outputs, events, analog channels, measures of the person, a doubled name; integer data, too."""
    origin = 1e3 * markers[:, 0]
    ends = zip("ALP", 100.0 * np.eye(3), strict=True)
    points = [(f"M{k}", 1e3 * markers[:, k]) for k in range(markers.shape[1])]
    points += [("PELO", origin), *((f"PEL{a}", origin + end) for a, end in ends)]
    points += [("M1", 1e3 * markers[:, 2]), ("LHipAngles", origin), ("CentreOfMass", origin), ("*12", origin)]
    groups = {
        "POINT": {"ANGLES": ["LHipAngles"], "TYPE_GROUPS": ["ANGLES", "ANGLE"]},
        "EVENT": {"USED": 2, "CONTEXTS": ["Left", "Right"], "LABELS": ["Foot Strike", "Foot Off"]}
        | {"TIMES": np.array([[0.0, 0.0], [0.1, 0.2]])},
        "PROCESSING": {"Bodymass": 70.0, "Height": 1750.0, "LLegLength": 900.0},
        "SUBJECTS": {"NAMES": ["Ann"]},
        "TRIAL": {"ACTUAL_START_FIELD": np.array([1, 0])},
        "ANALOG": {"UNITS": ["V"] * 12},
        "FORCE_PLATFORM": {
            "USED": 1,
            "TYPE": [6],
            "CHANNEL": np.arange(1, 13)[:, None],
            "ORIGIN": np.full((3, 1), 99.0),
        }
        | {"CORNERS": np.array([[200.0, 0, 300], [-200, 0, 300], [-200, 0, -300], [200, 0, -300]]).T[:, :, None]}
        | {"CAL_MATRIX": 100.0 * np.eye(12)[:, :, None]},
    }
    analog = 1.0 + np.random.default_rng(1).normal(size=(12, 3 * len(origin)))
    for name, scale in (("whole", -1.0), ("integer", 0.1)):
        made_c3d(folder / f"c3d_{name}.c3d", points, groups, analog=analog, per_frame=3, scale=scale)


def _forces(recording: Recording) -> tuple[list[str], np.ndarray]:
    names, columns = [], []
    for number, plate in enumerate(recording.plates, 1):
        for stem, values in (("v", plate.force), ("p", np.nan_to_num(plate.cop)), ("m", plate.free_moment)):
            names += [f"ground_force_{number}_{stem}{axis}" for axis in "xyz"]
            columns.append(values)
    return names, np.hstack(columns)


def _c3d(path: Path, markers: np.ndarray, forces: np.ndarray | None) -> None:
    """Markers in mm, and a plate of type 2 with two samples a frame."""
    points = {f"M{k}": 1e3 * markers[:, k] for k in range(markers.shape[1])}
    if forces is None:
        write_c3d(path, points)
        return
    channels = np.repeat(np.hstack([forces[:, :3], forces[:, 6:9]]).T, 2, axis=1)
    corners = np.array([[200.0, 0, 300], [-200, 0, 300], [-200, 0, -300], [200, 0, -300]])
    write_c3d(path, points, kinds=[2], channels=channels, corners=[corners], origins=[[0.0, 0.0, -40.0]], per_frame=2)


def add_real(folder: Path, data: Path) -> None:
    """The heads of real text files, and real C3Ds and models that are not too large, as `KIND_real_N.ending`."""
    kinds = {".trc": "markers", ".mot": "forces", ".sto": "forces", ".osim": "osim", ".c3d": "c3d"}
    files = (path for path in sorted(data.rglob("*")) if path.suffix in kinds and path.stat().st_size < LARGEST)
    for number, path in enumerate(files):
        content = path.read_bytes()
        if path.suffix in (".trc", ".mot", ".sto"):
            content = b"\n".join(content.split(b"\n")[:LINES]) + b"\n"
        (folder / f"{kinds[path.suffix]}_real_{number}{path.suffix}").write_bytes(content)
