"""Specs of smoke size for any registered component."""

from zoobench import registry
from zoobench.registry import Kind
from zoobench.spec import Budget, Ref, RunSpec

DEFAULTS = {
    Kind.ENV: "ground",
    Kind.TASK: "movement-speed",
    Kind.DESIGN: "caterpillar",
    Kind.CONTROLLER: "sine-basis",
    Kind.METHOD: "random",
    Kind.FIDELITY: "smoke",
}

POND = "ocean[depth=0.09375,length=0.1875,width=0.125,bulk_modulus=20000]"
"""The ocean in little, and soft, so that its steps are long: whatever swims in it is at rest in a fraction of the
time."""


def cell(budget: Budget | None = None, frames: int = 6, seed: int = 0, **names: str) -> RunSpec:
    """A resolved spec; axes are named by the kind's noun: `cell(environment="ice", fidelity="smoke[precision=64]")`."""
    refs = {
        kind: registry.resolve(kind, Ref.parse(names.pop(kind.noun, default))) for kind, default in DEFAULTS.items()
    }
    assert not names, names
    return RunSpec(
        env=refs[Kind.ENV],
        task=refs[Kind.TASK],
        design=refs[Kind.DESIGN],
        controller=refs[Kind.CONTROLLER],
        method=refs[Kind.METHOD],
        fidelity=refs[Kind.FIDELITY],
        seed=seed,
        budget=budget or Budget("substeps", 1e9),
        frames=frames,
    )
