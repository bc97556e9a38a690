"""Measured costs of a simulated second, by environment and fidelity, from the published accuracy study."""

from functools import cache

from zoobench import registry
from zoobench.accuracy.levels import LevelRow, published
from zoobench.errors import UsageError
from zoobench.registry import Kind
from zoobench.spec import Ref


@cache
def rate(env: Ref, fidelity: Ref) -> LevelRow | None:
    """The level with the costs of an environment at a fidelity, both with all defaults; None if they were not measured.

    Of whatever version: a change of numbers is hardly ever one of cost.
    """
    if not (_is_plain(Kind.ENV, env) and _is_plain(Kind.FIDELITY, fidelity)):
        return None
    rows = (row for row in published().levels if (row.env, row.fidelity) == (env.name, fidelity.name))
    return next(rows, None)


def origin() -> str:
    """Where the rates come from, in words."""
    machines = sorted({text.rpartition(", ")[2] for text in published().origin})
    return f"animals on one core of {' and '.join(machines)}, docs/accuracy.md"


def _is_plain(kind: Kind, ref: Ref) -> bool:
    try:
        return registry.resolve(kind, Ref(ref.name)).params == ref.params
    except UsageError:  # of a plug-in that is gone
        return False
