"""The worlds of one solver as a vector environment of stable-baselines3."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from stable_baselines3.common.vec_env import VecEnv

from zoobench.gym.vector import ZooVectorEnv


class ZooVecEnv(VecEnv):
    """A `ZooVectorEnv` with the interface of stable-baselines3: all worlds in this process, and in one solver.

    At the end of an episode info holds `terminal_observation` and `TimeLimit.truncated`, as the library expects, and
    what `ZooEnv` tells: `score` and `metrics`, or `failure`.

    Args:
        envs: the environments, as `gymnasium.make_vec` makes them.

    Attributes:
        rewards: of every step since the list was cleared, the mean over worlds.
    """

    def __init__(self, envs: ZooVectorEnv) -> None:
        self._envs = envs
        self._actions: NDArray[Any] = np.zeros(0)
        self.rewards: list[float] = []
        super().__init__(envs.num_envs, envs.single_observation_space, envs.single_action_space)

    def reset(self) -> NDArray[Any]:
        """Begin all episodes, with the seeds that `seed` has set."""
        seeds = None if None in self._seeds else self._seeds
        observations, _ = self._envs.reset(seed=seeds, options=next(filter(None, self._options), None))
        self._reset_seeds()
        self._reset_options()
        return observations

    def step_async(self, actions: NDArray[Any]) -> None:
        """Store the actions for `step_wait`."""
        self._actions = actions

    def step_wait(self) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any], list[dict[str, Any]]]:
        """Simulate a control frame in all worlds."""
        observations, rewards, terminated, truncated, info = self._envs.step(self._actions)
        self.rewards.append(float(rewards.mean()))
        over = terminated | truncated
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        for world in np.flatnonzero(over).tolist():
            infos[world] = {
                **_of_world(info.get("final_info", {}), world),
                "terminal_observation": info["final_obs"][world],
                "TimeLimit.truncated": bool(truncated[world]),
            }
        return observations, rewards, over, infos

    def get_images(self) -> Sequence[NDArray[np.uint8] | None]:
        """A picture of every world `[height, width, 3]`; None without a render mode."""
        return self._envs.render() or [None] * self.num_envs

    def close(self) -> None:
        """Close the environments."""
        self._envs.close()

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """The attribute of the vector environment for each world."""
        return [getattr(self._envs, attr_name) for _ in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """Worlds have no attributes of their own."""
        raise NotImplementedError("The worlds of one solver have no attributes of their own.")

    def env_method(self, method_name: str, *method_args: Any, indices: Any = None, **method_kwargs: Any) -> list[Any]:
        """Worlds have no methods of their own."""
        raise NotImplementedError("The worlds of one solver have no methods of their own.")

    def env_is_wrapped(self, wrapper_class: Any, indices: Any = None) -> list[bool]:
        """False for each world."""
        return [False for _ in self._get_indices(indices)]


def _of_world(info: dict[str, Any], world: int) -> dict[str, Any]:
    """The part of a vector environment's info that is of one world."""
    return {
        key: _of_world(value, world) if isinstance(value, dict) else value[world]
        for key, value in info.items()
        if not key.startswith("_") and info[f"_{key}"][world]
    }
