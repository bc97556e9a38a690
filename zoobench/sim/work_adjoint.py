"""The adjoint of the muscles' work, by the states at frame boundaries: none of it is simulated."""

from typing import NamedTuple

import numpy as np
import torch
from torch import Tensor

from zoobench.arrays import Array
from zoobench.sim.model.rollout import Rollout
from zoobench.sim.simulation import Simulation


class ByState(NamedTuple):
    """Derivatives of a loss by one state and, as far as they come from it, by the body.

    Attributes:
        deformation: by F `[worlds, robot, 3, 3]`.
        fibre: `[worlds, robot, 3]`.
        volume: `[worlds, robot]` [1/m^3].
    """

    deformation: Tensor
    fibre: Tensor
    volume: Tensor


class WorkAdjoint:
    """What a loss by `Rollout.muscle_work` adds to the adjoints of activity, states and body.

    The work -a (Q' - Q) of a frame is a function of its activity a and of the potentials Q before and Q' after it, and
    Q = s / 2 sum w V |F d|^2 one of F, membership w, volume V and fibre d of the particles.

    Args:
        simulation: with the rollout's body, and the worlds alive that have a gradient.
        by_work: derivative of the loss by the work of each frame of the episode `[frames, worlds, muscles]` [1/J].

    Attributes:
        actuation: derivative by the actuation as it stands in the work `[frames, worlds, muscles]`, those of
            equilibration among the frames.
    """

    def __init__(self, simulation: Simulation, rollout: Rollout, by_work: Array) -> None:
        parameters, device = simulation.parameters, simulation.matter.x.device
        self._half = 0.5 * simulation.scene.robot.material.muscle_strength
        self._fibre = parameters.fibre.double().clone()  # where the base moves, its velocity takes their place
        self._volume = parameters.volume[:, : simulation.elastic_count].double()
        self._membership = torch.as_tensor(rollout.body["muscle_membership"], device=device)
        self._by_membership = torch.zeros_like(self._membership)
        given = np.zeros(rollout.actuation.shape)
        given[rollout.equilibration :] = by_work * (simulation.is_alive() != 0)[:, None]
        self.actuation = -given * np.diff(rollout.muscle_potential, axis=0)
        by_potential = np.zeros(rollout.muscle_potential.shape)
        by_potential[:-1] += given * rollout.actuation
        by_potential[1:] -= given * rollout.actuation
        self._awaited = dict(enumerate(torch.as_tensor(by_potential, device=device)))

    def awaits(self, frame: int) -> bool:
        """Whether the state at the beginning of a frame has not been taken yet."""
        return frame in self._awaited

    def by_state(self, frame: int, F: Tensor) -> ByState:
        """The derivatives by the state at the beginning of a frame, which is taken once.

        Args:
            F: its deformation gradients `[worlds, robot, 3, 3]` [-].
        """
        by_potential, F = self._awaited.pop(frame)[:, None], F.double()
        stretched = (F * self._fibre[:, :, None]).sum(-1)
        density = self._half * stretched.square().sum(-1)
        by_energy = (self._membership * by_potential).sum(-1)
        by_stretched = (2.0 * self._half * self._volume * by_energy)[..., None] * stretched
        self._by_membership += (density * self._volume)[..., None] * by_potential
        return ByState(
            deformation=by_stretched[..., None] * self._fibre[:, :, None],
            fibre=(F * by_stretched[..., None]).sum(-2),
            volume=density * by_energy,
        )

    def membership(self) -> Array:
        """Derivative by the muscle membership as it stands in the potentials `[worlds, robot, muscles]`, of all states
        that were taken."""
        found: Array = self._by_membership.cpu().numpy()
        return found
