"""Live use: the model is calibrated on the first seconds, standing still, then takes one sample at a time."""

import dynakin
from dynakin.simulation import simulate_squat

recording = simulate_squat(seed=1, duration_s=8.0).recording
subject = dynakin.Subject(mass_kg=70.0, height_m=1.75, sex="male")
model = dynakin.load_model("sagittal7", subject=subject, markers="opencap")
estimator = dynakin.Estimator(model)
tracker = estimator.start(recording.window(0.0, 1.0), lag_s=0.05)  # delayed() is then 50 ms late, and truer

for k in range(101, recording.n_frames):  # from here on as samples would come from a laboratory
    sample = dynakin.Sample(
        time_s=float(recording.time[k]),
        markers={name: recording.markers[k, m] for m, name in enumerate(recording.marker_names)},
        plates={plate.name: [*plate.force[k], *plate.moment[k]] for plate in recording.plates},
    )
    estimate = tracker.step(sample)
    delayed = tracker.delayed()
    if k % 100 == 0 and delayed is not None:
        print(
            f"{estimate.time_s:5.2f} s  knee {estimate.coordinates['knee'] * 57.29578:6.1f} deg  "
            f"now; at {delayed.time_s:.2f} s moment {delayed.moments['knee']:7.1f} +- "
            f"{tracker.deviations(delayed=True)['moments']['knee']:.1f} N m, speed {delayed.speeds['knee']:5.2f} rad/s"
        )
