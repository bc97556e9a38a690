"""Shell completion of the values of options and arguments.

Every function takes the text typed so far and gives the whole words that it may become. None loads torch or Taichi.
"""

from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING

from typer import Context

if TYPE_CHECKING:
    from zoobench.registry import Kind

_NEWEST = 200  # runs that are offered; older ones are typed

Offer = Callable[[str], list[str]]


def components(kind: str) -> Offer:
    """Names of a kind, as `envs`; of the last one in a list with commas."""

    def offer(incomplete: str) -> list[str]:
        from zoobench.registry import Kind

        return _continued(incomplete, _names([Kind(kind)]))

    return offer


def components_and_runs(context: Context, incomplete: str) -> list[tuple[str, str]]:
    """Names of all kinds, and the newest runs once a number is begun."""
    from zoobench.registry import Kind

    found = [(name, "") for name in starting(_names(Kind), incomplete)]
    return found + (runs(context, incomplete) if incomplete else [])


def suites(incomplete: str) -> list[str]:
    """The suites of the package, and their parts."""
    from zoobench.harness import suites as known

    return starting((name for suite in known.names() for name in known.summaries(suite)), incomplete)


def presets(incomplete: str) -> list[str]:
    """The presets."""
    from zoobench.harness import presets as known

    return starting(known.names(), incomplete)


def runs(context: Context, incomplete: str) -> list[tuple[str, str]]:
    """The newest runs of the database that the command line names, each with a description."""
    from zoobench.db.query import Reader
    from zoobench.errors import ZoobenchError

    usual = next(option.default for option in context.command.params if option.name == "db")
    try:
        with Reader(context.params.get("db") or str(usual), create=False) as reader:
            found = reader.newest(_NEWEST)
    except ZoobenchError:  # there is none yet, or it cannot be read, which the command itself will say
        return []
    return [(str(row.id), f"{row.spec}, {row.state}") for row in found if str(row.id).startswith(incomplete)]


def solutions(context: Context, incomplete: str) -> list[tuple[str, str]]:
    """The newest runs, and the best ones of the published leaderboards."""
    # there are more of them than fit a screen
    return runs(context, incomplete) + (solutions_like(incomplete) if incomplete else [])


def solutions_like(start: str) -> list[tuple[str, str]]:
    """The published solutions whose names begin so, and which they are."""
    from zoobench.db import published
    from zoobench.harness.starts import words_of

    return [(name, words_of(published.named(name))) for name in starting(published.names(), start)]


def _names(chosen: "Iterable[Kind]") -> list[str]:
    from zoobench import registry

    return sorted({name for kind in chosen for name in registry.names(kind)})


def _continued(incomplete: str, names: Iterable[str]) -> list[str]:
    """The list with its last name completed; nothing within the brackets of a name's settings."""
    before, comma, start = incomplete.rpartition(",")
    if incomplete.count("[") > incomplete.count("]"):
        return []
    return [f"{before}{comma}{name}" for name in starting(names, start)]


def starting(names: Iterable[str], start: str) -> list[str]:
    """Those that a word can become."""
    return [name for name in names if name.startswith(start)]
