"""Many worlds in one solver as a Gymnasium vector environment."""

from typing import Any, Self

import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from zoobench.cell.session import Session
from zoobench.errors import UsageError
from zoobench.gym.channels import Action, Channels, Floats, session_of

Numbers = NDArray[Any]
Stepped = tuple[Floats, Numbers, Numbers, Numbers, dict[str, Any]]


class ZooVectorEnv(VectorEnv[Floats, Floats, Numbers]):
    """`num_envs` environments as `ZooEnv`; each gives the same numbers as alone, bit for bit.

    A world whose episode is over begins the next one in the same step and returns its first observation. Where
    `_final_obs` in info is true, `final_obs` holds the last observation of the old episode; where it terminated,
    `failure` holds the reason.

    Args:
        env, design, task, action, fidelity, frames: as in `ZooEnv`.
        num_envs: number of worlds.

    Raises:
        UnknownNameError, UsageError, SceneError: the components are unknown or cannot be simulated.
    """

    metadata: dict[str, Any] = {"render_modes": [], "autoreset_mode": AutoresetMode.SAME_STEP}  # noqa: RUF012

    def __init__(
        self,
        env: str,
        design: str,
        task: str,
        *,
        num_envs: int = 1,
        action: Action = "waves",
        fidelity: str = "standard",
        frames: int = 200,
    ) -> None:
        self._take(session_of(env, design, task, fidelity, frames, worlds=num_envs), action)

    @classmethod
    def of(cls, session: Session, action: Action = "waves") -> Self:
        """The worlds of an existing session, for a method that uses a problem's meter."""
        made = cls.__new__(cls)
        made._take(session, action)
        return made

    def _take(self, session: Session, action: Action) -> None:
        self._session, self._channels = session, Channels(session, action)
        self.num_envs = session.worlds
        self.single_action_space = self._channels.action_space
        self.single_observation_space = self._channels.observation_space
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Floats, dict[str, Any]]:
        """Begin all episodes; returns the first observations `[num_envs, count]`."""
        super().reset(seed=seed)
        return self._channels.inputs(self._session.begin()), {}

    def step(self, actions: Floats) -> Stepped:
        """Simulate a control frame in every world, with `actions` `[num_envs, count]`.

        Raises:
            UsageError: actions of another shape or not finite.
        """
        if actions.shape != self.action_space.shape:
            raise UsageError(f"The actions have shape {actions.shape}; {self.action_space.shape} was expected.")
        step = self._session.step(self._channels.activity(actions))
        observations = self._channels.inputs(step.observations)
        over = step.terminated | step.truncated
        info: dict[str, Any] = {}
        if over.any():
            info = {"final_obs": observations, "_final_obs": over}
            observations = self._channels.inputs(self._session.begin(np.flatnonzero(over).tolist()))
        if step.failures:
            reasons = [str(step.failures.get(world, "")) for world in range(self.num_envs)]
            info |= {"failure": np.array(reasons, dtype=object), "_failure": step.terminated.copy()}
        return observations, step.rewards, step.terminated, step.truncated, info
