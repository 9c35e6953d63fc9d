"""The report: self-contained, complete, in words that match the numbers."""

from __future__ import annotations

import ast
import inspect
import re
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from dynakin.messages import note
from dynakin.report.figure import new_axes, to_svg
from dynakin.report.findings import fit, forces, recording, uncertainty
from dynakin.report.findings.finding import Insight
from dynakin.report.insights import in_short, insights
from dynakin.report.labels import moment_note, short_marker_names
from dynakin.report.page import SECTIONS, render_report
from dynakin.report.sections.constants import length_section
from dynakin.report.sections.section import Page, Section
from dynakin.report.styles import thin
from dynakin.report.text_tables import TextTable
from dynakin.results.estimate import Estimate
from dynakin.results.measures.consistency import Consistency, Judgement
from dynakin.results.measures.metrics import compute_metrics
from dynakin.results.naming import listed, number
from dynakin.results.records import REFUSED, Event, EventKind
from dynakin.settings.lag import ALL_FRAMES
from support.estimates.synthetic import make_estimate
from support.page import Structure


@pytest.fixture(scope="module")
def html(estimate: Estimate) -> str:
    return render_report(estimate)


def test_page_is_well_formed_and_needs_no_other_file(html: str) -> None:
    structure = Structure()
    structure.feed(html)
    assert structure.open == []
    assert all(address.startswith("#") for address in structure.addresses)
    assert "@import" not in html and "url(http" not in html and "<script src" not in html and "http-equiv" not in html


def test_ids_are_unique_and_every_reference_is_there(html: str) -> None:
    structure = Structure()
    structure.feed(html)
    twice = [name for name, count in Counter(structure.ids).items() if count > 1]
    assert twice == []
    used = {a[1:] for a in structure.addresses} | set(re.findall(r"url\(#([^)]+)\)", html))
    assert used <= set(structure.ids)


def test_a_figure_for_each_thing_with_a_unit_at_its_axis(html: str, estimate: Estimate) -> None:
    over_time = 1 + 2 + 2 * 10 + 3 + 8 + 8 + 6 + 7  # player, markers (2, 20 folded), wrench...
    assert html.count('role="img"') == over_time + 7 + 8 + 3  # repetitions: no angle that is locked
    for unit in ("time, s", "deg", "N m", "mm", "kg"):
        assert f">{unit}</text>" in html
    for name in estimate.coordinate_names:
        assert f"<b>{name.capitalize()}</b>" in html


def test_planar_moments_say_what_they_stand_for(html: str, estimate: Estimate) -> None:
    assert "the ground’s moment about the toe" in html
    assert html.count("sum of both legs") == 2 * 3
    assert html.count("sum of both arms") == 2 * 2
    spatial = estimate.data.assign_coords(marker_axes_modelled=("axis", [True, True, True]))
    assert moment_note(replace(estimate, data=spatial), "knee") == ""


def test_summary_names_bounds_gaps_and_locked_coordinates(estimate: Estimate) -> None:
    found = {insight.title: insight for insight in insights(estimate, compute_metrics(estimate))}
    assert found["Bounds"].level == "warning"
    assert "2 of 47" in found["Bounds"].text
    assert "thigh length and pelvis mass" in found["Bounds"].text
    assert "RASI (3.3 % of the frames) and RELB (2.1 % of the frames)" in found["Gaps"].text
    assert found["Locked"].text.startswith("Slide is held still")
    assert found["Uncertainty"].level == "note"  # it kept no covariance of its innovations
    assert "worst is RTHI" in found["Markers"].text


def test_a_clean_run_is_said_to_be_clean() -> None:
    made = make_estimate(4.0, gaps=False)
    clean = replace(made, parameters=[replace(p, at_bound=False) for p in made.parameters], events=[])
    found = {insight.title: insight for insight in insights(clean, compute_metrics(clean))}
    assert found["Bounds"].level == found["Gaps"].level == "good"


def test_names_from_files_cannot_break_the_page(estimate: Estimate) -> None:
    recording = replace(estimate.recording, name="<script>alert(1)</script>")
    html = render_report(replace(estimate, recording=recording, messages=[note("recording", "<b>bold</b> & more")]))
    assert "<script>" not in html and "&lt;script&gt;" in html
    assert "&lt;b&gt;bold&lt;/b&gt; &amp; more" in html


