"""Between a policy and a session: spaces, and what an action does."""

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
    """What a policy sees of a session and does to it.

    It sees the observation of `zoobench.cell.observation.ObservationModel` and, behind it, the phase of the waves. Its
    action is, for every frame anew and within [-1, 1],

    * `waves`: the parameters of the sine basis of the specification (G): weights, muscle by muscle and slow waves
      first, then biases. Muscle k does tanh(b_k + sum_j W_kj wave_j(t)) at the start t of the frame;
    * `muscles`: the activity of every muscle.
    """

    def __init__(self, session: Session, action: Action) -> None:
        self._session, self._action = session, action
        muscles = session.muscle_count
        count = SineBasis().parameter_count(muscles) if action == "waves" else muscles
        self.action_space = spaces.Box(-1.0, 1.0, (count,), np.float32)
        self.observation_space = spaces.Box(-np.inf, np.inf, (session.observation_count + PHASE_COUNT,), np.float32)

    def seen(self, observations: NDArray[np.float64]) -> Floats:
        """What the policy sees `[worlds, count]`, from a session's observations now."""
        import torch

        both = zip(observations, self._session.times.tolist(), strict=True)
        return np.stack([with_phase(torch.as_tensor(felt), time).numpy() for felt, time in both]).astype(np.float32)

    def activity(self, actions: Floats) -> NDArray[np.float64]:
        """What the muscles do `[worlds, muscle_count]`, for actions `[worlds, count]`; what is out of range is cut."""
        import torch

        cut = np.clip(np.asarray(actions, dtype=np.float64), -1.0, 1.0)
        if self._action == "muscles":
            return cut
        muscles, times = self._session.muscle_count, self._session.times
        both = zip(torch.as_tensor(cut), torch.as_tensor(times), strict=True)
        driven = [SineBasis().actuation(weights[None], time[None], muscles)[0, 0] for weights, time in both]
        return torch.stack(driven).numpy()


def session_of(env: str, design: str, task: str, fidelity: str, frames: int, worlds: int) -> Session:
    """A session of this cell with no limit to its budget; components are written as on the command line.

    Raises:
        UnknownNameError, UsageError, SceneError: they name or describe something that cannot be simulated.
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
