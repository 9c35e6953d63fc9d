"""Markers that move on their segments, beside the sizes that are known of skin."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import xarray as xr

from dynakin.model.markers.marker_set import available_marker_sets, load_marker_set
from dynakin.results.estimate import Estimate
from dynakin.results.measures.soft_tissue import displacements, published_amplitude_mm, soft_tissue
from dynakin.simulation.bodies.marker_rows import OPENCAP, PLUG_IN_GAIT
from dynakin.simulation.sensors.sensed_markers import regions

KNEE = "S1:RKNE"


def moving(estimate: Estimate, x: np.ndarray, y: np.ndarray) -> Estimate:
    """The same with the knee marker's place moving by these, m, about 5 and 8 cm."""
    state = estimate.data["state"].copy(deep=True)
    state.loc[{"element": f"marker/{KNEE}/x"}] = 0.05 + x
    state.loc[{"element": f"marker/{KNEE}/y"}] = 0.08 + y
    parameters = [
        replace(p, initial=0.05 if p.name.endswith("/x") else 0.08) if p.name.startswith(f"marker/{KNEE}/") else p
        for p in estimate.parameters
    ]
    return replace(estimate, data=estimate.data.assign(state=state), parameters=parameters)


def test_displacement_is_the_distance_from_the_mean_place(estimate: Estimate) -> None:
    window = (estimate.time >= 2.0) & (estimate.time < 12.0)
    phase = 2.0 * np.pi * estimate.time / 2.0
    made = moving(estimate, 0.003 + 0.010 * np.cos(phase), 0.004 + 0.010 * np.sin(phase))
    found = displacements(made, window)[KNEE]
    assert (found.rms, found.largest, found.offset) == pytest.approx((10.0, 10.0, 5.0))
    assert (found.segment, found.expected, found.source) == ("thigh", 18.0, "published: knee")


def test_a_marker_that_moves_too_far_is_named_with_both_sizes(estimate: Estimate) -> None:
    window = estimate.time >= 2.0
    swing = np.sin(2.0 * np.pi * estimate.time / 2.0)
    assert soft_tissue(moving(estimate, 0.035 * swing, 0.0 * swing), window)["verdict"] == ""
    block = soft_tissue(moving(estimate, 0.052 * swing, 0.0 * swing), window)
    assert block["verdict"].startswith("S1:RKNE moves 52 mm on the thigh (usual 18 mm): more than soft tissue does")
    assert [name for name, marker in block["markers"].items() if marker["exceeds"]] == [KNEE]


def test_frames_without_the_marker_and_outside_the_window_do_not_count(estimate: Estimate) -> None:
    gap = (estimate.time > 5.0) & (estimate.time < 6.0)
    made = moving(estimate, np.where(gap | (estimate.time < 2.0), 0.5, 0.0), np.zeros(len(estimate.time)))
    measured = estimate.data["markers_measured"].copy(deep=True)
    measured.loc[{"marker": KNEE}] = np.where(gap[:, None], np.nan, measured.sel(marker=KNEE).values)
    made = replace(made, data=made.data.assign(markers_measured=measured))
    assert displacements(made, estimate.time >= 2.0)[KNEE].largest == pytest.approx(0.0, abs=1e-9)
    assert displacements(made, gap)[KNEE].largest is None


@pytest.mark.parametrize(
    ("declared_mm", "expected_mm", "by"),
    [(11.0, 18.0, "published: knee"), (18.5, 18.5, "declared to the filter")],
)
def test_a_block_of_soft_tissue_is_added_and_the_larger_size_counts(
    estimate: Estimate, declared_mm: float, expected_mm: float, by: str
) -> None:
    still = moving(estimate, np.zeros(len(estimate.time)), np.zeros(len(estimate.time)))
    swing = 0.038 * np.sin(2.0 * np.pi * estimate.time / 2.0)
    elements = [str(name) for name in still.data["element"].values] + [f"soft_tissue/{KNEE}/y"]
    state = np.column_stack([still.data["state"].values, swing])
    data = still.data.drop_vars(["state", "state_sd"]).drop_vars("element")
    data = data.assign_coords(element=elements).assign(state=(("time", "element"), state))
    amplitude = np.where(data["marker"].values == KNEE, 1e-3 * declared_mm, 0.2)
    made = replace(still, data=data.assign(soft_tissue_amplitude=xr.DataArray(amplitude, dims="marker")))
    found = displacements(made, (estimate.time >= 2.0) & (estimate.time < 12.0))[KNEE]
    assert found.largest == pytest.approx(38.0) and found.expected == pytest.approx(expected_mm)
    assert found.exceeds() and found.source == by


@pytest.mark.parametrize(("markers", "names"), [(OPENCAP, "opencap-all"), (PLUG_IN_GAIT, "plug-in-gait")])
def test_a_marker_has_the_size_that_the_simulator_draws_from(markers: Any, names: str) -> None:
    for row in markers.rows:
        found = published_amplitude_mm(markers.name(row, "right"), row.part)
        assert found is not None and found[0] == pytest.approx(1000.0 * regions()[row.region].amplitude_m), row.stem


@pytest.mark.parametrize("name", available_marker_sets())
def test_every_marker_of_the_sets_has_a_size(name: str) -> None:
    for marker in load_marker_set(name).markers:
        if not marker.landmark_only:
            aliases = (*marker.right, *marker.left, *marker.centre)
            assert all(published_amplitude_mm(alias, marker.segment) for alias in aliases), marker.name


def test_an_unknown_segment_declares_nothing(estimate: Estimate) -> None:
    assert published_amplitude_mm("HAT", "tail") is None
    parameters = [replace(p, segment="tail") if p.kind == "marker" else p for p in estimate.parameters]
    block = soft_tissue(replace(estimate, parameters=parameters), estimate.time >= 2.0)
    assert block["markers"][KNEE]["expected_mm"] is None and not block["markers"][KNEE]["exceeds"]
    assert block["verdict"] == ""
