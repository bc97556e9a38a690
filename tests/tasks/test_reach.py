"""Reach, and climb."""

import pytest
import torch

from tests.tasks.motions import block, motion
from zoobench.tasks.climb import Climb
from zoobench.tasks.reach import Reach


def test_reaching_counts_the_fall_of_the_heads_distance() -> None:
    """The head comes straight to the place: the score is the whole distance; a robot at rest scores zero."""
    rest = block()
    task = Reach(x=0.03, y=0.04, z=0.0)
    way = torch.linspace(0.0, 1.0, 6, dtype=torch.float64)[:, None, None]
    there = motion(rest, rest + way * torch.tensor([0.03, 0.04, 0.0], dtype=torch.float64))
    assert float(task.score(there)) == pytest.approx(0.05)
    assert float(task.metrics(there)["target_distance"][0]) == pytest.approx(0.0, abs=1e-12)
    assert float(task.score(motion(rest, rest.expand(6, -1, -1)))) == pytest.approx(0.0, abs=1e-15)


def test_a_jump_at_the_end_is_no_climb() -> None:
    """The mean height of the last quarter counts: what rises steadily has it, a jump in the last frame an eighth."""
    rest = block()
    up = torch.tensor([0.0, 1.0, 0.0], dtype=torch.float64)
    heights = torch.zeros(33, 1, 1, dtype=torch.float64)
    heights[-1] = 0.08
    assert float(Climb().score(motion(rest, rest + heights * up))) == pytest.approx(0.01)
    raised = 0.02 * (torch.arange(33) > 0).double()[:, None, None]
    steady = motion(rest, rest + raised * up)
    assert float(Climb().score(steady)) == pytest.approx(0.02)
