"""Measured costs of a simulated second, by environment and fidelity, from the published accuracy study."""

from functools import cache

from zoobench.accuracy.levels import LevelRow, published
from zoobench.registry import Kind, short
from zoobench.spec import Ref


@cache
def rate(env: Ref, fidelity: Ref) -> LevelRow | None:
    """The level with the costs of an environment at a fidelity with all defaults; None if they were not measured.

    Of whatever version: a change of numbers is hardly ever one of cost.
    """
    if short(Kind.FIDELITY, fidelity) != fidelity.name:
        return None
    place = short(Kind.ENV, env)
    return next((row for row in published().levels if (row.env, row.fidelity) == (place, fidelity.name)), None)


def origin() -> str:
    """Where the rates come from, in words."""
    machines = sorted({text.rpartition(", ")[2] for text in published().origin})
    return f"animals on one core of {' and '.join(machines)}, docs/accuracy.md"
