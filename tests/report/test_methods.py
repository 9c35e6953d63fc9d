"""The reference methods in the run's page, and the comparison's own page: the numbers are the tables'."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from dynakin.messages import note
from dynakin.report.comparison_page import render_comparison
from dynakin.report.page import render_report
from dynakin.report.text_tables import table2_text, unseen_text
from dynakin.results.estimate import Estimate
from dynakin.validation.differences import angle_differences, moment_differences
from dynakin.validation.methods import ComparedTrial
from dynakin.validation.table2 import Spread, table2
from dynakin.validation.unseen import UnseenRow
from support.page import Structure

SETTINGS = [{"model": "sagittal7", "presets": {"paper": {"force_variance_n2": 0.1}}, "forces": None}]


@pytest.fixture(scope="module")
def run_page(jointed: Estimate, comparison: ComparedTrial) -> str:
    return render_report(jointed, comparison=comparison)


@pytest.fixture(scope="module")
def page(comparison: ComparedTrial) -> str:
    return render_comparison([comparison], tables(comparison), SETTINGS, ["squat"])


def tables(trial: ComparedTrial) -> dict[str, list[object]]:
    found: dict[str, list[object]] = {
        "table2": list(table2([trial])),
        "angles": list(angle_differences([trial])),
        "moments": list(moment_differences([trial])),
    }
    return found


def part(html: str, anchor: str) -> str:
    """Text of one section, without tags."""
    start = html.index(f'<section id="{anchor}">')
    text = re.sub(r"<[^>]+>", " ", html[start : html.index("</section>", start)])
    return " ".join(text.split())


def test_the_runs_page_shows_table_ii_angles_wrench_and_knee_moment_by_method(
    run_page: str, comparison: ComparedTrial
) -> None:
    text = part(run_page, "methods")
    row = {(row.quantity, row.method): row for row in table2([comparison])}["fy", "AT (6 Hz)"]
    assert row.rms.mean == pytest.approx(20.0)
    assert "markers EKF (paper)" in text and "AT (6 Hz) 20.0 N" in text
    assert text.count("RMS difference 5.00 deg") == 7  # all but the locked one
    assert re.search(r"sum of both legs; RMS difference 10.0 N m, \d+ % of AT’s RMS", text)
    assert "AT: a sentence on AT." in text


@pytest.mark.parametrize("which", ["run_page", "page"])
def test_pages_are_whole_and_need_no_other_file(which: str, request: pytest.FixtureRequest) -> None:
    html = request.getfixturevalue(which)
    structure = Structure()
    structure.feed(html)
    assert structure.open == [] and len(set(structure.ids)) == len(structure.ids)
    assert all(address.startswith("#") and address[1:] in structure.ids for address in structure.addresses)
    used = set(re.findall(r"url\(#([^)]+)\)", html))
    assert used <= set(structure.ids) and "url(http" not in html and "<script src" not in html


def test_without_reference_methods_the_page_says_why_in_a_line(jointed: Estimate, comparison: ComparedTrial) -> None:
    alone = replace(
        comparison,
        methods=comparison.methods[:1],
        notes=(note("method", "AT and the classical method are left out: why."),),
    )
    html = render_report(jointed, comparison=alone)
    assert part(html, "methods") == "Other methods AT and the classical method are left out: why."


def test_repetitions_are_shown_by_method_and_their_absence_is_said(run_page: str, jointed: Estimate) -> None:
    text = part(run_page, "repetitions")
    assert text.startswith("Repetitions 2 squats after the adaptation: 4.")
    assert "classical (6 Hz)" in text and text.count("% of the squat") == 7 + 8 + 3 and "N m/kg" in text
    still = replace(jointed.recording, markers=jointed.recording.markers[:1].repeat(1201, axis=0))
    assert part(render_report(replace(jointed, recording=still)), "repetitions") == "Repetitions No squat was found."


def test_comparison_page_holds_its_tables_and_settings(page: str) -> None:
    assert "20.0 N m" in part(page, "table2") and "knee EKF (paper) 10.0 N m" in part(page, "moments")
    assert "knee EKF (paper) 5.0 deg −5.0 deg 0.0 deg" in part(page, "angles")
    assert "force_variance_n2 = 0.1" in part(page, "details") and "AT: a sentence on AT." in part(page, "details")
    assert "20 N by AT (6 Hz)" in part(page, "summary")


def test_a_filter_worse_than_persistence_is_marked(comparison: ComparedTrial) -> None:
    rows = [
        UnseenRow("100 ms ahead", "fy", "N", method, Spread(value, None, 1))
        for method, value in (("EKF (paper)", 400.0), ("persistence", 50.0), ("linear extrapolation", 45.0))
    ]
    html = render_comparison([comparison], {**tables(comparison), "unseen": rows}, SETTINGS, ["squat"])
    text = part(html, "summary")
    assert "FY: 400 N by EKF (paper); 45 N by linear extrapolation. The filter is worse than what costs" in text
    assert 'class="warning"' in html and "400.0 N" in part(html, "unseen")


def test_many_trials_give_their_spread_and_their_own_repetitions(comparison: ComparedTrial) -> None:
    other = replace(comparison, name="second", measured_wrench=comparison.measured_wrench + 10.0)
    both = [comparison, other]
    made = {"table2": table2(both), "angles": angle_differences(both), "moments": moment_differences(both)}
    html = render_comparison(both, made, SETTINGS * 2, ["squat", "second"])
    assert "mean ± standard deviation over 2 trials" in part(html, "table2") and "15.0 ± 7.1 N" in part(html, "table2")
    assert "Repetitions of second" in part(html, "repetitions-2")
    structure = Structure()
    structure.feed(html)
    assert len(set(structure.ids)) == len(structure.ids)


def test_parameters_judged_alone_make_a_page_too(comparison: ComparedTrial) -> None:
    rows = [row for row in table2([comparison]) if row.quantity == "fy"]
    html = render_comparison([], {"held_out": rows}, SETTINGS * 2, ["A", "B"], [note("method", "B: a note")])
    assert "<h1>A → B</h1>" in html and "20.0 N" in part(html, "held-out") and "B: a note" in part(html, "details")


def test_tables_have_a_cell_for_each_heading(comparison: ComparedTrial) -> None:
    rows = table2([comparison])
    for table in (table2_text(rows, "t"), table2_text(rows, "t", single_markers=True)):
        assert table.rows and {len(row) for row in table.rows} == {len(table.headings)}
    assert {row[0] for row in table2_text(rows, "t").rows} >= {"markers", "FX", "FY", "MZ", ""}
    assert unseen_text([UnseenRow("y", "fy", "N", "a", Spread(None, None, 0))]).rows == [("y", "FY", "–")]
    assert np.isfinite([row.rms.mean or 0.0 for row in rows]).all()
