"""Bodies from users' files, made before anything is queued: those that cannot be made are refused, others commented."""

from collections.abc import Iterable, Iterator

from zoobench import registry
from zoobench.registry import Kind
from zoobench.spec import RunSpec


def body_notes(specs: Iterable[RunSpec]) -> Iterator[str]:
    """What a user should know of the bodies that these runs make of files, at their fidelities, as lines of text.

    Raises:
        UsageError, SceneError: one cannot be made.
    """
    from zoobench.cell.robot import sampled

    for design, fidelity in dict.fromkeys((spec.design, spec.fidelity) for spec in specs):
        if "file" in registry.get(Kind.DESIGN, design.name, design.version).tags:
            _, body = sampled(design, registry.create(Kind.FIDELITY, fidelity))
            yield from (f"{design.name}: {note}" for note in body.notes)
