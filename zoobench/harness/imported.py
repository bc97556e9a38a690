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
    from zoobench.cell.firm_muscles import firm_body, firmness
    from zoobench.cell.robot import sampled

    said = set()
    for spec in specs:
        design = spec.design
        if "file" not in registry.get(Kind.DESIGN, design.name, design.version).tags:
            continue
        _, body = sampled(design, registry.create(Kind.FIDELITY, spec.fidelity))
        notes = list(body.notes)
        if firm_body(body, firmness(registry.create(Kind.ENV, spec.env).robot)) is not body:
            notes.append(f"Parts are too soft for their muscles in {spec.env.name}, which are weaker there.")
        for note in notes:
            if (design, spec.fidelity, note) not in said:
                said.add((design, spec.fidelity, note))
                yield f"{design.name}: {note}"
