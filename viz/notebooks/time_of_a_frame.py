# %% [markdown]
# # Where a frame's time goes
#
# What a frame costs depends on what is asked for. The same recording is measured with more and more outputs; the
# difference from one to the next is what the output costs on this machine. `palpate profile` does this by stage, with
# bandwidth and a report.

# %%
import time

import matplotlib.pyplot as plt

import palpate as pp

SCENE = "synthetic:press?rate=15&size=640x480"
steps = {
    "force": ["force"],
    "+ contacts": ["force", "contacts"],
    "+ surface": ["force", "contacts", "surface"],
    "+ confidence": ["force", "contacts", "surface", "confidence"],
}
cost_ms = {}
for name, outputs in steps.items():
    with pp.open(SCENE, outputs=outputs, drop=False) as stream:
        next(stream)  # compiles what is used
        start = time.perf_counter()
        frames = sum(1 for touch in stream)
        cost_ms[name] = (time.perf_counter() - start) / frames * 1000
    print(f"{name:14} {cost_ms[name]:6.2f} ms a frame, the simulation of the frame included")

# %%
figure, axes = plt.subplots(figsize=(6, 2.4))
axes.barh(list(cost_ms), list(cost_ms.values()))
axes.invert_yaxis()
axes.set(xlabel="time of a frame, its simulation included [ms]")
figure.tight_layout()