def test_report_without_plates_leaves_the_section_out() -> None:
    made = make_estimate(3.0)
    empty = {name: (("time", "component"), np.full((301, 6), np.nan)) for name in made.data if "wrench" in str(name)}
    html = render_report(replace(made, data=made.data.assign(empty)))
    assert 'id="wrench"' not in html
    assert "No wrench was compared" in html


def test_same_estimate_same_page() -> None:
    made = make_estimate(2.0)
    assert render_report(made) == render_report(made)


def test_thinned_line_keeps_peaks_and_gaps() -> None:
    time = np.arange(20000) / 100.0
    values = np.sin(time)
    values[12345], values[5000:5200] = 50.0, np.nan
    t, thinned = thin(time, values)
    assert len(t) < 1500
    assert np.nanmax(thinned) == 50.0 and time[12345] in t
    assert np.isnan(thinned).any()
    assert (np.diff(t) > 0).all()


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (2.3471, "2.35"),
        (-0.01234, "−0.0123"),
        (0.0, "0"),
        (1234.5, "1234"),
        (1e-7, "1.00e−07"),
        (None, "–"),
        (9.996, "10.0"),
    ],
)
def test_numbers_carry_three_digits(value: float | None, text: str) -> None:
    assert number(value) == text


def test_lists_read_as_sentences() -> None:
    assert listed(["a"]) == "a"
    assert listed(["a", "b", "c"]) == "a, b and c"
    assert listed(list("abcdefgh"), 3) == "a, b, c and 5 more"


def test_a_common_prefix_of_marker_names_is_dropped() -> None:
    assert short_marker_names(["S1:A", "S1:B"]) == {"S1:A": "A", "S1:B": "B"}
    assert short_marker_names(["S1:A", "S2:A"]) == {"S1:A": "S1:A", "S2:A": "S2:A"}


def test_what_converged_is_told_from_what_was_never_taught(estimate: Estimate) -> None:
    found = {insight.title: insight for insight in insights(estimate, compute_metrics(estimate))}
    assert found["Masses"].level == "good" and found["Masses"].text.startswith("Settled: 7, changed")
    flat = estimate.data["state"].copy(deep=True)
    flat[:] = flat[0]
    kept = [replace(p, value=p.initial, at_bound=False) for p in estimate.parameters]
    untaught = replace(estimate, parameters=kept, data=estimate.data.assign(state=flat))
    found = {insight.title: insight for insight in insights(untaught, compute_metrics(untaught))}
    assert "values of the anthropometric table, not identified ones" in found["Masses"].text
    assert "standard deviations ended at 100 %" in found["Masses"].text
    drift = estimate.data["state"] * (1.0 + 0.05 * estimate.data["time"] / 12.0)
    moving = replace(untaught, data=estimate.data.assign(state=drift))
    found = {insight.title: insight for insight in insights(moving, compute_metrics(moving))}
    moved = [insight for insight in found.values() if insight.text.startswith("Not settled")]
    assert [insight.level for insight in moved] == ["warning"] and moved[0].title == "Constants"
    assert "shank mass" in moved[0].text and moved[0].advice
    assert not {"foot mass", "foot length"} & set(
        moved[0].text.split(": ")[1].split(", ")
    )  # within what is said of them


def test_a_fit_that_only_follows_the_plates_is_told(estimate: Estimate) -> None:
    metrics = compute_metrics(estimate)
    assert {i.title: i.level for i in insights(estimate, metrics)}["One frame ahead"] == "good"
    metrics["prediction"]["wrench"]["rms"]["fx"] = 16.0 * metrics["wrench"]["rms"]["fx"]
    found = {insight.title: insight for insight in insights(estimate, metrics)}["One frame ahead"]
    assert found.level == "warning" and "16 times as far" in found.text and found.advice


def test_a_marker_that_stands_out_gets_advice(estimate: Estimate) -> None:
    metrics = compute_metrics(estimate)
    metrics["markers"]["rms_mm"]["S1:RKNE"] = 60.0
    found = {insight.title: insight for insight in insights(estimate, metrics)}
    assert found["Markers"].advice.startswith("RKNE stands out")


