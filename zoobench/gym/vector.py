"""Many worlds in one solver as a Gymnasium vector environment."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Self

import numpy as np
from gymnasium.utils.seeding import np_random
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from zoobench.cell.session import Session
from zoobench.cell.vector_parts import Action, action_parts, observation_parts
from zoobench.errors import UsageError
from zoobench.gym.beginnings import Beginnings
from zoobench.gym.channels import Floats
from zoobench.gym.drawn_physics import Values
from zoobench.gym.registration import FRAMES
from zoobench.gym.worlds import METADATA, Worlds, outcome, problem_of, refuse_options
from zoobench.render.viewpoint import CameraName, View

Numbers = NDArray[Any]
Stepped = tuple[Floats, Numbers, Numbers, Numbers, dict[str, Any]]


class ZooVectorEnv(VectorEnv[Floats, Floats, Numbers]):
    """`num_envs` environments as `ZooEnv`; each gives the same numbers as alone, bit for bit.

    A world whose episode is over begins the next one in the same step and returns its first observation. As in
    Gymnasium's own vector environments, `final_obs` in info then holds the last observation of the old episode, and
    `final_info` what `ZooEnv` tells at its end.

    Args:
        env, design, task, action, fidelity, frames, draw, render_mode, width, height, camera: as in `ZooEnv`.
        physics: none, as the worlds of one solver share their physics.
        num_envs: number of worlds.
        max_episode_steps: from `gymnasium.make_vec`; episodes of more frames are refused.

    Attributes:
        observation_parts, action_parts: name, place, shape and unit of every part of an observation and of an action,
            each a `zoobench.cell.vector_parts.VectorPart`. As a table: `DataFrame(env.unwrapped.observation_parts)`.

    Raises:
        UnknownNameError, UsageError, SceneError: the components or options are unknown or cannot be simulated.
    """

    metadata: dict[str, Any] = {**METADATA, "autoreset_mode": AutoresetMode.SAME_STEP}  # noqa: RUF012

    def __init__(
        self,
        env: str,
        design: str,
        task: str,
        *,
        num_envs: int = 1,
        action: Action = "waves",
        fidelity: str = "standard",
        frames: int = FRAMES,
        draw: Iterable[str] = (),
        physics: Mapping[str, Values] | None = None,
        render_mode: str | None = None,
        width: int = View.width,
        height: int = View.height,
        camera: CameraName = View.camera,
        max_episode_steps: int | None = None,
    ) -> None:
        if max_episode_steps is not None and max_episode_steps < frames:
            raise UsageError(
                f"Episodes of {frames} frames do not fit into max_episode_steps={max_episode_steps}. "
                f"Give max_episode_steps={frames}, too."
            )
        if physics:
            raise UsageError(
                "The worlds of one solver share their physics, and physics drawn for each were asked for. Make "
                "worlds with solvers of their own: gymnasium.make_vec(..., vectorization_mode='sync')."
            )
        problem = problem_of(env, design, task, fidelity, frames, num_envs)
        self._take(
            Worlds(problem, num_envs, action, Beginnings(problem, draw), View(width, height, camera), render_mode)
        )
        self.render_mode = render_mode
        muscles = problem.body.muscle_count
        self.observation_parts = observation_parts(muscles, problem.task)
        self.action_parts = action_parts(muscles, action)

    @classmethod
    def of(cls, session: Session, action: Action = "waves") -> Self:
        """The worlds of an existing session, for a method that uses a problem's meter."""
        made = cls.__new__(cls)
        made._take(Worlds.of(session, action))
        return made

    @property
    def worlds(self) -> Worlds:
        """The worlds."""
        return self._worlds

    def _take(self, worlds: Worlds) -> None:
        self._worlds, self.num_envs = worlds, worlds.count
        self._generators = [np_random()[0] for _ in range(self.num_envs)]
        self.single_action_space = worlds.channels.action_space
        self.single_observation_space = worlds.channels.observation_space
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Floats, dict[str, Any]]:
        """Begin all episodes; returns the first observations `[num_envs, count]`.

        Args:
            seed: of the first world, the next ones having the numbers after it, or of each; None to draw on.
            options: none.

        Raises:
            UsageError: there are options, or not a seed for each world.
        """
        refuse_options(options)
        if seed is not None:
            seeds = [seed + world for world in range(self.num_envs)] if isinstance(seed, int) else list(seed)
            if len(seeds) != self.num_envs:
                raise UsageError(f"{len(seeds)} seeds were given for {self.num_envs} worlds. Give one for each.")
            self._generators = [
                known if given is None else np_random(given)[0]
                for known, given in zip(self._generators, seeds, strict=True)
            ]
        return self._worlds.begin(self._generators), {}

    def step(self, actions: Floats) -> Stepped:
        """Simulate a control frame in every world, with `actions` `[num_envs, count]`.

        Raises:
            UsageError: actions of another shape or not finite.
        """
        observations, step = self._worlds.step(actions)
        over = np.flatnonzero(step.terminated | step.truncated).tolist()
        info: dict[str, Any] = {}
        for world in over:
            info = self._add_info(
                info, {"final_obs": observations[world].copy(), "final_info": outcome(step, world)}, world
            )
        if over:
            observations = self._worlds.begin(self._generators, over)
        return observations, step.rewards, step.terminated, step.truncated, info

    def render(self) -> tuple[NDArray[np.uint8], ...] | None:
        """A picture of every world `[height, width, 3]` in the render mode `rgb_array`; else None."""
        if self.render_mode != "rgb_array":
            return None
        return tuple(self._worlds.picture(world) for world in range(self.num_envs))

    def close_extras(self, **kwargs: Any) -> None:
        """Close the pictures or the page."""
        self._worlds.close()
