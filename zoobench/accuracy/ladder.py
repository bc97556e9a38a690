"""The levels of accuracy: fidelities on ever finer grids."""

import math

from zoobench import registry
from zoobench.errors import UsageError
from zoobench.registry import Kind
from zoobench.spec import Ref

LADDER = ("draft", "standard", "paper", "fine", "reference")
"""The levels, from coarse to fine; a finer grid has proportionally shorter steps."""


def finer(fidelity: Ref) -> Ref:
    """The level two steps finer, with its usual settings.

    Raises:
        UsageError: there is none, or the given one has a grid as fine by its settings.
    """
    index = LADDER.index(fidelity.name) + 2 if fidelity.name in LADDER else len(LADDER)
    if index >= len(LADDER):
        raise UsageError(f"No fidelity is known two steps finer than {fidelity.name}. Those are {', '.join(LADDER)}.")
    found = registry.resolve(Kind.FIDELITY, Ref(LADDER[index]))
    if float(fidelity.kwargs.get("grid_spacing", math.inf)) <= float(found.kwargs["grid_spacing"]):
        raise UsageError(f"{found.name} is no finer than {fidelity}. Give a level of {', '.join(LADDER)} as it is.")
    return found


def next_finer(home: Ref, tried: Ref | None) -> Ref | None:
    """Where to confirm a score found at `home` next, if it diverged where it was `tried` before; None if nowhere.

    Two levels finer, and then there with 27 particles per cell: a strongly bent robot that parts between 8 holds.

    Raises:
        UsageError: see `finer`.
    """
    if tried is None:
        return finer(home)
    dense = Ref(tried.name, tried.version, (("particles_per_cell", 27),)).with_defaults(**tried.kwargs)
    return None if dense == tried else dense
