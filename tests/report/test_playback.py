"""The stick figure: the numbers in the page are those of the estimate, and few enough."""

from __future__ import annotations

import base64
import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import xarray as xr

from dynakin.report.body import chain_of, reaction
from dynakin.report.colours import segment_colours
from dynakin.report.page import render_report
from dynakin.report.playback import playback
from dynakin.results.estimate import Estimate
from support.estimates.synthetic import make_estimate


def unpacked(packed: dict[str, Any]) -> np.ndarray:
    numbers = np.frombuffer(base64.b64decode(packed["values"]), dtype="<i2").astype(float)
    numbers[numbers == -32768] = np.nan
    return packed["scale"] * numbers.reshape(-1, packed["columns"])


@pytest.fixture(scope="module")
def content(jointed: Estimate) -> dict[str, Any]:
    return dict(json.loads(str(playback(jointed).data)))


def test_positions_in_the_page_are_the_estimates(jointed: Estimate, content: dict[str, Any]) -> None:
    frames = np.searchsorted(jointed.time, np.array(content["time"]) - 1e-6)
    assert len(frames) == 401  # thirty pictures a second out of a hundred
    for kind in ("measured", "estimated"):
        expected = 1000.0 * jointed.data[f"markers_{kind}"].values[frames][:, :, :2] * [1.0, -1.0]
        np.testing.assert_allclose(unpacked(content[kind]), expected.reshape(len(frames), -1), atol=0.1)
    assert np.isnan(unpacked(content["measured"])).any()  # gaps stay gaps
    knee = unpacked(content["points"])[:, 4]
    np.testing.assert_allclose(knee, 10.0 * np.array(content["time"]), atol=0.1)
    degrees = np.degrees(jointed.data["coordinates"].values[frames, :7])
    np.testing.assert_allclose(unpacked(content["angles"])[:, :7], degrees, atol=0.01)


def test_chain_joins_each_joint_to_the_next_and_the_last_to_its_farthest_marker(jointed: Estimate) -> None:
    carried = [replace(p, segment="forearm") if "RTOE" in p.name else p for p in jointed.parameters]
    chain = chain_of(replace(jointed, parameters=carried))
    assert [(b.start, b.end, b.segment) for b in chain.bones[:2]] == [(0, 1, "foot"), (1, 2, "shank")]
    assert (chain.bones[-1].start, chain.bones[-1].end, chain.bones[-1].segment) == (6, 7, "forearm")
    np.testing.assert_array_equal(
        chain.points[:, 7, :2], jointed.data["markers_estimated"].sel(marker="S1:RTOE").values[:, :2]
    )


def test_force_acts_where_its_moment_vanishes() -> None:
    wrench = np.array([[30.0, 600.0, 0, 0, 0, -72.0], [0.0, 1.0, 0, 0, 0, -1.0], [np.nan] * 6])
    point, force = reaction(wrench, -0.05)
    x, y = point[0]
    assert y == -0.05
    assert x * 600.0 - y * 30.0 == pytest.approx(-72.0)
    np.testing.assert_array_equal(force[0], [30.0, 600.0])
    assert np.isnan(point[1:]).all()  # hardly loaded, not known


def test_long_recordings_are_thinned_and_walkers_followed() -> None:
    made = make_estimate(2.0, gaps=False)
    frames = 120_000
    dims = {name: size for name, size in made.data.sizes.items() if name != "time"}
    pick = np.arange(frames) % made.data.sizes["time"]
    long = made.data.isel(time=pick).assign_coords(time=np.arange(frames) / 100.0)
    walk = xr.DataArray(np.linspace(0.0, 9.0, frames), dims="time") * xr.DataArray([1.0, 0.0, 0.0], dims="axis")
    long = long.assign({f"markers_{k}": long[f"markers_{k}"] + walk for k in ("measured", "estimated")})
    assert dims["marker"] == 10
    found = playback(replace(made, data=long))
    assert len(found.data) < 1_000_000
    assert json.loads(str(found.data))["follow"]
    assert found.view[2] < 3000.0


def test_without_joints_and_plates_there_are_markers_only(estimate: Estimate) -> None:
    empty = {str(n): estimate.data[n] * np.nan for n in estimate.data if "wrench" in str(n)}
    found = playback(replace(estimate, data=estimate.data.assign(empty)))
    assert found.bones == [] and not found.has_reaction and len(found.markers) == 10
    html = render_report(replace(estimate, data=estimate.data.assign(empty)))
    assert "Ground reaction, measured" not in html and 'class="arrow' not in html


def test_player_can_be_used_by_keyboard_and_asks_for_reduced_motion(jointed: Estimate) -> None:
    html = render_report(jointed)
    assert '<input id="player-time" type="range" min="0" max="400"' in html
    assert '<button type="button">' in html and "prefers-reduced-motion: reduce" in html
    assert html.count('class="bone"') == 6  # the forearm carries no marker here


def test_a_segment_has_one_colour_whatever_the_others() -> None:
    alone, together = segment_colours(["thigh"]), segment_colours(["foot", "thigh", "thigh_r", "tail"])
    assert alone["thigh"] == together["thigh"] == together["thigh_r"]
    assert len({together["foot"], together["thigh"], together["tail"]}) == 3


def test_a_motion_beyond_all_measure_has_few_ticks_and_one_frame_is_shown(estimate: Estimate) -> None:
    """0.1 asked for 6.8 TiB of ticks, and divided by the rate of a single frame."""
    far = estimate.data["markers_estimated"].copy(deep=True)
    far[5, 0, 0] = 1e9
    shown = playback(replace(estimate, data=estimate.data.assign(markers_estimated=far)))
    assert len(shown.ticks_mm) < 300
    one = estimate.data.isel(time=slice(0, 1))
    recording = replace(estimate.recording, time=estimate.time[:1], markers=estimate.recording.markers[:1], plates=())
    assert playback(replace(estimate, data=one, recording=recording)).last == 0
