"""The solvers of one scene."""

import pytest
import torch

from tests.sim import scenes
from zoobench.cell.solvers import Solvers
from zoobench.errors import UsageError
from zoobench.sim import equilibrium
from zoobench.sim.model.fidelity import Fidelity


def test_a_gpu_that_is_not_there_is_missed_before_the_scene_comes_to_rest(monkeypatch: pytest.MonkeyPatch) -> None:
    """Rest is found on the CPU, which takes minutes on a fine grid."""
    rested: list[Fidelity] = []
    monkeypatch.setattr(torch.cuda, "is_available", lambda: False)
    monkeypatch.setattr(equilibrium, "equilibrated", lambda _, fidelity, *__, **___: rested.append(fidelity))
    solvers = Solvers(scenes.ground_scene(), Fidelity(scenes.SPACING, device="cuda"), 10)
    with pytest.raises(UsageError, match="No CUDA device is available"):
        solvers.get(1, gradient=False)
    assert not rested
