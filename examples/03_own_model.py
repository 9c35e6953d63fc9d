"""A model of one's own (03_own_model.toml), a changed noise setting, and where the filter started and ended."""

from pathlib import Path

import dynakin
from dynakin.simulation import simulate_squat

recording = simulate_squat(seed=1).recording
subject = dynakin.Subject(mass_kg=70.0, height_m=1.75, sex="male")
model = dynakin.load_model(Path(__file__).with_suffix(".toml"), subject=subject, markers="opencap")
# This upper body is rigid and its arms hang, the person's do not: declare the plates 20 N and 20 N m uncertain.
noise = dynakin.presets.default().changed(force_variance_n2=20.0**2, moment_variance_n2_m2=20.0**2)
result = dynakin.Estimator(model, noise=noise).run(recording)

for p in result.parameters:
    if p.kind != "marker":
        bound = "  at its bound" if p.at_bound else ""
        print(f"{p.name:28s} {p.initial:8.3f} -> {p.value:8.3f} +- {p.sd:.3f} {p.unit}{bound}")
for event in result.events[:5]:
    print(f"{event.time_s:.2f} s  {event.kind}: {event.subject} {event.message}")
