"""Coordinates that an .osim locks, and a person who moves them."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from dynakin.bindings import _core
from dynakin.filter.uncertainty.geometry import BLOCKS
from dynakin.filter.uncertainty.locked import with_locked
from dynakin.filter.uncertainty.systematic import Systematic
from dynakin.model.spec import free_coordinates
from dynakin.settings.noise import Noise
from support.systematic_leg import (
    CONTACT,
    Q,
    calibrated,
    spec,
)

Array = npt.NDArray[np.float64]


def locked_leg(turning_rad: Array) -> tuple[Any, xr.Dataset]:
    """The leg with a hip that its file does not let rotate, and a run over markers of a person who does so: the filter
    has everything else right."""
    subject, open_model = calibrated(), _core.Model(spec())
    subject.spec.coordinates = [_core.CoordinateSpec(c.name, c.value, c.name == "turn") for c in spec().coordinates]
    model = _core.Model(subject.spec)
    subject.names, subject.x0 = tuple(model.layout.names), model.initial_state()
    subject.sd0 = np.zeros(len(subject.names))
    subject.lower, subject.upper = np.full(27, -np.inf), np.full(27, np.inf)
    free, time = free_coordinates(subject.spec), np.arange(len(turning_rad)) / 100.0
    frames, posture = len(time), np.where(np.arange(10) == 8, 0.0, Q)
    state = np.tile(np.r_[posture[free], np.zeros(18)], (frames, 1))
    seen = np.array(
        [_core.marker_positions(open_model, np.r_[posture + a * np.eye(10)[8], np.zeros(20)]) for a in turning_rad]
    )
    has = np.array([_core.marker_positions(model, x) for x in state])
    each = {"coordinate": [c.name for c in subject.spec.coordinates]}
    data = xr.Dataset(
        {
            "state": (("time", "element"), state),
            "markers_measured": (("time", "marker", "axis"), seen),
            "markers_estimated": (("time", "marker", "axis"), has),
            "verdict": (("time", "sensor"), np.zeros((frames, 13), dtype=np.uint8)),
            "lost": ("time", np.zeros(frames, dtype=bool)),
            "foot_wrench": (("time", "foot", "component"), np.tile(CONTACT, (frames, 1, 1))),
            **{f"{b}_sd": (("time", "coordinate"), np.tile(0.01 * (np.arange(10) != 8), (frames, 1))) for b in BLOCKS},
        },
        coords=each
        | {
            "time": time,
            "coordinate_type": ("coordinate", ["translation"] * 3 + ["rotation"] * 7),
            "foot_segment": ("foot", ["shank"]),
        },
    )
    return subject, data


def test_what_a_person_moves_of_a_locked_coordinate_is_found_said_and_in_the_deviations() -> None:
    turning = np.radians(8.0) * np.sin(2.0 * np.pi * np.arange(150) / 100.0)
    subject, data = locked_leg(turning)
    found, (said,) = with_locked(data, subject, Systematic(subject, Noise()), "person.osim")
    assert said.level == "warning" and said.topic == "scaling"
    assert "person.osim locks turn, " in said.text and " 5 deg (root mean square)" in said.text
    sd = found["coordinates_sd"].sel(coordinate="turn").values
    assert np.abs(sd - turning.std()).mean() < 0.4 * turning.std()
    on_neighbours = found["coordinates_sd"].sel(coordinate=["flexion", "adduction", "knee"])
    assert on_neighbours.max() > 0.02 and (found["moments_sd"] >= data["moments_sd"]).all()


def test_a_locked_coordinate_that_stands_still_is_not_accused() -> None:
    """Skin moves a thigh's markers against the pelvis by as much."""
    subject, data = locked_leg(np.radians(1.0) * np.sin(2.0 * np.pi * np.arange(150) / 100.0))
    found, said = with_locked(data, subject, Systematic(subject, Noise()), "person.osim")
    assert not said
    others = [name for name in data["coordinate"].values if name != "turn"]
    for block in BLOCKS:
        xr.testing.assert_allclose(*(each[f"{block}_sd"].sel(coordinate=others) for each in (found, data)))
    turned = found["coordinates_sd"].sel(coordinate="turn")
    assert turned.min() > 0.003 and turned.max() < 0.02  # but what its markers show is no more than that


def test_a_coordinate_that_is_locked_at_a_wrong_value_is_said() -> None:
    """It does not move, but the file's places of markers tell."""
    subject, data = locked_leg(np.full(60, 0.2))
    found, (said,) = with_locked(data, subject, Systematic(subject, Noise()), "person.osim")
    assert said.level == "warning" and "person.osim locks turn 11 deg from where the markers show" in said.text
    others = found["coordinates_sd"].sel(coordinate=["flexion", "adduction", "knee"])
    assert (others < 0.011).all()  # an angle's deviation is without its zero


def test_a_model_that_locks_nothing_is_left_alone() -> None:
    _, data = locked_leg(np.zeros(50))
    whole = calibrated()
    assert with_locked(data, whole, Systematic(whole, Noise()), "person.osim") == (data, [])
