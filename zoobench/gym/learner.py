"""Proximal policy optimisation by stable-baselines3."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.logger import Logger
from torch.nn.utils import parameters_to_vector, vector_to_parameters

from zoobench.arrays import Array
from zoobench.gym.sb3 import ZooVecEnv
from zoobench.gym.vector import ZooVectorEnv


class Learner:
    """PPO of a policy with two hidden layers of tanh units and a value function of the same form.

    Args:
        envs: the training environments.
        actor: the policy's initial parameters, in the order of `zoobench.controllers.policy_network`.
        hidden: units of a hidden layer.
        deviation: initial standard deviation of the exploration, in every action.
        settings: further arguments of `stable_baselines3.PPO`.

    Raises:
        ValueError: `actor` has another number of parameters.
    """

    def __init__(
        self, envs: ZooVectorEnv, actor: Array, hidden: int, deviation: float, settings: Mapping[str, Any]
    ) -> None:
        self._worlds = ZooVecEnv(envs)
        self._model = PPO(
            "MlpPolicy",
            self._worlds,
            policy_kwargs={
                "net_arch": {"pi": [hidden, hidden], "vf": [hidden, hidden]},
                "activation_fn": torch.nn.Tanh,
                "log_std_init": float(np.log(deviation)),
            },
            device="cpu",
            **settings,
        )
        self._model.set_logger(Logger(folder=None, output_formats=[]))
        expected = sum(part.numel() for part in self._actor())
        if len(actor) != expected:
            raise ValueError(f"The policy has {expected} parameters, but {len(actor)} were given.")
        vector_to_parameters(torch.as_tensor(actor, dtype=torch.float32), self._actor())

    @property
    def actor(self) -> Array:
        """The policy's parameters."""
        return parameters_to_vector(self._actor()).detach().double().numpy()

    @property
    def deviation(self) -> float:
        """Present standard deviation of the exploration, averaged over actions."""
        return float(self._model.policy.log_std.detach().exp().mean())

    @property
    def timesteps(self) -> int:
        """Number of frames learnt from."""
        return self._model.num_timesteps

    def learn(self) -> float:
        """Fill the buffer once and learn from it; returns the mean reward of its frames."""
        self._worlds.rewards.clear()
        self._model.learn(self._model.n_steps * self._worlds.num_envs, reset_num_timesteps=False)
        return float(np.mean(self._worlds.rewards))

    def state(self) -> dict[str, Any]:
        """Plain tensors and numbers for a checkpoint; the worlds are not part of it."""
        policy = self._model.policy
        return {"policy": policy.state_dict(), "optimiser": policy.optimizer.state_dict(), "timesteps": self.timesteps}

    def load(self, state: Mapping[str, Any]) -> None:
        """The inverse of `state`."""
        self._model.policy.load_state_dict(state["policy"])
        self._model.policy.optimizer.load_state_dict(state["optimiser"])
        self._model.num_timesteps = state["timesteps"]

    def _actor(self) -> Sequence[torch.nn.Parameter]:
        policy = self._model.policy
        return [*policy.mlp_extractor.policy_net.parameters(), *policy.action_net.parameters()]
