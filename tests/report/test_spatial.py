"""The report of a body in space: right and left where they belong, every foot on its own, nothing hidden."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dynakin.report.chart import Bound, Line, chart
from dynakin.report.page import render_report
from dynakin.report.paper_figures.figures import save_figures
from dynakin.report.playback import playback
from dynakin.report.sections.forces import foot_section
from dynakin.report.sections.joints import angle_section, moment_section
from dynakin.report.sections.section import Page
from dynakin.report.sections.work import asymmetry_section, power_section
from dynakin.report.sides import joints_of
from dynakin.report.styles import SIDE_COLOURS, side_of
from dynakin.results.estimate import Estimate
from dynakin.results.measures.angles import with_angles
from dynakin.results.measures.metrics import compute_metrics
from support.estimates.spatial import MASS_KG, make_spatial
from support.page import shown, unpacked


@pytest.fixture(scope="module")
def spatial() -> Estimate:
    return make_spatial()


@pytest.fixture(scope="module")
def metrics(spatial: Estimate) -> dict[str, Any]:
    return compute_metrics(spatial)


@pytest.fixture(scope="module")
def html(spatial: Estimate) -> str:
    return render_report(spatial)


def test_right_and_left_stand_together_legs_first_and_what_is_locked_is_left_out(spatial: Estimate) -> None:
    found = [(joint.title, joint.region, joint.columns) for joint in joints_of(spatial)]
    assert found == [
        ("Hip flexion", "Legs", {"right": 2, "left": 3}),
        ("Knee angle", "Legs", {"right": 4, "left": 5}),
        ("Lumbar extension", "Trunk and head", {"": 6}),
        ("Arm flex", "Arms", {"right": 7, "left": 8}),
        ("Pelvis tilt", "Whole body", {"": 0}),
        ("Pelvis tx", "Whole body", {"": 1}),
    ]


def test_sides_are_read_from_names() -> None:
    assert [side_of(name) for name in ("thigh_r", "foot_left", "right_hand", "pelvis", "humeral")] == [
        "right",
        "left",
        "right",
        "",
        "",
    ]


def test_page_has_every_section_and_no_residual(html: str) -> None:
    for anchor in ("movement", "angles", "moments", "feet", "powers", "asymmetry", "mass-centre", "markers", "wrench"):
        assert f'id="{anchor}"' in html
    assert html.count("<canvas") == 1 and "<script src" not in html and "url(http" not in html
    assert len(html) < 1_000_000
    ids = re.findall(r' id="([^"]+)"', html)
    assert len(ids) == len(set(ids))


def test_angles_say_which_side_moved_how_far(spatial: Estimate) -> None:
    legs = angle_section(Page(spatial, {})).parts[0]
    knee = next(panel for panel in legs.panels if panel.title.startswith("Knee"))
    assert knee.title == "Knee angle (+ flexion)"
    assert knee.note == "right 0 to 80.0; left 0 to 40.0"
    assert knee.svg.count(SIDE_COLOURS["right"]) and knee.svg.count(SIDE_COLOURS["left"])


def test_angles_follow_the_zero_and_the_signs_that_were_asked_for(spatial: Estimate) -> None:
    zero = {"knee_angle_r": np.radians(10.0)}
    section = angle_section(Page(with_angles(spatial, zero, "clinical"), {}))
    knee = section.parts[0].panels[1]
    assert knee.note == "right −10.0 to 70.0; left 0 to 40.0"
    assert "standing zero" in section.text and "clinical" in section.text


def test_moments_are_per_kg_and_derived_ones_dashed(spatial: Estimate, metrics: dict[str, Any]) -> None:
    section = moment_section(Page(spatial, metrics))
    knee, hip = section.parts[0].panels[1], section.parts[0].panels[0]
    assert knee.note == "right −1.50 to 0.00; left −0.75 to 0.00"
    assert knee.title == "Knee (+ flexion)"
    assert "stroke-dasharray" in knee.svg and knee.svg.count("stroke-dasharray") == 1  # the left one only
    assert section.text.endswith(" Numbers above panels are from 2 s on.")  # the curves are from 0 s on
    assert "N m/kg</text>" in hip.svg
    assert section.text.startswith(
        "Leg moments: right: knee measured in 601 of 601 frames, hip measured in 551 and absent in 50; left: knee "
        "measured in 501 and derived from the motion in 100, hip measured in 451, derived from the motion in 100 and "
        "absent in 50."
    )
    assert hip.note == "right no whole measured stance; left no whole measured stance"
    assert any(line.label == "derived from the motion" for line in section.lines)
    assert not any("Pelvis" in panel.title for part in section.parts for panel in [*part.panels, *part.folded])


def test_feet_show_what_was_changed_in_place_of_a_residual(spatial: Estimate, metrics: dict[str, Any]) -> None:
    section = shown(foot_section(Page(spatial, metrics)))
    right, left = section.tables[0].rows
    assert right[0] == "Right foot, adjustment" and right[2] == "2.0"
    assert set(left[1:]) == {"0"}
    titles = [panel.title for panel in section.parts[0].panels]
    assert titles[1] == "Vertical force" and "Centre of pressure, forward" in titles
    assert "on the ground but not measured in 17 % of the frames" in section.parts[1].text


def test_work_and_symmetry_tables_hold_the_metrics(spatial: Estimate, metrics: dict[str, Any]) -> None:
    work = shown(power_section(Page(spatial, metrics))).tables[0]
    knee = next(row for row in work.rows if row[0] == "Knee")
    assert knee[1] == "right"
    assert float(knee[2]) == pytest.approx(metrics["work"]["knee_angle_r"]["positive_j"], rel=0.01)
    tables = {table.title: table for table in shown(asymmetry_section(Page(spatial, metrics))).tables}
    rows = {row[0]: row for row in tables["Legs: symmetry index, %"].rows}
    assert rows["Knee"][1] == "+67"  # (80 - 40) / 60
    assert rows["Hip flexion"][1] == "0"
    assert tables["Feet: symmetry index, %"].rows[0][1] == "0"


def test_film_holds_positions_forces_and_centres_of_pressure(spatial: Estimate) -> None:
    found = playback(spatial)
    content = json.loads(str(found.data))
    frames = np.searchsorted(spatial.time, np.array(content["time"]) - 1e-6)
    arrays = {name: unpacked(packed) for name, packed in content["arrays"].items()}
    expected = 1000.0 * spatial.data["markers_estimated"].values[frames].reshape(len(frames), -1)
    np.testing.assert_allclose(arrays["estimated"], expected, atol=0.51)
    np.testing.assert_allclose(
        arrays["estimated_points"], np.tile([50, 0, 100, 50, 0, -100], (len(frames), 1)), atol=0.51
    )
    np.testing.assert_allclose(arrays["estimated_forces"][:, [1, 4]], 0.5 * MASS_KG * 9.80665, atol=0.51)
    assert np.isnan(arrays["measured_points"][:, 3:]).any()  # the left foot is not always measured
    assert [entry["colour"] for entry in content["arrows"][2:]] == [SIDE_COLOURS["right"], SIDE_COLOURS["left"]]
    assert not content["view"]["follow"]
    knee = next(row for row in found.rows if row["title"] == "Knee angle")
    degrees = np.degrees(spatial.data["coordinates"].sel(coordinate="knee_angle_r").values[frames])
    np.testing.assert_allclose(arrays["angles"][:, knee["columns"]["right"]], degrees, atol=0.051)
    bones = {tuple(bone[:2]): bone[2] for bone in content["bones"]}
    assert (
        bones[0, 1] == SIDE_COLOURS[""] and bones[1, 3] == SIDE_COLOURS["right"] and bones[2, 4] == SIDE_COLOURS["left"]
    )


def test_who_walks_is_followed() -> None:
    view = json.loads(str(playback(make_spatial(walk_m=4.0)).data))["view"]
    assert view["follow"] and view["radius"] < 1500


def test_film_can_be_used_by_keyboard(html: str) -> None:
    assert '<canvas class="stage" tabindex="0"' in html and "ArrowLeft" in html
    assert '<input id="player-time" type="range"' in html and html.count("data-azimuth=") == 6
    assert "prefers-reduced-motion: reduce" in html


def test_paper_figures_are_drawn_with_sides(spatial: Estimate, tmp_path: Path) -> None:
    written = save_figures(spatial, tmp_path, ("svg",))
    angles = next(path for path in written if "angles" in path.name).read_text()
    assert "Knee angle, deg" in angles and "right" in angles and "Neck" not in angles


def test_a_chart_keeps_peaks_gaps_and_far_bands_in_its_frame() -> None:
    time = np.arange(5000) / 100.0
    values = np.sin(time)
    values[2345], values[3000:3100] = 9.0, np.nan
    panel = chart("A <b>", "mm", time, [Line(values, "#123456", sd=np.full(5000, 50.0))], bounds=[Bound(8.0, "upper")])
    assert "A &lt;b&gt; in mm over time" in panel.svg and "upper 8" in panel.svg
    line = re.search(r'<path d="([^"]+)" stroke="#123456"', panel.svg)
    assert line is not None and line.group(1).count("M") == 2  # one gap
    heights = [0.0]
    for part in line.group(1).split("M")[1:]:
        start, steps = part.split("l")
        numbers = [int(n) for n in re.findall(r"-?\d+", steps)]
        heights += list(float(start.split()[1]) + np.cumsum(numbers[1::2]))
    assert min(heights[1:]) < 500 and max(heights) < 1200
    assert len(panel.svg) < 6000
