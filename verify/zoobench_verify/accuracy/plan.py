"""Runs of the accuracy study: gaits are trained at some levels, and each is then evaluated at every level.

All are runs of the queue, resumed and stored like others: training by `diffphysics`, whose milestones are the gaits,
and evaluations by the method `probe`.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

from zoobench import registry
from zoobench.accuracy.ladder import LADDER
from zoobench.errors import UsageError
from zoobench.inputs import run_name
from zoobench.registry import KINDS, Kind
from zoobench.spec import AXES, Budget, Ref, RunSpec

KNOBS = (
    "courant=0.9", "courant=0.5", "courant=0.25", "particles_per_cell=1", "particles_per_cell=4",
    "particles_per_cell=27", "kernel=cubic", "transfer=pic", "transfer=apic", "transfer=aflip",
    "medium_transfer=aflip", "precision=64",
)  # fmt: skip
"""Parameters of the fidelity that differ from those of a level, each of them alone."""

DESIGNS = {"ocean": ("fish", "tuna", "shark")}
LAND_DESIGNS = ("caterpillar", "baby-seal", "panda", "fish")
"""Animals that are compared in an environment, where the user names none."""

TRAINED, STRONG = Ref("sine-basis"), Ref("sine-basis", params=(("scale", 1.0),))
"""Controllers that are trained, and random ones that use most of the muscles' range, so that their scores differ."""


@dataclass(frozen=True)
class StudyPlan:
    """Settings of the study.

    Attributes:
        levels: at which gaits are evaluated, names out of `LADDER`; the finest is the reference.
        found: of these, the levels at which gaits are trained.
        seeds: training runs of every cell at every level of `found`.
        iterations: of a training run.
        stages: gaits of a training run: its solution, and the best after half of the iterations, a quarter and so on.
        frames: length of an episode in control frames.
        gradients: the finest level with gradients; "" for none.
        around: the level at which knobs are turned; "" for none.
        draws: random controllers, evaluated as the gaits are.
        beyond: a level finer than all of these, at which solutions of the first seed show how far the references still
            are from the limit; "" for none.
    """

    levels: tuple[str, ...] = ("draft", "standard", "paper", "fine")
    found: tuple[str, ...] = ("draft", "standard")
    seeds: int = 2
    iterations: int = 32
    stages: int = 4
    frames: int = 100
    gradients: str = "paper"
    around: str = ""
    draws: int = 0
    beyond: str = ""

    def __post_init__(self) -> None:
        named = (*self.levels, *self.found, *filter(None, (self.gradients, self.around, self.beyond)))
        unknown = [name for name in named if name not in LADDER]
        if unknown or not self.levels:
            raise UsageError(f"Unknown levels: {', '.join(unknown) or 'none given'}. Choose from {', '.join(LADDER)}.")
        if min(self.seeds, self.iterations, self.stages, self.frames) < 1 or self.draws < 0:
            raise UsageError("Seeds, iterations, stages and frames must be at least 1, draws at least 0.")
        if self.beyond and max(map(LADDER.index, self.levels)) >= LADDER.index(self.beyond):
            raise UsageError(f"{self.beyond} is not finer than {', '.join(self.levels)}. Name a finer level, or none.")

    def fidelities(self) -> list[Ref]:
        """Where gaits are evaluated, from coarse to fine, the finest level with both transfers, then the knobs."""
        levels = sorted(set(self.levels), key=LADDER.index)
        knobs = [f"{self.around}[{knob}]" for knob in KNOBS if self.around]
        texts = (*levels, f"{levels[-1]}[transfer={other_transfer(levels[-1])}]", *knobs)
        return list(dict.fromkeys(registry.resolve(Kind.FIDELITY, Ref.parse(text)) for text in texts))


QUICK = StudyPlan(
    levels=("draft", "standard"), found=("draft",), iterations=2, stages=2, frames=10, gradients="standard"
)
"""Two levels and short episodes: a check that everything works, in seconds per environment."""


