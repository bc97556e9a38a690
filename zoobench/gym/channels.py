"""Observation and action spaces of a policy, and their relation to a session."""

from typing import Literal

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from zoobench import registry
from zoobench.cell.problem import Problem
from zoobench.cell.session import Session, new_session
from zoobench.controllers.base import PHASE_COUNT, with_phase
from zoobench.controllers.sine_basis import SineBasis
from zoobench.registry import Kind
from zoobench.spec import Budget, Ref, RunSpec

Floats = NDArray[np.float32]
Action = Literal["waves", "muscles"]

_UNLIMITED = Budget("substeps", 1e18)


class Channels:
    """Observations and actions of a policy in a session.

    An observation is that of `zoobench.cell.observation.ObservationModel`, task and time left included, followed by the
    phase of the waves. An action is given for every frame, in [-1, 1]:

    * `waves`: the parameters of the sine basis (specification G): weights, muscle by muscle and slow waves first, then
      biases. The activity of muscle k is tanh(b_k + sum_j W_kj wave_j(t)) at the start t of the frame;
    * `muscles`: the activity of every muscle.
    """

    def __init__(self, session: Session, action: Action) -> None:
        self._session, self._action = session, action
        muscles = session.muscle_count
        count = SineBasis().parameter_count(muscles) if action == "waves" else muscles
        self.action_space = spaces.Box(-1.0, 1.0, (count,), np.float32)
        self.observation_space = spaces.Box(-np.inf, np.inf, (session.observation_count + PHASE_COUNT,), np.float32)

    def inputs(self, observations: NDArray[np.float64]) -> Floats:
        """Inputs of the policy `[worlds, count]`, from the session's present observations."""
        import torch

        pairs = zip(observations, self._session.times.tolist(), strict=True)
        return np.stack([with_phase(torch.as_tensor(row), time).numpy() for row, time in pairs]).astype(np.float32)

    def activity(self, actions: Floats) -> NDArray[np.float64]:
        """Muscle activity `[worlds, muscle_count]` for actions `[worlds, count]`, which are clipped to [-1, 1]."""
        import torch

        clipped = np.clip(np.asarray(actions, dtype=np.float64), -1.0, 1.0)
        if self._action == "muscles":
            return clipped
        muscles, times = self._session.muscle_count, self._session.times
        pairs = zip(torch.as_tensor(clipped), torch.as_tensor(times), strict=True)
        return torch.stack([SineBasis().actuation(row[None], time[None], muscles)[0, 0] for row, time in pairs]).numpy()


def session_of(env: str, design: str, task: str, fidelity: str, frames: int, worlds: int) -> Session:
    """A session of this cell with an unlimited budget; components are written as on the command line.

    Raises:
        UnknownNameError, UsageError, SceneError: the components are unknown or cannot be simulated.
    """
    kinds = (Kind.ENV, Kind.TASK, Kind.DESIGN, Kind.CONTROLLER, Kind.FIDELITY)
    texts = (env, task, design, "policy-network", fidelity)
    refs = {kind: registry.resolve(kind, Ref.parse(text)) for kind, text in zip(kinds, texts, strict=True)}
    spec = RunSpec(
        env=refs[Kind.ENV],
        task=refs[Kind.TASK],
        design=refs[Kind.DESIGN],
        controller=refs[Kind.CONTROLLER],
        method=Ref("gymnasium"),
        seed=0,
        budget=_UNLIMITED,
        fidelity=refs[Kind.FIDELITY],
        frames=frames,
    )
    return new_session(Problem(spec, worlds=worlds))
