# ---
# jupyter:
#   jupytext:
#     formats: py:percent
# ---

# %% [markdown]
# # A design space
#
# In a design space the body has parameters, too. Here the gradient optimises a body of voxels together with its gait,
# on firm ground. The budget is small: it shows how a body changes, and not which body is best.
#
# Open this file as a notebook in VS Code, or in Jupyter with the extension jupytext. It needs the extra `plots`.

# %%
import matplotlib.pyplot as plt
import numpy as np

import zoobench

runs = zoobench.run(
    env="ground",
    task="movement-speed",
    design=["caterpillar", "voxel[edge=0.025]"],
    method="diffphysics",
    fidelity="draft",
    frames=100,
    seeds=1,
    budget=10_000,  # substeps
    db="design.db",
)
runs[["run", "design", "score", "unit", "state"]]

# %% [markdown]
# ## The optimised body
#
# `zoobench design export RUN -o body.stl` writes it for a printer. Here its solid particles are drawn from the side,
# each in the colour of its strongest muscle.

# %%
best = runs[runs["design"] == "voxel"].iloc[0]
frames = np.load(zoobench.film(int(best["run"]), "body.npz", db="design.db"))
x, y, _ = frames["robot"][0].T
muscle = frames["muscle_membership"].argmax(axis=1)
print(f"{len(x)} solid particles, {len(frames['muscles'])} muscles")

figure, axes = plt.subplots(figsize=(6, 3), layout="constrained")
axes.scatter(1e3 * (x - x.mean()), 1e3 * y, c=muscle, cmap="tab10", s=60)
axes.set(xlabel="x, forward [mm]", ylabel="y, up [mm]", aspect="equal")
figure.savefig("body.png")

# %% [markdown]
# ## Does the body matter?
#
# Keep the body and train a new gait, or keep the gait and look for a new body: `--design 'stored[run=2]'` and
# `--controller 'stored[run=2]'` of `zoobench run`. The tutorial [Co-design of a body](../tutorials/codesign.md) goes on
# from here.

# %%
given, found = (runs[runs["design"] == name]["score"].iloc[0] for name in ("caterpillar", "voxel"))
print(f"caterpillar {given:.3f} m/s, voxel {found:.3f} m/s")
