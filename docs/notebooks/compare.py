# ---
# jupyter:
#   jupytext:
#     formats: py:percent
# ---

# %% [markdown]
# # Compare two methods
#
# The gradient and random search learn to move a caterpillar on firm ground. Both get the same budget of simulated
# steps. With two seeds and this budget, the comparison shows how it is done. For a result, use five seeds and a budget
# at which the curves have become flat.
#
# Open this file as a notebook in VS Code, or in Jupyter with the extension jupytext. It needs the extra `plots`.

# %%
import matplotlib.pyplot as plt

import zoobench

runs = zoobench.run(
    env="ground",
    task="movement-speed",
    method=["diffphysics", "random"],
    fidelity="draft",
    frames=100,
    seeds=2,
    budget=6_000,  # substeps
    db="compare.db",
)
runs[["method", "seed", "score", "unit", "state"]]

# %% [markdown]
# ## Final scores
#
# `zoobench table` prints the same means with their 95 % intervals.

# %%
final = runs.groupby("method")["score"].agg(["mean", "min", "max"])
assert final.loc["diffphysics", "mean"] > final.loc["random", "mean"]
final

# %% [markdown]
# ## Learning curves
#
# A point is the best score so far and the substeps spent until then.

# %%
curves = zoobench.load("compare.db").curves("score", "substeps").merge(runs[["run", "method"]], on="run")
COLOURS = {"diffphysics": "#2878bd", "random": "#7f7f7f"}  # as in all pictures of zoobench
figure, axes = plt.subplots(figsize=(5, 3), layout="constrained")
for (method, _), one in curves.groupby(["method", "run"]):
    best = one["score"].cummax()
    axes.step(one["substeps"], best, where="post", color=COLOURS[method], label=method)
axes.set(xlabel="substeps", ylabel="best speed so far [m/s]")
handles = dict(zip(*axes.get_legend_handles_labels()[::-1], strict=True))
axes.legend(handles.values(), handles.keys())
figure.savefig("curves.png")
