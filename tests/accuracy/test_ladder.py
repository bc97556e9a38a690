"""The next finer levels."""

import pytest

from zoobench import registry
from zoobench.accuracy.ladder import finer, next_finer
from zoobench.errors import UsageError
from zoobench.registry import Kind
from zoobench.spec import Ref


def test_two_levels_finer() -> None:
    """With its usual settings, whatever those of the coarser one are; none where the ladder ends."""
    assert finer(Ref.parse("draft-v2[precision=64]")) == registry.resolve(Kind.FIDELITY, Ref("paper"))
    for name in ("fine", "smoke"):
        with pytest.raises(UsageError, match=f"two steps finer than {name}"):
            finer(Ref(name))
    with pytest.raises(UsageError, match=r"paper is no finer than draft\[grid_spacing=0.0075\]"):
        finer(Ref.parse("draft[grid_spacing=0.0075]"))


def test_a_score_is_confirmed_with_more_particles_where_it_diverged() -> None:
    """Two levels finer, there with 27 in a cell, and nowhere else."""
    home = registry.resolve(Kind.FIDELITY, Ref("standard"))
    tried = next_finer(home, None)
    assert tried == finer(home)
    dense = next_finer(home, tried)
    assert dense == registry.resolve(Kind.FIDELITY, Ref.parse("fine[particles_per_cell=27]"))
    assert next_finer(home, dense) is None
