"""One world as a Gymnasium environment."""

from typing import Any

import gymnasium

from zoobench.errors import UsageError
from zoobench.gym.channels import Action, Channels, Floats, session_of


class ZooEnv(gymnasium.Env[Floats, Floats]):
    """A cell of the benchmark with a step of one control frame, 0.008 s; actions and observations as in `Channels`.

    The reward is the task's. An episode is truncated at its length and terminated if the simulation diverges or the
    robot tears, with the reason as `failure` in info; for its reward see `zoobench.cell.session.Step`. The environment
    is deterministic: seeds have no effect.

    Args:
        env, design, task: components, with parameters if needed, as in `desert[relief=0.03]`.
        action: `waves` or `muscles`.
        fidelity: of the simulation.
        frames: length of an episode.

    Raises:
        UnknownNameError, UsageError, SceneError: the components are unknown or cannot be simulated.
    """

    metadata: dict[str, Any] = {"render_modes": []}  # noqa: RUF012

    def __init__(
        self,
        env: str,
        design: str,
        task: str,
        *,
        action: Action = "waves",
        fidelity: str = "standard",
        frames: int = 200,
    ) -> None:
        self._session = session_of(env, design, task, fidelity, frames, worlds=1)
        self._channels = Channels(self._session, action)
        self.action_space = self._channels.action_space
        self.observation_space = self._channels.observation_space

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Floats, dict[str, Any]]:
        """Begin an episode; returns the first observation."""
        super().reset(seed=seed)
        return self._channels.inputs(self._session.begin())[0], {}

    def step(self, action: Floats) -> tuple[Floats, float, bool, bool, dict[str, Any]]:
        """Simulate a control frame.

        Raises:
            UsageError: an action of another shape or not finite, or the episode is over.
        """
        if action.shape != self.action_space.shape:
            raise UsageError(f"The action has shape {action.shape}; {self.action_space.shape} was expected.")
        step = self._session.step(self._channels.activity(action[None]))
        info = {"failure": str(step.failures[0])} if step.failures else {}
        observation = self._channels.inputs(step.observations)[0]
        return observation, float(step.rewards[0]), bool(step.terminated[0]), bool(step.truncated[0]), info
