"""Derived moments and forces are dashed wherever they are drawn, a prior's dotted, absent ones are not, and the page
says so first."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dynakin.report.chart import Panel
from dynakin.report.insights import in_short, insights
from dynakin.report.page import render_report
from dynakin.report.paper_figures.figures import save_figures
from dynakin.report.playback import playback
from dynakin.report.sections.forces import foot_section, wrench_section
from dynakin.report.sections.joints import moment_section
from dynakin.report.sections.methods import moment_part
from dynakin.report.sections.repetitions import side_repetitions
from dynakin.report.sections.section import Page
from dynakin.report.sections.work import asymmetry_section, power_section
from dynakin.results.estimate import Estimate
from dynakin.results.measures.mean_curves import mean_curves, signals
from dynakin.results.measures.metrics import compute_metrics
from dynakin.results.measures.repetitions import Found, Repetition
from dynakin.results.measures.sources import ABSENT, DERIVED, PRIOR, measured_moments
from dynakin.validation.methods import ComparedTrial
from support.estimates.walking import make_walker
from support.page import shown, unpacked

DERIVED_WORDS, PRIOR_WORDS = "derived from the motion", "prior: load sharing assumed"
DASHED, DOTTED = 'stroke-dasharray="36 26"', 'stroke-dasharray="10 22"'


@pytest.fixture(scope="module")
def walker() -> Estimate:
    """The left foot's second whole stance is off the plates."""
    return make_walker((2,))


@pytest.fixture(scope="module")
def metrics(walker: Estimate) -> dict[str, Any]:
    return compute_metrics(walker)


def dashes(panel: Panel) -> int:
    return panel.svg.count("stroke-dasharray")


def titled(panels: list[Panel], start: str) -> Panel:
    return next(panel for panel in panels if panel.title.startswith(start))


def with_source(estimate: Estimate, code: int, frames: slice) -> Estimate:
    """A planar estimate whose moments come from somewhere else for a time."""
    source = np.zeros(estimate.data["moments"].shape, dtype=np.uint8)
    source[frames, :4] = code
    data = estimate.data.assign(moment_source=(("time", "coordinate"), source))
    if code == ABSENT:
        data["moments"] = data["moments"].where(source != ABSENT)
    return replace(estimate, data=data)


def test_derived_stretches_are_dashed_in_every_panel(walker: Estimate, metrics: dict[str, Any]) -> None:
    whole = make_walker()
    for section, sure in (
        (
            moment_section(Page(walker, metrics)).parts[0],
            moment_section(Page(whole, compute_metrics(whole))).parts[0],
        ),
        (shown(power_section(Page(walker, metrics))), shown(power_section(Page(whole, compute_metrics(whole))))),
    ):
        assert dashes(titled(section.panels, "Knee")) == 1 and dashes(titled(sure.panels, "Knee")) == 0
    left = shown(foot_section(Page(walker, metrics))).parts[1].panels
    assert (
        dashes(titled(left, "Vertical")) == 1
        and dashes(titled(shown(foot_section(Page(walker, metrics))).parts[0].panels, "V")) == 0
    )
    assert dashes(titled(shown(wrench_section(Page(walker, metrics))).panels, "Vertical")) == 1
    for section in (
        moment_section(Page(walker, metrics)),
        shown(power_section(Page(walker, metrics))),
        shown(foot_section(Page(walker, metrics))),
    ):
        assert any(line.label == DERIVED_WORDS and line.dash == "dashed" for line in section.lines)
    assert not any(
        line.label == DERIVED_WORDS for line in shown(power_section(Page(whole, compute_metrics(whole)))).lines
    )


@pytest.mark.parametrize(("code", "pattern", "label"), [(DERIVED, DASHED, DERIVED_WORDS), (PRIOR, DOTTED, PRIOR_WORDS)])
def test_each_source_has_its_own_line_and_name(code: int, pattern: str, label: str) -> None:
    walker = make_walker((2,), code=code)
    page = Page(walker, compute_metrics(walker))
    moments, powers, feet = moment_section(page), shown(power_section(page)), shown(foot_section(page))
    panels = [titled(part.panels, "Knee") for part in (moments.parts[0], powers)]
    for panel in [*panels, titled(feet.parts[1].panels, "Vertical")]:
        assert panel.svg.count(pattern) == dashes(panel) == 1
    for section in (moments, powers, feet):
        marked = [line.label for line in section.lines if line.label in (DERIVED_WORDS, PRIOR_WORDS)]
        assert marked == [label]
    assert f"{['dashed', 'dotted'][code == PRIOR]}; no peak, work or mean curve holds them" in moments.text
    total = titled(shown(wrench_section(page)).panels, "Vertical")
    assert total.svg.count(DASHED) == 1  # the sum follows from the motion, however it is divided
    left_out = np.isnan(measured_moments(walker.data)[:, walker.coordinate_names.index("knee_angle_l")])
    np.testing.assert_array_equal(left_out, walker.data["foot_source"][:, 1] == code)


