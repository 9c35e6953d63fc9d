"""Run a recording from files to an output folder.

    python 01_run_a_trial.py TRIAL.trc FORCES.mot

Without arguments a simulated squat is used, so that the example runs anywhere.
"""

import sys

import dynakin
from dynakin.simulation import simulate_squat

if len(sys.argv) == 3:
    trial, forces = sys.argv[1:]
    subject = dynakin.Subject()  # mass from the plates, mean of both sexes' tables
else:
    trial, forces = simulate_squat(seed=1).recording, None
    subject = dynakin.Subject(mass_kg=70.0, height_m=1.75, sex="male")

result = dynakin.run(  # with lag_s=0.05 each frame as it would be live, 50 ms late
    trial, forces=forces, model="sagittal7", markers="opencap", subject=subject
)

for message in result.estimate.messages:  # what was found, left out, assumed
    print("-", message)
metrics = result.metrics()
print(f"markers: {metrics['markers']['mean_rms_mm']:.2f} mm RMS on average (after the frame was used)")
print("wrench:", {name: round(rms, 2) for name, rms in metrics["wrench"]["rms"].items()}, "N, N m RMS")
print(metrics["consistency"]["verdict"])
knee = result.to_dataframe("moments")["knee"]
sd = result.to_dataframe("moments_sd")["knee"].mean()
print(f"knee moment, both legs: {knee.min():.0f} to {knee.max():.0f} N m, standard deviation {sd:.1f} N m")
print("written to", result.save("out/example_01"))
