# %% [markdown]
# # Young's modulus of a cube
#
# A cube of silicone is pressed between the pad and a rigid table, with a stage that says how far it has come.
# `palpate modulus --simulate` makes such presses by finite elements of pad and sample, seen through the simulated pad.

# %%
import subprocess
import tempfile

import matplotlib.pyplot as plt
import numpy as np

import palpate as pp

folder = tempfile.mkdtemp()
command = ["palpate", "modulus", "--simulate", "103", "--sample", "cube,10mm", "--quiet", "--out", folder]
subprocess.run(command, check=True, capture_output=True)
E = pp.modulus(folder + "/presses.csv", sample="cube,10mm", pad_kPa=200, pad_thickness_mm=6)
print(E)

# %% [markdown]
# Each way to the modulus by itself, with its 95 % interval; what cannot hold for a cube says so.

# %%
ways = [way for way in E.methods if way["state"] == "valid"]
for way in E.methods:
    print(f'{way["method"]:20} {way["state"]}')

# %%
figure, axes = plt.subplots(figsize=(6, 2.6))
for row, way in enumerate(ways):
    low, high = way["interval_kPa"]
    axes.plot([low, high], [row, row], lw=3)
    axes.plot(way["young_kPa"], row, "ko")
axes.axvline(103, color="gray", ls="--", label="truth")
axes.set_yticks(range(len(ways)), [way["method"] for way in ways])
axes.set(xlabel="Young's modulus [kPa]", ylim=(-0.5, len(ways) - 0.5))
axes.legend(loc="upper right")
figure.tight_layout()
