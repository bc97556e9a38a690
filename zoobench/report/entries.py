"""The entries of a table, its columns: methods with their controllers, and agents that were trained elsewhere."""

from collections.abc import Iterable, Sequence
from typing import NamedTuple

from zoobench import registry
from zoobench.registry import Kind
from zoobench.report.labels import in_order, labels
from zoobench.spec import Ref, RunSpec

EXTERNAL = "external"
"""Tag of a method that evaluates an agent of which no budget of training is known."""

UNKNOWN_COST = "¶"
"""The mark at such an agent."""


class Entry(NamedTuple):
    """A column of a table: a method with its controller."""

    controller: Ref
    method: Ref

    @property
    def is_external(self) -> bool:
        """Whether it was trained elsewhere, so that its cost is not known and it wins and loses nothing."""
        return is_external(self.method)

    @property
    def agent(self) -> str:
        """The name of an agent that was trained elsewhere; empty without one."""
        return str(self.method.kwargs.get("agent", "")) if self.is_external else ""


def is_external(method: Ref) -> bool:
    """Whether a method evaluates an agent that was trained elsewhere."""
    if method.name not in registry.names(Kind.METHOD):
        return False
    return EXTERNAL in registry.get(Kind.METHOD, method.name).tags


def entry_of(spec: RunSpec) -> Entry:
    """The column of a run."""
    return Entry(spec.controller, spec.method)


def entries_of(specs: Iterable[RunSpec]) -> tuple[Entry, ...]:
    """The columns of these runs in their order: own ones by controller and method, then agents from outside."""
    found = {entry_of(spec) for spec in specs}
    return tuple(sorted(found, key=lambda entry: (entry.is_external, *map(in_order, entry))))


def entry_labels(entries: Sequence[Entry]) -> dict[Entry, str]:
    """A name for each: the method, with its controller where there are several, and an agent's own with its mark."""
    own = [entry for entry in entries if not entry.is_external]
    controllers = labels(entry.controller for entry in own)
    methods = labels(entry.method for entry in own)
    found = {
        entry: methods[entry.method] + (f" ({controllers[entry.controller]})" if len(controllers) > 1 else "")
        for entry in own
    }
    agents = [entry for entry in entries if entry.is_external]
    names = labels(entry.method for entry in agents)
    for entry in agents:
        is_alone = entry.agent and [other.agent for other in agents].count(entry.agent) == 1
        found[entry] = f"{entry.agent if is_alone else names[entry.method]} {UNKNOWN_COST}"
    return found
