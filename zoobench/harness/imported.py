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
    from zoobench.cell.robot import Robot

    for (design, fidelity), controller in {(spec.design, spec.fidelity): spec.controller for spec in specs}.items():
        if "file" in registry.get(Kind.DESIGN, design.name, design.version).tags:
            body = Robot.of(design, controller, registry.create(Kind.FIDELITY, fidelity)).body
            yield from (f"{design.name}: {note}" for note in body.notes)
