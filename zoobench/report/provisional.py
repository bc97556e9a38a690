"""Environments whose scores are provisional: a dagger at their names, and a footnote that says why."""

from collections.abc import Iterable, Mapping

from zoobench.registry import Kind, caveat
from zoobench.spec import Ref

MARK = "†"


def marked(names: Mapping[Ref, str]) -> dict[Ref, str]:
    """The labels of environments, those of provisional ones with a dagger."""
    return {env: f"{name} {MARK}" if caveat(Kind.ENV, env) else name for env, name in names.items()}


def footnotes(envs: Iterable[Ref]) -> tuple[str, ...]:
    """A line for each environment whose scores are provisional, sorted by name."""
    whys = {(env.name, why) for env in set(envs) if (why := caveat(Kind.ENV, env))}
    return tuple(f"{MARK} {name} is provisional: {why}" for name, why in sorted(whys))
