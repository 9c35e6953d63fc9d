"""Recordings and settings that are made in Python: what is no number, or contradicts itself, ends in one line."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import dynakin
from dynakin.errors import ConfigError, DynakinError, ModelError, RecordingError
from dynakin.recordings.recording import Recording
from dynakin.settings.model import OpenSimOptions
from dynakin.simulation.trial import simulate_squat


@pytest.fixture(scope="module")
def squat() -> Recording:
    return simulate_squat(seed=1, duration_s=5.0).recording


def test_lists_are_arrays(squat: Recording) -> None:
    plates = [replace(plate, force=plate.force.tolist()) for plate in squat.plates]
    made = replace(
        squat, time=squat.time.tolist(), markers=squat.markers.astype(">f4").tolist(), plates=plates,
        marker_names=list(squat.marker_names),
    )  # fmt: skip
    np.testing.assert_allclose(made.markers, squat.markers, atol=1e-6)
    np.testing.assert_array_equal(made.total_wrench(), squat.total_wrench())
    assert made.markers.dtype == np.dtype(float) and made.marker_names == squat.marker_names


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda r: {"markers": np.ma.masked_array(r.markers)}, "markers is a masked array, expected one with NaN"),
        (lambda r: {"markers": r.markers.astype(complex)}, "markers is an array of complex128, expected an array of n"),
        (lambda r: {"markers": r.markers.astype(object)}, "markers is an array of object"),
        (lambda r: {"markers": [[1.0], [1.0, 2.0]]}, "markers is a list, expected an array of numbers"),
        (lambda r: {"time": r.time.astype("datetime64[s]")}, "time is an array of datetime64"),
        (lambda r: {"time": r.time[:, None]}, r"time has shape \(501, 1\), expected"),
        (lambda r: {"plates": None}, "plates is None, expected a tuple of plates"),
        (lambda r: {"plates": ("plate 1",)}, "plates holds 'plate 1', expected plates only"),
        (lambda r: {"marker_names": (r.marker_names[1], *r.marker_names[1:])}, "is there more than once"),
        (lambda r: {"marker_names": range(len(r.marker_names))}, "marker_names holds 0, expected names only"),
    ],
)  # fmt: skip
def test_what_is_no_recording_is_refused(squat: Recording, change: Any, said: str) -> None:
    with pytest.raises(RecordingError, match=said):
        replace(squat, **change(squat))


def test_moments_in_another_unit_than_the_place_of_the_force_are_refused(squat: Recording) -> None:
    first, second = squat.plates
    with pytest.raises(
        RecordingError, match=r"plate 2 at frame 1 \(0 s\) has a moment of .*, expected both|1000 times"
    ):
        squat.with_plates((first, replace(second, moment=1000.0 * second.moment)))
    squat.with_plates((first, replace(second, cop=np.full_like(second.cop, np.nan))))  # nothing to compare with


@pytest.mark.parametrize(
    ("made", "kind", "said"),
    [
        (lambda: dynakin.run(None), ConfigError, "run: trial is of type NoneType, expected a file"),  # type: ignore[arg-type]
        (lambda: dynakin.run(3), ConfigError, "trial is of type int"),  # type: ignore[arg-type]
        (lambda: dynakin.read(["a"]), RecordingError, r"read: found \['a'\], forces None, expected names of files"),  # type: ignore[arg-type]
        (lambda: dynakin.read("a.trc", 3), RecordingError, "forces 3, expected names of files"),  # type: ignore[arg-type]
        (lambda: dynakin.load_model(None), ModelError, "found None, expected the name of a model"),  # type: ignore[arg-type]
        (lambda: dynakin.Bounds(length_fraction=-0.2), ConfigError, "bounds: length_fraction: .* greater than 0"),
        (lambda: dynakin.Priors(unknown=1.0), ConfigError, "priors: unknown key 'unknown'; expected keys"),  # type: ignore[call-arg]
        (lambda: dynakin.Noise(marker_sd_m=True), ConfigError, "marker_sd_m: expected a number, found True"),
        (lambda: OpenSimOptions(lightest_share=2.0), ConfigError, "lightest_share"),
        (lambda: dynakin.Subject(mass_kg=True), ModelError, "subject: mass_kg: expected a number, found True"),
    ],
)
def test_what_is_no_setting_is_refused(made: Any, kind: type[DynakinError], said: str) -> None:
    with pytest.raises(kind, match=said):
        made()


def test_truth_values_are_what_they_are_elsewhere() -> None:
    assert OpenSimOptions(share_sides=False).share_sides is False
