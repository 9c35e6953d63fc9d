"""Parameters identified on one trial and judged on another: frozen, and blind for the plates they are judged by."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from dynakin.bindings import _core
from dynakin.errors import LostError, ModelError, RecordingError
from dynakin.recordings.recording import Plate, Recording
from dynakin.simulation.output import SimulatedTrial
from dynakin.validation.case import Setup
from dynakin.validation.freeze import final_values, freeze, initial_values
from dynakin.validation.held_out import IdentifyingTrial, halves, identify_on, judge, predict_blind


@pytest.fixture(scope="module")
def parts(simulated: SimulatedTrial) -> tuple[Recording, Recording]:
    return halves(simulated.recording)


@pytest.fixture(scope="module")
def identified(parts: tuple[Recording, Recording], setup: Setup) -> IdentifyingTrial:
    return identify_on(parts[0], setup, same_recording=True)


def with_other_plates(recording: Recording) -> Recording:
    def other(plate: Plate) -> Plate:
        return replace(plate, force=2.0 * plate.force + 100.0, moment=-plate.moment)

    return recording.with_plates(tuple(other(plate) for plate in recording.plates))


def test_halves_share_no_frame_and_leave_none_out(
    simulated: SimulatedTrial, parts: tuple[Recording, Recording]
) -> None:
    assert np.array_equal(np.concatenate([part.time for part in parts]), simulated.recording.time)
    with pytest.raises(RecordingError, match="too few to halve"):
        halves(simulated.recording.window(0.0, 0.02))


def test_frozen_model_estimates_neither_lengths_nor_inertia_and_has_the_values(identified: IdentifyingTrial) -> None:
    values = final_values(identified.estimates["default"])
    frozen = freeze(identified.initial, values, {"knee": 0.3})
    model = _core.Model(frozen.spec)
    assert not any(name.startswith(("length/", "inertia/")) for name in model.layout.names)
    assert frozen.names == tuple(model.layout.names)
    assert {len(frozen.names)} == {len(v) for v in (frozen.x0, frozen.sd0, frozen.lower, frozen.upper, frozen.table)}
    thigh = next(segment for segment in model.spec.segments if segment.name == "thigh")
    assert thigh.inertia[0] == values["inertia/thigh/mass"]
    length = next(entry for entry in model.spec.parameters if entry.name == "thigh")
    assert length.value == values["length/thigh"] != identified.initial.plan.geometry.lengths["thigh"]
    assert frozen.x0[frozen.names.index("knee")] == 0.3
    place = "marker/" + frozen.spec.markers[0].name + "/x"
    assert frozen.x0[frozen.names.index(place)] == values[place]


def test_frozen_at_its_own_start_the_model_says_what_it_said(identified: IdentifyingTrial) -> None:
    initial = identified.initial
    frozen = freeze(initial, initial_values(initial), {})
    ours, theirs = _core.Model(frozen.spec), _core.Model(initial.spec)
    assert np.allclose(_core.marker_positions(ours, frozen.x0), _core.marker_positions(theirs, initial.x0))
    assert np.allclose(_core.wrench(ours, frozen.x0), _core.wrench(theirs, initial.x0))


def test_predictions_do_not_depend_on_the_plates_that_judge_them(
    identified: IdentifyingTrial, parts: tuple[Recording, Recording]
) -> None:
    second = parts[1]
    seen, other = predict_blind(identified, second), predict_blind(identified, with_other_plates(second))
    without = predict_blind(identified, replace(second, plates=()))
    assert list(seen.wrenches) == list(other.wrenches)
    for method, wrench in seen.wrenches.items():
        assert np.array_equal(wrench, other.wrenches[method], equal_nan=True), method
        assert np.array_equal(wrench, without.wrenches[method], equal_nan=True), method


def test_every_method_is_judged_in_every_component(
    identified: IdentifyingTrial, parts: tuple[Recording, Recording]
) -> None:
    blind = predict_blind(identified, parts[1])
    rows = judge(blind, parts[1])
    assert [row.quantity for row in rows[:: len(blind.wrenches)]] == ["fx", "fy", "mz"]
    assert {row.method for row in rows} >= {
        "EKF (default), identified",
        "EKF (default), table",
        "AT (6 Hz)",
        "classical (6 Hz), least squares in bounds",
        "classical (6 Hz), inertia of EKF (default)",
        "persistence: last",
    }
    last = next(row for row in rows if (row.quantity, row.method) == ("fy", "persistence: last"))
    plates = parts[1].total_wrench()  # the simulated laboratory's vertical is found; forces only turn with it
    vertical = blind.start.ground.wrench_to_ground(plates)[:, 1]
    window = parts[1].time >= parts[1].time[0] + 2.0 - 1e-9
    assert last.rms.mean == pytest.approx(np.sqrt(np.mean((vertical[window] - identified.wrench[-1, 1]) ** 2)))


def test_a_trial_without_plates_cannot_judge(identified: IdentifyingTrial, parts: tuple[Recording, Recording]) -> None:
    bare = replace(parts[1], plates=())
    with pytest.raises(RecordingError, match="no force plates"):
        judge(predict_blind(identified, bare), bare)


def test_a_marker_that_the_judging_trial_lacks_is_missing_not_zero(
    identified: IdentifyingTrial, parts: tuple[Recording, Recording]
) -> None:
    gone = identified.initial.recorded_markers[8]
    kept = [k for k, name in enumerate(parts[1].marker_names) if name != gone]
    fewer = replace(
        parts[1],
        marker_names=tuple(parts[1].marker_names[k] for k in kept),
        markers=np.ascontiguousarray(parts[1].markers[:, kept]),
    )
    wrench = predict_blind(identified, fewer).wrenches["EKF (default), identified"]
    assert np.isfinite(wrench[:, [0, 1, 5]]).all()


def test_a_trial_in_which_a_filter_lost_the_person_neither_teaches_nor_judges(
    identified: IdentifyingTrial, parts: tuple[Recording, Recording], setup: Setup
) -> None:
    """Three seconds of six with every marker but the feet's under another one's label."""

    def mislabelled(part: Recording) -> Recording:
        markers = part.markers.copy()
        others = [k for k, n in enumerate(part.marker_names) if not n.endswith(("toe", "5meta", "calc"))]
        markers[200:500, others] = np.roll(markers[200:500][:, others], 5, axis=1)
        return replace(part, markers=markers)

    # what the labels show by themselves is refused before anybody is lost
    with pytest.raises((LostError, ModelError), match=r"first half: EKF \(default\): the person was lost|look swapped"):
        identify_on(mislabelled(parts[0]), setup, same_recording=True)
    lost = r"second half: EKF \(default\), identified: the person was lost|look swapped"
    with pytest.raises((LostError, ModelError), match=lost):
        predict_blind(identified, mislabelled(parts[1]))