def test_a_stretch_that_is_not_measured_keeps_its_band_and_has_no_peak(
    walker: Estimate, metrics: dict[str, Any]
) -> None:
    knee = titled(moment_section(Page(walker, metrics)).parts[0].panels, "Knee")
    assert knee.note == "right 0.00 to 1.17; left 0.00 to 1.17"  # derived it would be 1.75
    band = re.findall(r'<path d="([^"]+)" class="spread" fill="#D55E00"', knee.svg)
    assert len(band) == 1 and band[0].count("M") == 1
    data = walker.data.copy(deep=True)
    data["moments_sd"][:] = np.where(data["moment_source"] == DERIVED, 500.0, 0.5)  # says how little is known there
    wide = replace(walker, data=data)
    assert titled(moment_section(Page(wide, metrics)).parts[0].panels, "Knee").svg.count('class="spread"') == 2
    assert titled(shown(foot_section(Page(walker, metrics))).parts[1].panels, "Vertical").note.startswith("peak 700 N")
    beside = make_walker((1, 2))
    found = compute_metrics(beside)
    assert "no peak" in titled(shown(foot_section(Page(beside, found))).parts[1].panels, "Vertical").note
    text = shown(asymmetry_section(Page(beside, found))).text
    assert "The left foot has no stance that is measured from touch-down to toe-off" in text
    assert shown(asymmetry_section(Page(beside, found))).tables[0].rows[0][1:] == ("–", "–")


def test_absent_legs_are_not_drawn_and_the_page_says_so_first() -> None:
    walker = make_walker((0, 1, 2, 3), code=ABSENT)
    data = walker.data.copy(deep=True)
    data["moment_source"][:, :3] = ABSENT
    data["moments"][:, :3] = np.nan
    gone = replace(walker, data=data)
    metrics = compute_metrics(gone)
    section = moment_section(Page(gone, metrics))
    assert section.text.startswith("Leg moments: absent in all 301 frames.")
    assert [panel.title for part in section.parts for panel in [*part.panels, *part.folded]] == ["Arm flex (+ flexion)"]
    assert "Absent in every frame: right knee and left knee." in section.text
    assert section.notes == (gone.messages[-1].text,)
    data["moment_source"][:], data["moments"][:] = ABSENT, np.nan
    nothing = replace(walker, data=data)
    found = compute_metrics(nothing)
    assert "muscles" not in moment_section(Page(nothing, found)).text
    assert moment_section(Page(nothing, found)).parts == [] and found["work"] == {}
    html = render_report(gone)
    summary = html[html.index('id="summary"') :]
    assert summary.index("Leg moments: absent in all 301 frames.") < summary.index("findings to look at")
    assert "joint moments" in in_short(insights(gone, metrics))


def test_the_film_dashes_what_is_derived(walker: Estimate) -> None:
    found = playback(walker)
    content = json.loads(str(found.data))
    frames = np.searchsorted(walker.time, np.array(content["time"]) - 1e-6)
    derived = unpacked(content["arrays"]["sources"])
    np.testing.assert_allclose(derived[:, 1], (frames >= 170) & (frames < 230), atol=1e-3)
    assert not derived[:, 0].any() and found.has_derived
    assert [entry["sourced"] for entry in content["arrows"]] == [False, False, True, True]
    html = render_report(walker)
    assert "A dashed arrow, and a moment with ≈, is derived from the motion" in html
    assert "setLineDash(entry.sourced" in html
    assert "A dashed arrow" not in render_report(make_walker()) and "A dotted arrow" not in html


def test_the_film_dots_a_prior() -> None:
    walker = make_walker((2,), code=PRIOR)
    found = playback(walker)
    assert found.has_prior and not found.has_derived
    content = json.loads(str(found.data))
    frames = np.searchsorted(walker.time, np.array(content["time"]) - 1e-6)
    for name, column in (("sources", 1), ("moment_sources", 1)):
        codes = unpacked(content["arrays"][name])
        np.testing.assert_allclose(codes[:, column], PRIOR * ((frames >= 170) & (frames < 230)), atol=1e-3)
    html = render_report(walker)
    assert "A dotted arrow, and a moment with ≈?, takes a prior" in html and "A dashed arrow" not in html
    assert "Those that take a prior (dotted) are in the files with their flag" in html


