"""The stick figure: the numbers in the page are those of the estimate, and few enough."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import xarray as xr

from dynakin.report.body import chain_of
from dynakin.report.page import render_report
from dynakin.report.playback import playback
from dynakin.report.sections.section import Page
from dynakin.report.styles import segment_colours
from dynakin.results.estimate import Estimate
from dynakin.results.measures.angles import angle_columns, with_angles
from dynakin.results.measures.facing import facing
from dynakin.results.measures.pressure import floor_height
from support.estimates.synthetic import make_estimate
from support.page import unpacked


@pytest.fixture(scope="module")
def content(jointed: Estimate) -> dict[str, Any]:
    return dict(json.loads(str(playback(jointed).data)))


def test_positions_in_the_page_are_the_estimates(jointed: Estimate, content: dict[str, Any]) -> None:
    frames, arrays = np.searchsorted(jointed.time, np.array(content["time"]) - 1e-6), content["arrays"]
    assert len(frames) == 401  # thirty pictures a second out of a hundred
    for kind in ("measured", "estimated"):
        expected = 1000.0 * jointed.data[f"markers_{kind}"].values[frames] * [1.0, 1.0, 0.0]  # in the model's plane
        np.testing.assert_allclose(unpacked(arrays[kind])[:, 0::3], expected[:, :, 0], atol=0.51)
        np.testing.assert_allclose(unpacked(arrays[kind])[:, 1::3], expected[:, :, 1], atol=0.51)
        assert not unpacked(arrays[kind])[:, 2::3].any()
    assert np.isnan(unpacked(arrays["measured"])).any()  # gaps stay gaps
    knee = unpacked(arrays["points"])[:, 6]
    np.testing.assert_allclose(knee, 10.0 * np.array(content["time"]), atol=0.51)
    degrees = np.degrees(jointed.data["coordinates"].values[frames, :7])
    np.testing.assert_allclose(unpacked(arrays["angles"])[:, :7], degrees, atol=0.051)


def test_angles_are_those_that_were_asked_for(jointed: Estimate) -> None:
    asked = with_angles(jointed, {"knee": np.radians(5.0)}, "clinical")
    page, (names, columns, _) = playback(asked), angle_columns(facing(asked))
    content = json.loads(str(page.data))
    frames = np.searchsorted(jointed.time, np.array(content["time"]) - 1e-6)
    shown = unpacked(content["arrays"]["angles"])
    rows = {row["title"]: row["columns"][""] for row in page.rows if row["shown"][0]}
    for title, name in (("Knee", "knee_flexion"), ("Lumbar (+ flexion)", "trunk_flexion")):
        np.testing.assert_allclose(shown[:, rows[title]], columns[frames, names.index(name)], atol=0.051)
    assert page.note.startswith("Angles are those of angles.sto.")
    (whole,) = (
        each for each in Page(jointed, {}).curves if each.quantity == "lumbar" and each.method.startswith("EKF")
    )
    (turned,) = (each for each in Page(asked, {}).curves if each.quantity == "lumbar" and each.method.startswith("EKF"))
    np.testing.assert_allclose(turned.mean, -whole.mean)


def test_chain_joins_each_joint_to_the_next_and_the_last_to_its_farthest_marker(jointed: Estimate) -> None:
    carried = [replace(p, segment="forearm") if "RTOE" in p.name else p for p in jointed.parameters]
    chain = chain_of(replace(jointed, parameters=carried))
    assert [(b.start, b.end, b.segment) for b in chain.bones[:2]] == [(0, 1, "foot"), (1, 2, "shank")]
    assert (chain.bones[-1].start, chain.bones[-1].end, chain.bones[-1].segment) == (6, 7, "forearm")
    np.testing.assert_array_equal(
        chain.points[:, 7, :2], jointed.data["markers_estimated"].sel(marker="S1:RTOE").values[:, :2]
    )


def test_lost_frames_neither_choose_the_curve_nor_bend_it(jointed: Estimate) -> None:
    data = jointed.data.copy(deep=True)
    for name in ("coordinates", "markers_estimated", "joint_centres"):
        data[name].loc[{"time": data["time"][40:60]}] = np.nan
    data["lost"] = ("time", np.isin(np.arange(len(jointed.time)), np.arange(40, 60)))
    lost, whole = playback(replace(jointed, data=data)), playback(jointed)
    assert lost.curve_label.split(",")[0] == whole.curve_label.split(",")[0]
    assert "nan" not in lost.curve and lost.curve.startswith("M")
    assert chain_of(replace(jointed, data=data)).bones == chain_of(jointed).bones


def test_force_acts_where_its_moment_vanishes(jointed: Estimate) -> None:
    wrench = np.full((len(jointed.time), 6), np.nan)
    wrench[:, [0, 1, 5]] = [30.0, 600.0, -72.0]
    wrench[90:], wrench[60:90] = np.nan, [0.0, 1.0, np.nan, np.nan, np.nan, -1.0]
    data = jointed.data.assign(wrench_measured=(("time", "component"), wrench))
    found = json.loads(str(playback(replace(jointed, data=data)).data))
    point, force = (unpacked(found["arrays"][f"measured_{name}"]) for name in ("points", "forces"))
    x, y, z = 1e-3 * point[0]
    assert y == pytest.approx(floor_height(jointed), abs=5.1e-4) and z == 0.0
    assert x * 600.0 - y * 30.0 == pytest.approx(-72.0, abs=0.35)  # 600 N half a millimetre off
    np.testing.assert_allclose(force[0], [30.0, 600.0, 0.0], atol=0.02)
    assert np.isnan(point[20:, :2]).all()  # hardly loaded, not known


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
    view = json.loads(str(found.data))["view"]
    assert view["follow"] and 2 * view["radius"] < 3000


def test_without_joints_and_plates_there_are_markers_only(estimate: Estimate) -> None:
    empty = {str(n): estimate.data[n] * np.nan for n in estimate.data if "wrench" in str(n)}
    found = playback(replace(estimate, data=estimate.data.assign(empty)))
    content = json.loads(str(found.data))
    assert content["bones"] == [] and not found.has_reaction and len(content["markers"]) == 10
    html = render_report(replace(estimate, data=estimate.data.assign(empty)))
    assert "Ground reaction, measured" not in html and "The arrow is" not in html


def test_a_planar_figure_is_seen_from_the_right_in_its_segments_colours(
    jointed: Estimate, content: dict[str, Any]
) -> None:
    found = playback(jointed)
    assert len(content["bones"]) == 6  # the forearm carries no marker here
    assert [bone[2] for bone in content["bones"]] == list(found.colours.values())
    view = content["view"]
    assert (view["azimuth"], view["elevation"], view["turns"]) == (0, 0, False) and found.views == {}
    assert [row["title"] for row in found.rows][-2:] == [
        "Ground reaction, measured, N",
        "Ground reaction, estimated, N",
    ]


def test_player_can_be_used_by_keyboard_and_asks_for_reduced_motion(jointed: Estimate) -> None:
    html = render_report(jointed)
    assert '<input id="player-time" type="range" min="0" max="400"' in html
    assert '<button type="button">' in html and "prefers-reduced-motion: reduce" in html


def test_a_segment_has_one_colour_whatever_the_others() -> None:
    alone, together = segment_colours(["thigh"]), segment_colours(["foot", "thigh", "thigh_r", "tail"])
    assert alone["thigh"] == together["thigh"] == together["thigh_r"]
    assert len({together["foot"], together["thigh"], together["tail"]}) == 3


def test_a_motion_beyond_all_measure_has_few_ticks_and_one_frame_is_shown(estimate: Estimate) -> None:
    """0.1 asked for 6.8 TiB of ticks, and divided by the rate of a single frame."""
    far = estimate.data["markers_estimated"].copy(deep=True)
    far[5, 0, 0] = 1e9
    view = json.loads(str(playback(replace(estimate, data=estimate.data.assign(markers_estimated=far))).data))["view"]
    assert 2 * view["radius"] / view["square"] < 300
    one = estimate.data.isel(time=slice(0, 1))
    recording = replace(estimate.recording, time=estimate.time[:1], markers=estimate.recording.markers[:1], plates=())
    assert playback(replace(estimate, data=one, recording=recording)).last == 0
