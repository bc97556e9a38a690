"""From selectors to runs: the product of the axes, as specs or as skips with their reason. No database here."""

import math
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from itertools import product

from zoobench import registry
from zoobench.cell.firm_ground import firm_ground_fault
from zoobench.cell.scene_fault import scene_fault
from zoobench.cell.task_fault import task_fault
from zoobench.errors import UnknownNameError, UsageError
from zoobench.harness.budget_fault import budget_fault
from zoobench.registry import Kind, short
from zoobench.spec import Budget, Ref, RunSpec, Selector, matching, on_gpu

NEEDS_GRADIENT = "gradient"  # tag of a method
SHARED = (
    ("policy", Kind.CONTROLLER, "trains a policy"),
    ("space", Kind.DESIGN, "needs a design space"),
    ("sites", Kind.DESIGN, "needs a design space with a row of parameters for every site"),
)
"""Tags of a method that the component of this kind must have too, and the reason in words."""
CLASHING = (("given-body", Kind.DESIGN, "space", "needs a body that is given", "is a design space"),)
"""Tags of a method, and those that the component of this kind must not have then, with the reason in words."""
HAS_NO_GRADIENT = "no-gradient"  # tag of any other component
MOST_SEEDS = 10_000
MOST_RUNS = 200_000  # of one grid
_AXES = ("envs", "tasks", "designs", "controllers", "methods", "seeds")


@dataclass(frozen=True)
class GridSpec:
    """The axes of a benchmark; every combination is a cell, every cell with every seed a run."""

    envs: tuple[Ref, ...]
    tasks: tuple[Ref, ...]
    designs: tuple[Ref, ...]
    controllers: tuple[Ref, ...]
    methods: tuple[Ref, ...]
    seeds: tuple[int, ...]
    budget: Budget
    fidelity: Ref
    frames: int


@dataclass(frozen=True)
class Skip:
    """A run of the grid that cannot be done, and why."""

    spec: RunSpec
    reason: str


def expand(grid: GridSpec) -> list[RunSpec | Skip]:
    """All runs of a grid, each once, with every reference resolved; seeds vary fastest.

    Raises:
        UnknownNameError, UsageError: an axis is empty, or names or sets what does not exist, or the runs are too many.
    """
    for axis in _AXES:
        if not getattr(grid, axis):
            raise UsageError(f"The grid has no {axis}. Name at least one.")
    if (count := math.prod(len(getattr(grid, axis)) for axis in _AXES)) > MOST_RUNS:
        raise UsageError(
            f"The grid has {count:,} runs, and {MOST_RUNS:,} are the most. Name fewer components or seeds."
        )
    runs: dict[str, RunSpec | Skip] = {}
    for spec in _product(grid):
        reason = _why_impossible(spec)
        runs[spec.key()] = spec if reason is None else Skip(spec, reason)
    return list(runs.values())


def parse_selector(text: str, kind: Kind) -> list[Ref]:
    """Read `desert,ice`, `*`, `des*` or `name-v1[key=value]` (also `random*[batch=4]`) as references, each once.

    A glob leaves out components for studies, and those that lack settings.

    Raises:
        UnknownNameError: a name or pattern that fits no component; suggests the nearest.
        UsageError: another shape, or an unknown version.
    """
    refs: dict[Ref, None] = {}
    for selector in Selector.parse_all(text):
        found = matching(selector.name, registry.names(kind), kind.noun)
        if selector.is_glob:
            given = {key for key, _ in selector.params}
            found = [name for name in found if _is_meant(registry.get(kind, name), given)]
            if not found:
                raise UnknownNameError(kind.noun, selector.text, registry.names(kind))
        for name in found:
            registry.get(kind, name, selector.version)
            refs[Ref(name, selector.version, selector.params)] = None
    return list(refs)


