# ---
# jupyter:
#   jupytext:
#     formats: py:percent
# ---

# %% [markdown]
# # Train and film
#
# A panda learns to walk on ice, and you see how. The budget is small, so that the notebook takes a minute on two idle
# cores.
#
# Open this file as a notebook in VS Code, or in Jupyter with the extension jupytext. It needs the
# extras `plots` and `render`.

# %%
import matplotlib.pyplot as plt
import numpy as np

import zoobench

runs = zoobench.run(
    env="ice",
    task="movement-speed",
    design="panda",
    method="diffphysics",
    fidelity="draft",
    frames=100,
    seeds=1,
    budget=10_000,  # substeps
    db="film.db",
)
run = int(runs["run"].iloc[0])
runs[["run", "score", "unit", "state"]]

# %% [markdown]
# ## The film
#
# The best episode is simulated again. A control frame is 8 ms, so that a film of every second frame at 25 pictures a
# second is slowed 2.5 times. In a notebook, `IPython.display.Image("gait.gif")` shows it.

# %%
film = zoobench.film(run, "gait.gif", db="film.db", every=2)
print(film)

# %% [markdown]
# ## The gait as numbers
#
# A `.npz` file has the activity of every muscle and the path of the centre of mass at every control frame. Each row of
# the lower picture is a muscle, red where it contracts and blue where it extends.

# %%
frames = np.load(zoobench.film(run, "gait.npz", db="film.db"))
figure, (above, below) = plt.subplots(2, figsize=(6, 4), sharex=True, layout="constrained")
distance = frames["centre"][:, 0] - frames["centre"][0, 0]
above.plot(frames["times"], 1e3 * distance)
above.set(ylabel="distance [mm]")
shown = below.pcolormesh(
    frames["times"], np.arange(len(frames["muscles"])), frames["activity"].T, cmap="RdBu_r", vmin=-1, vmax=1
)
below.set(xlabel="time [s]", ylabel="muscle")
figure.colorbar(shown, ax=below, label="activity")
figure.savefig("gait.png")
assert distance[-1] > 0.0
