"""A person in space seen as a markerless system does: points at joint centres, with the marker set for them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt

from dynakin.bindings import _core
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.recordings.recording import Recording

Array = npt.NDArray[np.float64]

JOINTS = {
    "hip": ("thigh", "pelvis"),
    "knee": ("shank", "thigh"),
    "ankle": ("foot", "shank"),
    "shoulder": ("upper_arm", "thorax"),
    "elbow": ("forearm", "upper_arm"),
    "wrist": ("hand", "forearm"),
}
"""Joint -> segment that hangs by it, and the part of the body that its point is a marker of."""
FOOT = {"heel": (-0.05, -0.06, 0.0), "toe": (0.16, -0.06, 0.0)}
"""Points on the foot, m from the ankle, foot's axes."""


def marker_set(folder: Path, foot: bool) -> Path:
    """A marker set file of these points."""
    names = {**{name: segment for name, (_, segment) in JOINTS.items()}, **({name: "foot" for name in FOOT if foot})}
    text = ["schema_version = 1", 'name = "centres"']
    text += ['heel_toe = ["HEEL", "TOE"]'] if foot else []
    for name, segment in names.items():
        text += [
            "[[markers]]",
            f'name = "{name.upper()}"',
            f'segment = "{segment}"',
            f'right = ["R_{name}"]',
            f'left = ["L_{name}"]',
            "variance = 1e-3",
            "soft_tissue_mm = 5",
        ]
    text += ["[landmarks]", *(f'{name} = [{{ mean = ["{name.upper()}"] }}]' for name in names)]
    path = folder / "centres.toml"
    path.write_text("\n".join(text))
    return path


def seen(initial: CalibratedModel, x: Array, time: Array, foot: bool) -> Recording:
    """The recording of states (T, n) of a measured model."""
    core = _core.Model(initial.spec)
    poses = [_core.segment_poses(core, row) for row in x]
    found: dict[str, Array] = {}
    for side in "rl":
        for joint, (segment, _) in JOINTS.items():
            k = core.segment_names.index(f"{segment}_{side}")
            found[f"{side.upper()}_{joint}"] = np.array([p[k] for _, p in poses])
        for name, place in FOOT.items() if foot else ():
            k = core.segment_names.index(f"foot_{side}")
            found[f"{side.upper()}_{name}"] = np.array([p[k] + R[k] @ np.array(place) for R, p in poses])
    return Recording("centres", None, time, tuple(found), np.stack(list(found.values()), axis=1))