@pytest.mark.parametrize(
    ("size", "level", "advice"),
    [(0.7, "good", ""), (0.05, "note", "Nothing need be done"), (4.0, "warning", "Look at the film whether RKNE")],
)
def test_deviations_that_are_wrong_get_one_action(estimate: Estimate, size: float, level: str, advice: str) -> None:
    kept = with_innovations(estimate, size, np.random.default_rng(5))
    metrics = compute_metrics(kept)
    metrics["markers"]["rms_mm"]["S1:RKNE"] = 60.0
    found = {insight.title: insight for insight in insights(kept, metrics)}["Uncertainty"]
    assert found.level == level and found.advice.startswith(advice) and bool(found.advice) == bool(advice)


def test_noise_far_above_the_declared_is_no_clean_word(estimate: Estimate) -> None:
    for scale, level in ((0.2, "good"), (5.0, "note")):
        rng = np.random.default_rng(5)
        made = with_innovations(estimate, 1.0, rng)
        made = replace(made, config=made.config | {"noise_used": {"variance_scale": scale, "jerk_scale": {}}})
        said = {insight.title: insight for insight in insights(made, compute_metrics(made))}["Uncertainty"]
        assert said.level == level and ("2.2 times as large as declared" in said.text) == (level == "note")


def with_innovations(estimate: Estimate, size: float, rng: np.random.Generator) -> Estimate:
    """White ones, ``size`` times as large as their deviations."""
    data = estimate.data
    sizes = {name: data[f"{name}_measured"] for name in ("markers", "wrench")}
    white = {f"{name}_innovation": like.copy(data=size * rng.normal(size=like.shape)) for name, like in sizes.items()}
    white |= {f"{name}_innovation_sd": like.copy(data=np.ones(like.shape)) for name, like in sizes.items()}
    sensors = len(estimate.marker_names) + 1
    verdict = ("time", "sensor"), np.ones((len(estimate.time), sensors), dtype=int)
    return replace(estimate, data=data.drop_vars("verdict", errors="ignore").assign(white | {"verdict": verdict}))


def refusing(estimate: Estimate, frames: int, kind: EventKind = "gated", sensor: str = "") -> Insight:
    """What is said where one marker, or another sensor, is refused for a while."""
    verdict = np.ones((len(estimate.time), len(estimate.marker_names) + 1), dtype=int)
    verdict[50 : 50 + frames, 2] = REFUSED
    event = Event(0.5, 50, kind, sensor or estimate.marker_names[2], f"not used for {frames} frames")
    data = estimate.data.drop_vars("verdict", errors="ignore").assign(verdict=(("time", "sensor"), verdict))
    made = replace(estimate, data=data, events=[event])
    return {insight.title: insight for insight in insights(made, compute_metrics(made))}["Left out or reset"]


def test_a_frame_of_one_marker_is_a_note_and_a_tenth_of_a_second_or_a_reset_a_warning(estimate: Estimate) -> None:
    assert refusing(estimate, 1).level == "note"
    assert refusing(estimate, 30).level == "warning"
    assert refusing(estimate, 1, "reset").level == "warning"


def test_what_to_look_at_goes_by_what_was_refused(estimate: Estimate) -> None:
    marker, plates = refusing(estimate, 1).advice, refusing(estimate, 1, sensor="plates").advice
    assert "labels" in marker and "edge" not in marker
    assert "edge" in plates and "labels" not in plates


def test_advice_can_be_followed(estimate: Estimate) -> None:
    """No smoothing is advised where the settings have none, and no marker where the plates speak."""
    metrics = compute_metrics(estimate)
    metrics["prediction"]["wrench"]["rms"]["fx"] = 16.0 * metrics["wrench"]["rms"]["fx"]
    gain = replace(estimate, config=estimate.config | {"noise": {"constraint": "gain"}})
    said = {i.title: i.advice for i in insights(gain, metrics)}["One frame ahead"]
    assert "--preset default" in said and "live-like" not in said
    said = {i.title: i.advice for i in insights(estimate, metrics)}["One frame ahead"]
    assert "live-like" in said
    words: dict[str, Judgement] = {"motion": "consistent", "moments": "overconfident"}
    plates = Consistency(1.0, None, 1, None, None, "calibrated", judgements=words)
    assert uncertainty._case(plates, fixed=False) == "overconfident, plates"
    both = replace(plates, judgements=dict.fromkeys(words, "overconfident"))
    assert uncertainty._case(both, fixed=True) == "overconfident, fixed scales"


