# %% [markdown]
# # First touch
#
# A stream gives a `Touch` a frame: force, shear, slip, contacts and the surface of the pad, each number with its
# standard error and its state. Here the built-in sensor plays a ball that presses a pad in four steps; a camera is
# opened the same way, as `camera:/dev/video0` with a sensor file.

# %%
import matplotlib.pyplot as plt
import numpy as np

import palpate as pp

times, force, depth = [], [], []
with pp.open("synthetic:press?size=320x240&rate=15", drop=False) as stream:
    for touch in stream:
        times.append(touch.time_s)
        force.append(touch.force_N)
        if touch.force_N > 1.4:
            hill = touch.depth_mm
print(max((f for f in force if f.valid), key=float))

# %% [markdown]
# A number that is not valid says why: before the ball arrives there is no contact.

# %%
print(force[0], "|", force[0].state)

# %%
value = np.array([float(f) for f in force])
sd = np.array([f.sd for f in force])
figure, axes = plt.subplots(figsize=(7, 3))
axes.fill_between(times, value - 1.96 * sd, value + 1.96 * sd, alpha=0.4, label="95 %")
axes.plot(times, value, label="force")
axes.set(xlabel="time [s]", ylabel="force [N]")
axes.legend()
figure.tight_layout()

# %% [markdown]
# The surface at the last step, kept from a frame that is long gone: an array that was handed out stays as it is.

# %%
figure, axes = plt.subplots(figsize=(5, 3.6))
image = axes.imshow(hill, cmap="viridis")
axes.set(xlabel="x [px]", ylabel="y [px]")
figure.colorbar(image, label="depth [mm]")
figure.tight_layout()
