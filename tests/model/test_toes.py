"""Toes: a hinge where they are marked, part of the foot where they are not."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dynakin.filter.estimator import Estimator
from dynakin.model.definition import ModelDefinition, load_model
from dynakin.recordings.recording import Recording
from support.made_in_space import RATE, WHO, recording_of, standing, standing_places, states

GREAT_TOE = {"RHLX": np.array([0.19, 0.03, 0.10]), "LHLX": np.array([0.19, 0.03, -0.10])}


@pytest.fixture
def marked(tmp_path: Path) -> ModelDefinition:
    """fullbody with a marker set that has the great toe beside Plug-in Gait's places."""
    sets = Path(load_model("fullbody").path).parents[1] / "markers" / "sets"
    text = (sets / "plug-in-gait.toml").read_text(encoding="utf-8")
    path = tmp_path / "toes.toml"
    path.write_text(text.replace("[places]", '[places]\nHAL = "{R,L}HLX"', 1), encoding="utf-8")
    return load_model("fullbody", WHO, markers=path)


def with_toes(recording: Recording, names: tuple[str, ...] = ("RHLX", "LHLX")) -> Recording:
    places = np.array([GREAT_TOE[name] for name in names])
    extra = np.repeat(places[None], recording.n_frames, axis=0)
    return replace(
        recording,
        marker_names=(*recording.marker_names, *names),
        markers=np.concatenate([recording.markers, extra], axis=1),
    )


def test_without_toe_markers_the_model_has_no_toes(marked: ModelDefinition) -> None:
    plain = load_model("fullbody", WHO, markers="plug-in-gait").calibrate(standing())
    same = marked.calibrate(standing())
    assert "toes_r" not in same.plan.inertia
    assert same.names == plain.names
    np.testing.assert_allclose(same.x0, plain.x0, atol=1e-12)


def test_one_side_marked_has_toes_on_that_side(marked: ModelDefinition) -> None:
    found = marked.calibrate(with_toes(standing(), ("RHLX",)))
    assert "toes_r" in found.plan.inertia and "toes_l" not in found.plan.inertia


def test_a_great_toe_that_is_never_seen_with_the_rest_gives_no_toes(marked: ModelDefinition) -> None:
    recording = with_toes(standing())
    markers = recording.markers.copy()
    markers[:80, recording.marker_names.index("RHLX")] = np.nan
    markers[80:, recording.marker_names.index("LANK")] = np.nan
    found = marked.calibrate(replace(recording, markers=markers))
    assert "toes_r" not in found.plan.inertia and "toes_l" in found.plan.inertia
    assert any("measured without RHLX" in text for text in map(str, found.messages))


def test_a_great_toe_without_metatarsals_stays_on_the_foot(marked: ModelDefinition) -> None:
    recording = with_toes(standing())
    kept = [k for k, name in enumerate(recording.marker_names) if name[1:] not in ("TOE", "MT5")]
    names = tuple(recording.marker_names[k] for k in kept)
    found = marked.calibrate(replace(recording, marker_names=names, markers=recording.markers[:, kept]))
    assert "toes_r" not in found.plan.inertia
    assert next(site.segment for site in found.plan.sites if site.recorded == "RHLX") == "foot_r"


def test_toes_bend_and_their_moment_is_absent_while_the_foot_bears(marked: ModelDefinition) -> None:
    """The angle within a degree; heel and ankle stay; no moment where nobody knows what lies under the toes."""
    initial = marked.calibrate(with_toes(standing()))
    time = np.arange(150) / RATE
    bend = 0.5 * (1.0 - np.cos(2.0 * np.pi * time / 1.5)) * 0.5
    x = states(initial, {"mtp_angle_r": bend}, 0.0, np.zeros(3), time)
    found = Estimator(marked).run(recording_of(initial, x, time))
    angles = found.data["coordinates"]
    wrong = angles.sel(coordinate="mtp_angle_r").values - angles.sel(coordinate="mtp_angle_r").values[0] - bend
    assert np.rad2deg(np.abs(wrong)).max() < 1.0
    assert np.rad2deg(np.ptp(angles.sel(coordinate="ankle_angle_r").values)) < 1.0
    assert np.isnan(found.data["moments"].sel(coordinate="mtp_angle_r").values).all()
    assert np.isfinite(found.data["moments"].sel(coordinate="ankle_angle_r").values).all()
    assert set(standing_places()) < set(initial.recorded_markers)
