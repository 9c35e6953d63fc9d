"""An estimator of a simulated squat, and the squat sample by sample."""

from __future__ import annotations

import dataclasses

import numpy as np

import dynakin

SUBJECT = dynakin.Subject(mass_kg=70.0, height_m=1.75, sex="male")


def estimator(**options: object) -> dynakin.Estimator:
    return dynakin.Estimator(dynakin.load_model("sagittal7", subject=SUBJECT, markers="opencap"), **options)


def with_markers(recording: dynakin.Recording, change) -> dynakin.Recording:
    markers = recording.markers.copy()
    change(markers)
    return dataclasses.replace(recording, markers=markers)


def samples(recording: dynakin.Recording) -> list[dynakin.Sample]:
    return [
        dynakin.Sample(
            time_s=float(t),
            markers=dict(zip(recording.marker_names, recording.markers[k], strict=True)),
            plates={p.name: np.concatenate([p.force[k], p.moment[k]]) for p in recording.plates},
        )
        for k, t in enumerate(recording.time)
    ]