def parse_one(text: str, kind: Kind) -> Ref:
    """Read a selector that stands for one component.

    Raises:
        UsageError: it stands for several; otherwise as `parse_selector`.
    """
    refs = parse_selector(text, kind)
    if len(refs) > 1:
        names = ", ".join(ref.name for ref in refs)
        raise UsageError(f"{text!r} means several, {names}, and one {kind.noun} is taken here. Name one of them.")
    return refs[0]


def _is_meant(component: registry.Component, given: Collection[str]) -> bool:
    """Whether a glob stands for a component too: not for those of studies, nor for those that lack a parameter."""
    lacks_settings = not component.required <= set(given) or (component.needs_settings and not given)
    return registry.FOR_STUDIES not in component.tags and not lacks_settings


def _product(grid: GridSpec) -> Iterator[RunSpec]:
    axes = (
        _resolve(Kind.ENV, grid.envs),
        _resolve(Kind.TASK, grid.tasks),
        _resolve(Kind.DESIGN, grid.designs),
        _resolve(Kind.CONTROLLER, grid.controllers),
        _resolve(Kind.METHOD, grid.methods),
    )
    (fidelity,) = _resolve(Kind.FIDELITY, (grid.fidelity,))
    for env, task, design, controller, method in product(*axes):
        for seed in grid.seeds:
            yield RunSpec(env, task, design, controller, method, seed, grid.budget, fidelity, grid.frames)


def _resolve(kind: Kind, refs: tuple[Ref, ...]) -> list[Ref]:
    for ref in refs:
        registry.create(kind, ref)  # a component refuses values that make no sense: now, and not in every run
    return [registry.resolve(kind, ref) for ref in refs]


def _why_impossible(spec: RunSpec) -> str | None:
    method = registry.get(Kind.METHOD, spec.method.name, spec.method.version)
    refs = {Kind.DESIGN: spec.design, Kind.CONTROLLER: spec.controller}
    for tag, kind, wish in SHARED:
        other = registry.get(kind, refs[kind].name, refs[kind].version)
        if tag in method.tags - other.tags:
            known = (name for name in registry.names(kind) if tag in registry.get(kind, name).tags)
            return (
                f"The method {method.name!r} {wish}, and the {kind.noun} {other.name!r} is none. "
                f"Choose one that is: --{kind.noun} {','.join(known)}."
            )
    if fault := task_fault(spec):
        return fault
    for tag, kind, unfit, wish, fact in CLASHING:
        other = registry.get(kind, refs[kind].name, refs[kind].version)
        if tag in method.tags and unfit in other.tags:
            all_of_kind = (registry.get(kind, name) for name in registry.names(kind))
            known = (each.name for each in all_of_kind if unfit not in each.tags and not each.required)
            return (
                f"The method {method.name!r} {wish}, and the {kind.noun} {other.name!r} {fact}. "
                f"Choose one that is none: --{kind.noun} {','.join(known)}."
            )
    if method.lacking:
        return method.lacking
    if on_gpu(spec) and registry.create(Kind.ENV, spec.env).water is not None:
        return (
            f"Water on a grid is not simulated on a GPU, and {short(Kind.ENV, spec.env)!r} is full of it. Simulate "
            "that on the CPU, or choose water=surface."
        )
    if fault := firm_ground_fault(spec) or scene_fault(spec):
        return fault
    return (_gradient_fault(spec) if NEEDS_GRADIENT in method.tags else "") or budget_fault(spec) or None


def _gradient_fault(spec: RunSpec) -> str:
    """Why a run has no gradient; empty if it has one."""
    others = (
        (Kind.ENV, spec.env),
        (Kind.TASK, spec.task),
        (Kind.DESIGN, spec.design),
        (Kind.CONTROLLER, spec.controller),
    )
    for kind, ref in others:
        if HAS_NO_GRADIENT in registry.get(kind, ref.name, ref.version).tags:
            return f"The method {spec.method.name!r} needs a gradient, and the {kind.noun} {ref.name!r} has none."
    return ""
