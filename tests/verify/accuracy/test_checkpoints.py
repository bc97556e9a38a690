"""The checkpoint interval costs time or memory, never a bit of the gradient."""

from zoobench.spec import Ref
from zoobench.verify.accuracy.checkpoints import checkpoints


def test_every_interval_gives_the_same_gradient_from_other_memory() -> None:
    """The one chosen holds the fewest states; one interval over the whole episode holds them all."""
    rows = list(checkpoints(Ref("ground"), Ref("smoke"), frames=12, intervals=(1, 3, 12, 0), repeats=1))
    assert all(row.same for row in rows)
    assert [row.chosen for row in rows] == [False, False, False, True]
    assert rows[-1].states == min(row.states for row in rows)
    assert rows[2].states == max(row.states for row in rows)
    assert all(row.seconds > 0 and row.memory > 0 for row in rows)
    assert rows[0].ratio == 1.0
