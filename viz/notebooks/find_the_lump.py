# %% [markdown]
# # Find the lump
#
# A hard lump in soft tissue shows in the pressure on a plate that presses it. Finite elements make the maps of two
# presses, `palpate.lump.estimate` says what is behind them. For research use: not a diagnosis.

# %%
import matplotlib.pyplot as plt
import numpy as np

import palpate as pp

truth = dict(size_mm=12, depth_mm=3, stiffness_ratio=4)
presses = [pp.forward(force_N=force, cells=(32, 32, 16), large_strain=True, **truth) for force in (1, 2)]
noise = np.random.default_rng(1).normal(0, 5, (2, *presses[0].stress_Pa.shape))
maps = [press.stress_Pa + added for press, added in zip(presses, noise)]
found = pp.lump.estimate(maps, force_N=[1, 2], young_Pa=4000, thickness_mm=20, pitch_mm=presses[0].pitch_mm[0])
print(found.state)

# %%
for name, true in truth.items():
    print(f"{name:16} {getattr(found, name)}   truth {true}")

# %%
figure, axes = plt.subplots(1, 2, figsize=(8, 3.2))
for panel, force, map_Pa in zip(axes, (1, 2), maps):
    image = panel.imshow(map_Pa / 1000, cmap="magma", extent=(-20, 20, 20, -20))
    panel.set(title=f"{force} N", xlabel="x [mm]", ylabel="y [mm]")
    panel.add_patch(plt.Circle((found.x_mm.value, found.y_mm.value), found.size_mm.value / 2, fill=False, color="w"))
    figure.colorbar(image, ax=panel, label="pressure [kPa]")
figure.tight_layout()
