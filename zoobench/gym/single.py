"""One world as a Gymnasium environment."""

from collections.abc import Iterable, Mapping
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from zoobench.cell.vector_parts import Action, action_parts, observation_parts
from zoobench.gym.beginnings import Beginnings
from zoobench.gym.channels import Floats
from zoobench.gym.drawn_physics import Values
from zoobench.gym.registration import FRAMES
from zoobench.gym.worlds import METADATA, Worlds, outcome, problem_of, refuse_options
from zoobench.render.viewpoint import CameraName, View


class ZooEnv(gymnasium.Env[Floats, Floats]):
    """A cell of the benchmark with a step of one control frame, 0.008 s; actions and observations as in `Channels`.

    The reward is the task's. An episode is truncated at its length, with its `score` and `metrics` in info, and
    terminated if the simulation diverges or the robot tears, with the reason as `failure`; for its reward see
    `zoobench.cell.session.Step`. Every episode begins as in the benchmark, and seeds have no effect, unless something
    is drawn.

    Args:
        env, design, task: components, with parameters if needed, as in `desert[relief=0.03]`.
        action: `waves` or `muscles`.
        fidelity: of the simulation.
        frames: length of an episode. `gymnasium.make` needs `max_episode_steps` as well for a longer one than usual.
        draw: the random parts of each episode, of `pose`, `phase` and `path`; see `zoobench.gym.beginnings.Beginnings`.
        physics: parameters of the environment that are drawn for each episode, in place of those of `env`: a range, or
            values to choose from as the command line takes them, as in
            `{"friction": (0.2, 0.8), "youngs_modulus": "5e3|1e4"}`. The scene then comes to rest anew, and `reset`
            gives the values as `physics` in info.
        render_mode: `rgb_array` for pictures, which need the extra `render`; `human` for a page in the browser, which
            shows every step, in real time while somebody looks, and needs the extra `watch`.
        width, height, camera: of the pictures of `rgb_array`, see `zoobench.render.viewpoint.View`.

    Attributes:
        observation_parts, action_parts: name, place, shape and unit of every part of an observation and of an action,
            each a `zoobench.cell.vector_parts.VectorPart`. As a table: `DataFrame(env.unwrapped.observation_parts)`.

    Raises:
        UnknownNameError, UsageError, SceneError: the components or options are unknown or cannot be simulated.
    """

    metadata: dict[str, Any] = METADATA

    def __init__(
        self,
        env: str,
        design: str,
        task: str,
        *,
        action: Action = "waves",
        fidelity: str = "standard",
        frames: int = FRAMES,
        draw: Iterable[str] = (),
        physics: Mapping[str, Values] | None = None,
        render_mode: str | None = None,
        width: int = View.width,
        height: int = View.height,
        camera: CameraName = View.camera,
    ) -> None:
        problem = problem_of(env, design, task, fidelity, frames, worlds=1)
        self._worlds = Worlds(
            problem, 1, action, Beginnings(problem, draw, physics), View(width, height, camera), render_mode
        )
        self.render_mode = render_mode
        muscles = problem.body.muscle_count
        self.observation_parts = observation_parts(muscles, problem.task)
        self.action_parts = action_parts(muscles, action)
        self.action_space = self._worlds.channels.action_space
        self.observation_space = self._worlds.channels.observation_space

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Floats, dict[str, Any]]:
        """Begin an episode; returns the first observation.

        Raises:
            UsageError: there are options, or the cell cannot be simulated with the drawn values.
        """
        super().reset(seed=seed)
        refuse_options(options)
        seen = self._worlds.begin([self.np_random])[0]
        drawn = self._worlds.physics(0)
        return seen, {"physics": drawn} if drawn else {}

    def step(self, action: Floats) -> tuple[Floats, float, bool, bool, dict[str, Any]]:
        """Simulate a control frame.

        Raises:
            UsageError: an action of another shape or not finite, or the episode is over.
        """
        seen, step = self._worlds.step(np.asarray(action)[None])
        return seen[0], float(step.rewards[0]), bool(step.terminated[0]), bool(step.truncated[0]), outcome(step, 0)

    def render(self) -> NDArray[np.uint8] | None:
        """A picture of the world `[height, width, 3]` in the render mode `rgb_array`; else None."""
        return self._worlds.picture(0) if self.render_mode == "rgb_array" else None

    def close(self) -> None:
        """Close the picture or the page."""
        self._worlds.close()