def test_mean_curves_say_how_many_cycles_are_left(walker: Estimate) -> None:
    time = walker.time
    cycles = tuple(Repetition("gait", "left", a, a + 99, float(time[a]), float(time[a + 99])) for a in (70, 170))
    own = signals(
        walker.coordinate_names, walker.is_rotation(), walker.data["coordinates"].values, measured_moments(walker.data)
    )
    curves = mean_curves(time, cycles, {"EKF": own}, 60.0)
    section = side_repetitions(walker, Found("gait", cycles, "2 gait cycles."), curves)
    knee = titled(section.parts[1].panels, "Knee")
    assert "left: 1 of 2 repetitions" in knee.note
    assert knee.title == "Knee (+ flexion)"
    gone = mean_curves(time, cycles[1:], {"EKF": [s for s in own if s.quantity != "knee_angle_r/moment"]}, 60.0)
    section = side_repetitions(walker, Found("gait", cycles[1:], "1 gait cycle."), gone)
    assert "No cycle is left of the moments of knee." in section.text
    assert all(not panel.title.startswith("Knee") for part in section.parts[1:] for panel in part.panels)


def test_planar_panels_dash_what_is_derived_and_leave_out_what_is_absent(estimate: Estimate) -> None:
    derived = with_source(estimate, DERIVED, slice(0, 300))
    section = moment_section(Page(derived, compute_metrics(derived)))
    knee, shoulder = titled(section.panels, "Knee"), titled(section.panels, "Shoulder")
    assert dashes(knee) == 1 and dashes(shoulder) == 0
    assert any(line.label == DERIVED_WORDS for line in section.lines)
    assert "derived from the motion in 300" in section.text
    absent = with_source(estimate, ABSENT, slice(None))
    section = moment_section(Page(absent, compute_metrics(absent)))
    assert "Knee" not in [panel.title for panel in section.panels]
    assert "knee" not in compute_metrics(absent)["peak_moments_per_kg"]
    data = estimate.data.copy(deep=True)
    data["wrench_measured"][100:200] = np.nan
    missing = replace(estimate, data=data)
    assert dashes(titled(shown(wrench_section(Page(missing, compute_metrics(missing)))).panels, "Vertical")) == 1


def test_moments_by_method_are_compared_where_measured_and_dashed_elsewhere(
    jointed: Estimate, comparison: ComparedTrial
) -> None:
    derived = with_source(jointed, DERIVED, slice(0, 600))
    data = derived.data.copy(deep=True)
    data["moments"][:600, :4] *= 3.0
    filtered = replace(comparison.methods[0], data=data, moments=data["moments"].values)
    estimates = {"paper": replace(derived, data=data)}
    trial = replace(comparison, methods=(filtered, *comparison.methods[1:]), estimates=estimates)
    panels = moment_part(trial, "m").panels
    assert dashes(panels[0]) > dashes(moment_part(comparison, "m").panels[0])
    knee = trial.methods[0].measured_moments()[:, trial.coordinate_names.index("knee")]
    assert np.isnan(knee[:600]).all() and np.isfinite(knee[600:]).all()
    assert "10.0 N m" in panels[0].note  # AT is 10 N m off where both are there, whatever is derived


def test_figures_for_papers_dash_what_is_derived(walker: Estimate, tmp_path: Path) -> None:
    written = {path.stem: path.read_text() for path in save_figures(walker, tmp_path / "a", ("svg",))}
    whole = {path.stem: path.read_text() for path in save_figures(make_walker(), tmp_path / "b", ("svg",))}
    for name in ("figure6_wrench", "figure7_knee_moment", "moments"):
        assert DERIVED_WORDS in written[name] and "stroke-dasharray" in written[name]
        assert DERIVED_WORDS not in whole[name]
    prior = {p.stem: p.read_text() for p in save_figures(make_walker((2,), code=PRIOR), tmp_path / "d", ("svg",))}
    assert PRIOR_WORDS in prior["figure7_knee_moment"] and DERIVED_WORDS not in prior["figure7_knee_moment"]
    data = walker.data.copy(deep=True)
    data["moments"][:] = np.nan
    gone = save_figures(replace(walker, data=data), tmp_path / "c", ("svg",))
    assert not {"figure7_knee_moment", "moments"} & {path.stem for path in gone}
