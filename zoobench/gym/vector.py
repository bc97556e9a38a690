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
    """Cells as in `ZooEnv`, as many as `num_envs`; each gives the same numbers, to the last bit, as alone.

    A world whose episode is over begins the next in the same step: what is returned is its first observation, and
    `final_obs` in info holds the last one of the old, where `_final_obs` is true; `failure` the reason, where it
    terminated.

    Args:
        env, design, task, action, fidelity, frames: as in `ZooEnv`.
        num_envs: how many worlds.

    Raises:
        UnknownNameError, UsageError, SceneError: they name or describe something that cannot be simulated.
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
        """The worlds of a session that is there already, for a method that goes by a problem's meter."""
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
        """Begin all episodes; the first observations `[num_envs, count]`."""
        super().reset(seed=seed)
        return self._channels.seen(self._session.begin()), {}

    def step(self, actions: Floats) -> Stepped:
        """Take every world through a control frame; `actions` `[num_envs, count]`.

        Raises:
            UsageError: actions of another shape or not finite.
        """
        if actions.shape != self.action_space.shape:
            raise UsageError(f"The actions have shape {actions.shape}; {self.action_space.shape} was expected.")
        step = self._session.step(self._channels.activity(actions))
        seen = self._channels.seen(step.observations)
        over = step.terminated | step.truncated
        info: dict[str, Any] = {}
        if over.any():
            info = {"final_obs": seen, "_final_obs": over}
            seen = self._channels.seen(self._session.begin(np.flatnonzero(over).tolist()))
        if step.failures:
            reasons = [str(step.failures.get(world, "")) for world in range(self.num_envs)]
            info |= {"failure": np.array(reasons, dtype=object), "_failure": step.terminated.copy()}
        return seen, step.rewards, step.terminated, step.truncated, info
