# %% [markdown]
# # Calibrate a gel
#
# A gel shows slopes by colour; how much force a change of its image means has to be learnt once, from presses with
# a force gauge. Three balls or more, so that a force can be judged on an object of another shape. The simulated gel is
# its own gauge (`gauge="truth"`); a real one's is a table of `time_s,force_N`.

# %%
import matplotlib.pyplot as plt
import numpy as np

import palpate as pp

GEL = "mode=gel&size=320x240"
presses = [f"synthetic:rig?{GEL}&rate=5&radius={radius_mm}" for radius_mm in (6, 9, 14)]
calibration = pp.calibrate.force(presses, gauge="truth")
print(calibration.verdict)

# %%
print(calibration)

# %% [markdown]
# A press of a fourth ball, by the calibrated sensor, and what was really there. What is not valid leaves a gap.

# %%
sensor = calibration.sensor
times, force, sd, truth = [], [], [], []
with pp.open(f"synthetic:press?{GEL}&rate=10&seed=7&radius=11", sensor=sensor, drop=False) as stream:
    for touch in stream:
        times.append(touch.time_s)
        force.append(float(touch.force_N))
        sd.append(touch.force_N.sd)
        truth.append(touch.truth.force_N)
times, force, sd, truth = map(np.array, (times, force, sd, truth))
valid = np.isfinite(force)
error = force[valid] - truth[valid]
print(f"{valid.sum()} valid frames, error {np.sqrt(np.mean(error**2)):.4f} N RMS")

# %%
figure, axes = plt.subplots(figsize=(7, 3))
axes.fill_between(times, force - 1.96 * sd, force + 1.96 * sd, alpha=0.4, label="95 %")
axes.plot(times, force, lw=3, label="measured")
axes.plot(times, truth, "k--", lw=1, label="truth")
axes.set(xlabel="time [s]", ylabel="force [N]")
axes.legend()
figure.tight_layout()