def test_every_warning_names_an_action() -> None:
    """By the source, as no estimate has all of them."""
    calls = [
        node
        for module in (fit, forces, recording, uncertainty)
        for node in ast.walk(ast.parse(inspect.getsource(module)))
        if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "Insight"
    ]
    may_warn = [c for c in calls if not (isinstance(c.args[0], ast.Constant) and c.args[0].value in ("good", "note"))]
    assert len(may_warn) >= 12
    assert [ast.unparse(call) for call in may_warn if len(call.args) < 4] == []


def test_one_sentence_says_what_to_look_at(estimate: Estimate) -> None:
    found = insights(estimate, compute_metrics(estimate))
    assert in_short(found) == "1 finding to look at before using this run: bounds."
    assert in_short([]) == "Nothing in this run speaks against using it."


def test_what_the_recording_tells_is_shown_where_the_prior_is_known(html: str, estimate: Estimate) -> None:
    """Every constant once, with its standard deviation before and after; an estimate without priors has no section."""
    assert 'id="identifiability"' not in html
    parameters = [replace(p, prior_sd=4.0 * p.sd) if p.estimated else p for p in estimate.parameters]
    page = render_report(replace(estimate, parameters=parameters))
    section = page.split('id="identifiability"')[-1].split("</section>")[0]
    lengths = sum(p.kind == "length" and p.estimated for p in parameters)
    assert f"Lengths ({lengths}): {lengths} known from the data." in section
    assert "Moments of inertia" in section and "Movements that would help" not in section


def test_of_lengths_the_bar_and_the_numbers_beside_it_are_the_same(estimate: Estimate) -> None:
    length = replace(
        next(p for p in estimate.parameters if p.kind == "length"), prior_sd=4.4e-3, sd=9.1e-3, skin_sd=8.4e-3
    )
    own = replace(estimate, parameters=[length])
    entry = compute_metrics(own)["identifiability"]["parameters"][length.name]
    assert entry["sd"] / entry["prior_sd"] == pytest.approx(entry["share"])
    assert "4.4 → 3.5 mm" in render_report(own)


def test_what_is_left_of_a_length_s_deviation_is_said_to_be_without_skin(estimate: Estimate) -> None:
    bare = {insight.title: insight.text for insight in insights(estimate, compute_metrics(estimate))}
    skin = [replace(p, skin_sd=8.4e-3) if p.kind == "length" else p for p in estimate.parameters]
    own = replace(estimate, parameters=skin)
    found = {insight.title: insight.text for insight in insights(own, compute_metrics(own))}
    assert found["Lengths"] == f"{bare['Lengths'][:-1]}, not counting skin that follows a joint."
    assert found["Masses"] == bare["Masses"]


def test_a_band_of_a_length_ends_within_its_panel(estimate: Estimate) -> None:
    wide = estimate.data["state_sd"].copy(data=np.full(estimate.data["state_sd"].shape, 0.02))
    own = replace(estimate, data=estimate.data.assign(state_sd=wide))
    found = length_section(Page(own, compute_metrics(own)))
    for panel in found.panels:
        band = re.search(r'<path d="M\d+ (\d+)[^"]*" class="spread"', panel.svg)
        assert band is not None
        assert int(band.group(1)) > 70, panel.title


def test_a_smoothed_run_shows_no_masses_over_time(estimate: Estimate) -> None:
    smoothed = replace(estimate, config=estimate.config | {"lag_s": ALL_FRAMES})
    assert 'id="masses"' in render_report(estimate)
    html = render_report(smoothed)
    assert 'id="masses"' not in html
    assert "settles on" not in html


def test_numbers_in_the_words_of_a_figure_keep_their_digits() -> None:
    figure, axes = new_axes()
    axes.annotate("0.00174 kg m²", (0.123456, 0.5))
    assert "0.00174 kg m²" in to_svg(figure, "digits", "a figure")


def test_a_section_is_a_function_in_the_list(estimate: Estimate, monkeypatch: pytest.MonkeyPatch) -> None:
    def marker_count(page: Page) -> Section:
        count = TextTable("Markers in use", ("markers",), [(str(len(page.estimate.marker_names)),)], (0,))
        return Section("count", "How many", "", tables=[count])

    def nothing(page: Page) -> None:
        return None

    monkeypatch.setitem(SECTIONS, "plane", (nothing, marker_count, lambda page: Section("bare", "Bare", "words")))
    html = render_report(estimate)
    assert re.findall(r'<section id="([^"]+)"', html) == ["summary", "movement", "count", "details"]
    assert '<a href="#count">How many</a>' in html and '<td class="number">10</td>' in html
