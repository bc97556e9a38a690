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
    from zoobench.cell.firm_muscles import firm_body
    from zoobench.cell.robot import sampled

    said = set()
    for design, fidelity, env in dict.fromkeys((spec.design, spec.fidelity, spec.env) for spec in specs):
        if "file" not in registry.get(Kind.DESIGN, design.name, design.version).tags:
            continue
        _, body = sampled(design, registry.create(Kind.FIDELITY, fidelity))
        notes = list(body.notes)
        if firm_body(body, registry.create(Kind.ENV, env).robot) is not body:
            notes.append(f"Parts are too soft for their muscles in {env.name}, which are weaker there.")
        for note in notes:
            if (design, fidelity, note) not in said:
                said.add((design, fidelity, note))
                yield f"{design.name}: {note}"