def other_transfer(level: str) -> str:
    """The less, or more, dissipative alternative to a level's own transfer; both head for the same limit."""
    own = registry.get(Kind.FIDELITY, level).defaults["transfer"]
    return "aflip" if own == "apic" else "apic"


def trainings(
    envs: Sequence[Ref], tasks: Sequence[Ref], plan: StudyPlan, designs: Sequence[Ref] | None = None
) -> list[RunSpec]:
    """The training runs, those of cheap levels first; without `designs` of the animals of each environment.

    Raises:
        UnknownNameError, UsageError: a name or parameter that cannot be used.
    """
    method = Ref("diffphysics", params=(("iterations", plan.iterations), ("restarts", 1)))
    budget = Budget("iterations", plan.iterations)
    return [
        replace(cell, method=registry.resolve(Kind.METHOD, method), seed=seed, budget=budget)
        for level in sorted(plan.found, key=LADDER.index)
        for cell in _cells(envs, tasks, plan, designs, TRAINED, Ref(level))
        for seed in range(plan.seeds)
    ]


def evaluations(trained: Iterable[RunSpec], plan: StudyPlan) -> list[RunSpec]:
    """The runs that evaluate the gaits of these training runs, one for each cell, level found at and fidelity."""
    homes: dict[RunSpec, list[str]] = {}
    for spec in trained:
        homes.setdefault(replace(spec, seed=0), []).append(run_name(spec.key()))
    beyond = [registry.resolve(Kind.FIDELITY, Ref(plan.beyond))] if plan.beyond else []
    return [
        *(_probe(home, fidelity, plan.stages * len(names), of="+".join(names), last=plan.stages,
                 gradients=len(names) if _has_gradients(fidelity, plan) else 0)
          for fidelity in plan.fidelities()
          for home, names in homes.items()),
        *(_probe(home, fidelity, 1, of=names[0], last=1) for fidelity in beyond for home, names in homes.items()),
    ]  # fmt: skip


def draws(
    envs: Sequence[Ref], tasks: Sequence[Ref], plan: StudyPlan, designs: Sequence[Ref] | None = None
) -> list[RunSpec]:
    """The runs that evaluate random controllers."""
    return [
        _probe(cell, fidelity, plan.draws)
        for fidelity in plan.fidelities()
        for cell in _cells(envs, tasks, plan, designs, STRONG, fidelity)
        if plan.draws
    ]


def _cells(
    envs: Sequence[Ref], tasks: Sequence[Ref], plan: StudyPlan, designs: Sequence[Ref] | None, controller: Ref,
    fidelity: Ref,
) -> Iterator[RunSpec]:  # fmt: skip
    """The cells at a fidelity; method, seed and budget are still to be set."""
    if not envs or not tasks:
        raise UsageError("The study needs an environment and a task. Name at least one of each.")
    for env, task in product(envs, tasks):
        for design in designs or map(Ref, DESIGNS.get(env.name, LAND_DESIGNS)):
            parts = zip(AXES, (env, task, design, controller, Ref("probe"), fidelity), strict=True)
            refs: dict[str, Any] = {axis: registry.resolve(KINDS[axis], ref) for axis, ref in parts}
            yield RunSpec(**refs, seed=0, budget=Budget("iterations", 1), frames=plan.frames)


def _probe(cell: RunSpec, fidelity: Ref, count: int, **settings: str | int) -> RunSpec:
    method = registry.resolve(Kind.METHOD, Ref("probe", params=tuple(sorted(settings.items()))))
    return replace(cell, method=method, seed=0, fidelity=fidelity, budget=Budget("iterations", count))


def _has_gradients(fidelity: Ref, plan: StudyPlan) -> bool:
    """Whether gradients are computed there: at plain levels up to `plan.gradients`."""
    is_plain = fidelity == registry.resolve(Kind.FIDELITY, Ref(fidelity.name))
    return bool(plan.gradients) and is_plain and LADDER.index(fidelity.name) <= LADDER.index(plan.gradients)
