"""Findings on adaptation, bounds and soft tissue: their words and how much they matter."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from dynakin.messages import TOPICS, Topic, note, warning
from dynakin.report.findings import forces
from dynakin.report.findings.finding import Insight
from dynakin.report.findings.said import warned
from dynakin.report.insights import insights
from dynakin.results.estimate import Estimate
from dynakin.results.measures.metrics import compute_metrics
from dynakin.results.measures.soft_tissue import marker_sites
from dynakin.results.records import Event


def found(estimate: Estimate) -> dict[str, Insight]:
    return {insight.title: insight for insight in insights(estimate, compute_metrics(estimate))}


def with_element(estimate: Estimate, name: str, path: np.ndarray) -> Estimate:
    state = estimate.data["state"].copy(deep=True)
    state.loc[{"element": name}] = path
    return replace(estimate, data=estimate.data.assign(state=state))


def with_error(estimate: Estimate, component: str, error: np.ndarray) -> Estimate:
    wrench = estimate.data["wrench_estimated"].copy(deep=True)
    wrench.loc[{"component": component}] += error
    return replace(estimate, data=estimate.data.assign(wrench_estimated=wrench))


def test_a_late_adaptation_is_noted_and_a_misfit_that_grows_is_a_warning(estimate: Estimate) -> None:
    late = found(estimate)["Adaptation"]  # the thigh's length wanders by about 1 %
    assert late.level == "note" and "until then the lengths move by more than 1 %" in late.text
    assert "taken from 2 s on and hold part of that" in late.text
    flat = estimate.data["state"].copy(deep=True)
    flat[:] = flat[0]
    still = replace(estimate, data=estimate.data.assign(state=flat))
    assert found(still)["Adaptation"].level == "good"
    early = found(with_error(still, "fy", np.where(estimate.time < 4.0, 100.0, 0.0)))["Adaptation"]
    assert early.level == "note" and "settled after 4.0 s" in early.text and "misfit of fy" in early.text
    grown = found(with_error(estimate, "fy", np.exp(estimate.time)))["Adaptation"]
    assert grown.level == "warning" and "estimate is being lost" in grown.text


def test_markers_that_move_too_far_are_named_without_their_prefix(estimate: Estimate) -> None:
    assert found(estimate)["Soft tissue"].level == "good"
    swing = 0.06 * np.sin(np.pi * estimate.time)
    finding = found(with_element(estimate, "marker/S1:RTHI/x", swing))["Soft tissue"]
    assert finding.level == "warning" and finding.text.startswith("RTHI moves 60 mm on the thigh (usual 18 mm)")
    assert finding.advice


def test_bounds_are_counted_by_kind_and_those_touched_for_a_time_are_told(estimate: Estimate) -> None:
    (shank,) = (p for p in estimate.parameters if p.name == "length/shank")
    path = np.where((estimate.time >= 4.0) & (estimate.time < 9.0), shank.upper, shank.initial)
    finding = found(with_element(estimate, "length/shank", path))["Bounds"].text
    assert "(1 of 6 lengths, 0 of 20 marker places, 1 of 21 inertial numbers)" in finding
    assert "1 other touched a bound and left it (longest: shank length, 50 % of the time)" in finding


def test_a_joint_at_the_end_of_a_files_range_may_go_farther_than_the_file(estimate: Estimate) -> None:
    held = Event(2.0, 20, "at_bound", str(estimate.coordinate_names[0]), "held at its joint limit for 9 frames")
    stuck = replace(estimate, events=[*estimate.events, held])
    advice = found(stuck)["Joint limits"].advice
    assert "a marker is swapped" in advice and "widen" not in advice
    scaled = replace(stuck, config=estimate.config | {"model": "models/scaled.osim"})
    assert found(scaled)["Joint limits"].advice == advice + " Where it does, widen its range in scaled.osim."


def test_a_bound_that_lies_nearer_than_a_number_is_known_says_nothing(estimate: Estimate) -> None:
    """As the axial inertia of a thigh in a walk, which wanders to its bound by chance."""
    vague = [replace(p, sd=2.0 * abs(p.value - p.initial)) if p.at_bound else p for p in estimate.parameters]
    finding = found(replace(estimate, parameters=vague))["Bounds"]
    assert finding.level == "good" and "that the recording knows ends on its bound" in finding.text
    assert "hardly knows thigh length and pelvis mass: that they end on a bound says nothing" in finding.text
    one = [v if v.kind == "inertia" else p for v, p in zip(vague, estimate.parameters, strict=True)]
    finding = found(replace(estimate, parameters=one))["Bounds"]
    assert finding.level == "warning" and "1 of 47 estimated parameters end on a bound: thigh length." in finding.text


@pytest.mark.parametrize("topic", TOPICS)
def test_every_warning_is_part_of_one_finding_whatever_its_topic(estimate: Estimate, topic: Topic) -> None:
    said = [warning(topic, "plate 1 has 0.1 m of mass."), note(topic, "a note.")]
    made = [i for i in warned(replace(estimate, messages=[*said, said[0]]), {}) if i.level == "warning"]
    assert [insight.text for insight in made] == ["Plate 1 has 0.1 m of mass."] and made[0].advice
    assert made[0] in insights(replace(estimate, messages=said), compute_metrics(estimate))
    assert warned(replace(estimate, messages=said[1:]), {}) == []


def test_warnings_of_one_kind_are_one_finding(estimate: Estimate) -> None:
    said = [
        warning("plates", "one."),
        warning("mass", "two."),
        warning("sum of the plates", "three."),
        warning("labels", "four."),
    ]
    made = {insight.title: insight.text for insight in warned(replace(estimate, messages=said), {})}
    assert made == {"Subject": "Two.", "Force plates": "One. Three.", "Recording": "Four."}


def test_a_segment_that_nobody_sees_for_long_is_a_finding(estimate: Estimate) -> None:
    sites = [site for _, site in marker_sites(estimate)]
    segment = estimate.marker_segments[sites[0]]
    own = [k for k, site in enumerate(sites) if estimate.marker_segments.get(site) == segment]
    for frames, expected in ((slice(300, 315), False), (slice(300, 340), True)):
        measured = estimate.data["markers_measured"].copy(deep=True)
        measured[frames, own] = np.nan
        made = found(replace(estimate, data=estimate.data.assign(markers_measured=measured)))
        assert ("Unseen" in made) == expected
    assert f"{segment} from 3.00 to 3.39 s" in made["Unseen"].text and made["Unseen"].level == "warning"


def test_a_force_that_no_contact_gives_is_a_finding(estimate: Estimate) -> None:
    metrics = compute_metrics(estimate)
    for share, expected in ((0.15, False), (0.4, True)):
        grounded = {"force_n": 700.0 * share, "moment_nm": 1.0, "share": share}
        metrics["feet"] = {"left_at_root": {"grounded": grounded, "flight": None}}
        assert (forces.left(estimate, metrics) is not None) == expected
