"""The paper's figures as files: which are there, what they say, and how labels keep apart."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import joblib
import numpy as np
import pytest

from dynakin.errors import ConfigError, OutputError
from dynakin.report.paper_figures.figures import FIGURES, draw_figure, save_figures
from dynakin.report.paper_figures.movement import middle_cycle
from dynakin.report.paper_figures.parameters import spread
from dynakin.results.estimate import Estimate
from dynakin.results.measures.sources import DERIVED
from dynakin.validation.methods import ComparedTrial
from support.estimates.spatial import make_spatial


def words_in(path: Path) -> str:
    return " | ".join(re.findall(r"<text[^>]*>([^<]*)</text>", path.read_text(encoding="utf-8")))


@pytest.fixture(scope="module")
def saved(jointed: Estimate, comparison: ComparedTrial, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("figures")
    written = save_figures(jointed, folder, ("svg",), comparison=comparison)
    assert [path.stem for path in written] == list(FIGURES)
    return folder


def test_differences_to_the_reference_are_said_with_their_unit(saved: Path) -> None:
    assert words_in(saved / "figure5_angles.svg").count("RMS difference 5.00 deg") == 7
    assert "AT 20.0 N m" in words_in(saved / "figure6_wrench.svg")
    assert re.search(r"RMS difference 10.0 N m, \d+ % of AT’s RMS", words_in(saved / "figure7_knee_moment.svg"))
    moments, wrench = (words_in(saved / f"repetitions_{kind}.svg") for kind in ("moments", "wrench"))
    both = moments + wrench
    assert "% of the squat, n = 2" in wrench and both.count("N m/kg") == 8 and both.count("N/kg") == 3
    assert all(name in wrench for name in ("EKF (paper)", "AT (6 Hz)", "measured", "± 1 standard deviation"))
    assert "measured" not in moments  # the key is of what is drawn


def test_lines_of_segments_are_named_where_they_end(saved: Path) -> None:
    lengths = words_in(saved / "figure8_lengths_and_masses.svg")
    assert "thigh 516 ± 17 mm (+20.0 %)" in lengths and "bound +20 %" in lengths
    assert len(re.findall(r"± [\d.]+ kg m² ", words_in(saved / "figure9_inertias.svg"))) == 7
    markers = words_in(saved / "figure4_markers.svg")
    assert "0.5 m" in markers and "shank" in markers and markers.count(" s |") == 6


def test_formats_and_what_is_left_out(jointed: Estimate, tmp_path: Path) -> None:
    bare = replace(
        jointed,
        parameters=[p for p in jointed.parameters if p.kind == "marker"],
        data=jointed.data.assign(wrench_estimated=jointed.data["wrench_estimated"] * np.nan),
    )
    bare = replace(bare, data=bare.data.sel(coordinate=["toe", "hip"]))
    written = save_figures(bare, tmp_path / "new", ("pdf", "png"))
    assert sorted(path.name for path in written) == [
        "figure4_markers.pdf",
        "figure4_markers.png",
        "figure5_angles.pdf",
        "figure5_angles.png",
        "moments.pdf",
        "moments.png",
        "repetitions_angles.pdf",
        "repetitions_angles.png",
        "repetitions_moments.pdf",
        "repetitions_moments.png",
    ]
    assert written[0].read_bytes()[:4] == b"%PDF"


def test_moments_of_all_joints_stand_in_one_figure(saved: Path) -> None:
    moments = words_in(saved / "moments.svg")
    assert moments.count("moment, N m") == 1 and "± 2 standard deviations" in moments
    titles = ("Ankle (+ dorsiflexion)", "Knee (+ flexion)", "Hip (+ flexion)", "Shoulder (+ flexion)")
    assert all(f"| {title} |" in f"| {moments} |" for title in titles)
    assert moments.count("sum of both legs") == 3 and "the ground’s moment" in moments


def test_bands_of_derived_moments_do_not_press_the_lines_flat() -> None:
    """A leg without a plate: in the first and last frames its moments say nothing."""
    spatial = make_spatial()
    data = spatial.data
    sd, source = data["moments_sd"].copy(), data["moment_source"].copy()
    knee = {"coordinate": data["coordinate"].values.tolist().index("knee_angle_l")}
    source[knee] = DERIVED
    sd[{"time": slice(0, 5), **knee}] = 100.0
    figure = draw_figure("moments", replace(spatial, data=data.assign(moments_sd=sd, moment_source=source)))
    axes = next(a for a in figure.axes if a.get_title(loc="left").startswith("Knee"))
    low, high = axes.get_ylim()
    assert -125.0 < low < -90.0 and 0.0 < high < 35.0  # the lines go from -90 to 0 N m


def test_a_band_that_is_too_wide_to_draw_is_said_in_numbers() -> None:
    spatial = make_spatial()
    sd = spatial.data["coordinates_sd"].copy(data=np.full(spatial.data["coordinates_sd"].shape, np.radians(1e-3)))
    sd[{"coordinate": spatial.data["coordinate"].values.tolist().index("knee_angle_l")}] = np.radians(200.0)
    figure = draw_figure("angles", replace(spatial, data=spatial.data.assign(coordinates_sd=sd)))
    titles = [a.get_title(loc="left") for a in figure.axes]
    assert "Knee angle, deg\n(left 2 sd: 400)" in titles and "Hip flexion, deg" in titles


def test_one_figure_is_drawn_by_its_name_and_shown_by_a_notebook(jointed: Estimate) -> None:
    figure = draw_figure("angles", jointed)
    assert figure._repr_png_()[:4] == b"\x89PNG"
    assert len(figure.axes) == len(draw_figure("figure5_angles", jointed).axes)
    with pytest.raises(
        ConfigError, match=r"no figure 'momnts' \(did you mean 'moments'\?\), expected one of markers, "
    ):
        draw_figure("momnts", jointed)
    bare = replace(jointed, data=jointed.data.assign(moments=jointed.data["moments"] * np.nan))
    with pytest.raises(ConfigError, match="has nothing to show in 'moments'"):
        draw_figure("moments", bare)


def test_wrong_requests_are_refused(jointed: Estimate, comparison: ComparedTrial, tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="'jpg' is not known, expected some of svg, pdf, png"):
        save_figures(jointed, tmp_path, ("jpg",))
    with pytest.raises(ConfigError, match="comparison has 100 frames, expected the estimate's 1201"):
        save_figures(jointed, tmp_path, ("svg",), comparison=replace(comparison, time=comparison.time[:100]))
    (tmp_path / "file").touch()
    with pytest.raises(OutputError, match="cannot write figures there"):
        save_figures(jointed, tmp_path / "file", ("svg",))


def test_same_estimate_same_files(jointed: Estimate, saved: Path, tmp_path: Path, comparison: ComparedTrial) -> None:
    save_figures(jointed, tmp_path, ("svg",), comparison=comparison)
    for name in ("figure4_markers.svg", "figure8_lengths_and_masses.svg"):
        assert (tmp_path / name).read_bytes() == (saved / name).read_bytes()


def test_several_processes_write_the_same_files(
    jointed: Estimate, comparison: ComparedTrial, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folders = {cores: tmp_path / str(cores) for cores in (1, 3)}
    for cores, folder in folders.items():
        monkeypatch.setattr(joblib, "cpu_count", lambda cores=cores: cores)
        written = save_figures(jointed, folder, ("svg", "png"), comparison=comparison)
        assert [path.name for path in written] == [f"{name}.{form}" for name in FIGURES for form in ("svg", "png")]
    for path in folders[1].iterdir():
        assert path.read_bytes() == (folders[3] / path.name).read_bytes(), path.name


def test_cycle_is_the_middle_repetition_or_everything(jointed: Estimate) -> None:
    cycle = middle_cycle(jointed)  # squats of 3 s from 1.5 s on, two of them whole and after the adaptation
    knee = jointed.data["coordinates"].sel(coordinate="knee").values[cycle]
    assert jointed.time[cycle][0] >= 7.5 and jointed.time[cycle][-1] <= 10.5
    assert np.argmax(knee) == pytest.approx(len(knee) / 2, abs=15)
    still = replace(jointed.recording, markers=jointed.recording.markers[:1].repeat(1201, axis=0))
    assert middle_cycle(replace(jointed, recording=still)) == slice(0, 1201)


def test_labels_keep_apart_and_in_order() -> None:
    wanted = np.array([0.5, 0.1, 0.51, 0.5, 0.9])
    placed = spread(wanted, 0.1)
    assert np.all(np.diff(np.sort(placed)) >= 0.1 - 1e-12)
    assert placed[1] == 0.1 and placed[4] == 0.9
    assert placed[0] < placed[3] < placed[2]
    assert placed[[0, 2, 3]].mean() == pytest.approx(wanted[[0, 2, 3]].mean())
